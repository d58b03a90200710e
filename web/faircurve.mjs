// @ts-check
// The program faircurve, compiled to WebAssembly for WASI, on a file system in memory.

import { File, OpenFile, PreopenDirectory, WASI } from './vendor/browser_wasi_shim/index.js';
import { readNpz, writeNpz } from './npz.mjs';

export { readNpz, writeNpz };

/** @typedef {import('./faircurve.d.mts').Run} Run */
/** @typedef {import('./faircurve.d.mts').FitOptions} FitOptions */
/** @typedef {import('./faircurve.d.mts').FitResult} FitResult */
/** @typedef {import('./faircurve.d.mts').Source} Source */

/** The exit status of a program that ended itself: a panic, or memory that ran out. */
const ABORTED = 134;

// The library copies a whole file at every write that makes it longer. Here its buffer doubles.
OpenFile.prototype.fd_write = function (/** @type {Uint8Array} */ bytes) {
  const [{ file }, start] = [this, Number(this.file_pos)];
  const end = start + bytes.length;
  if (end > file.data.length) {
    let { buffer } = file.data;
    if (end > buffer.byteLength) {
      const grown = new Uint8Array(Math.max(2 * buffer.byteLength, end));
      grown.set(file.data);
      buffer = grown.buffer;
    }
    file.data = new Uint8Array(buffer, 0, end);
  }
  file.data.set(bytes, start);
  this.file_pos = BigInt(end);
  return { ret: 0, nwritten: bytes.length };
};

/**
 * Compiles the program.
 * @param {Source} [source] its address, its bytes, or the module itself; by default the file beside this one
 */
export async function load(source = new URL('./dist/faircurve.wasm', import.meta.url)) {
  return new Faircurve(await compiled(source));
}

/**
 * @param {Source} source
 * @returns {Promise<WebAssembly.Module>}
 */
async function compiled(source) {
  if (source instanceof WebAssembly.Module) return source;
  if (ArrayBuffer.isView(source) || source instanceof ArrayBuffer) {
    return WebAssembly.compile(/** @type {BufferSource} */ (source));
  }
  const address = new URL(source, import.meta.url);
  if (address.protocol === 'file:') {
    const { readFile } = await import('node:fs/promises');
    return WebAssembly.compile(await readFile(address));
  }
  const response = await fetch(address);
  if (!response.ok) throw new Error(`cannot read ${address}: ${response.status} ${response.statusText}`);
  // Some servers do not know the type, which streaming asks for.
  const isTyped = response.headers.get('content-type')?.startsWith('application/wasm');
  return isTyped ? WebAssembly.compileStreaming(response) : WebAssembly.compile(await response.arrayBuffer());
}

export class Faircurve {
  /** @param {WebAssembly.Module} module */
  constructor(module) {
    this.module = module;
  }

  /**
   * Runs the program, as a command line does.
   * @param {string[]} args what stands behind `faircurve` on the command line
   * @param {Record<string, Uint8Array | string>} [files] the files of its folder, by name
   * @returns {Run} the files are those that it wrote
   */
  run(args, files = {}) {
    /** @type {Map<string, File>} */
    const folder = new Map();
    for (const [name, content] of Object.entries(files)) {
      folder.set(name, new File(typeof content === 'string' ? new TextEncoder().encode(content) : content));
    }
    const given = new Set(folder.values());
    const [input, stdout, stderr] = [0, 1, 2].map(() => new File([]));
    const descriptors = [input, stdout, stderr].map((file) => new OpenFile(file));
    const wasi = new WASI(['faircurve', ...args], [], [...descriptors, new PreopenDirectory('.', folder)], { debug: false });
    const imports = { ...wasi.wasiImport, args_sizes_get: sizesOf(wasi) };
    const instance = new WebAssembly.Instance(this.module, { wasi_snapshot_preview1: imports });
    let status = ABORTED;
    try {
      status = wasi.start(/** @type {any} */ (instance));
    } catch (error) {
      if (!(error instanceof WebAssembly.RuntimeError || error instanceof RangeError)) throw error;
    }
    const written = [...folder].filter(([, file]) => file instanceof File && !given.has(file));
    return {
      status,
      stdout: stdout.data,
      stderr: new TextDecoder().decode(stderr.data),
      files: Object.fromEntries(written.map(([name, file]) => [name, file.data])),
      memoryBytes: /** @type {WebAssembly.Memory} */ (instance.exports.memory).buffer.byteLength,
    };
  }

  /**
   * Fits a curve to every point list.
   * @param {Float64Array} coords the points of all curves, one after the other
   * @param {ArrayLike<number>} offsets curve i has the points offsets[i] … offsets[i + 1] − 1
   * @param {FitOptions} [options]
   * @returns {FitResult}
   */
  fit(coords, offsets, options = {}) {
    const { dimension = 2, closed, t, weights, files, ...others } = options;
    const count = offsets.length - 1;
    /** @type {Parameters<typeof writeNpz>[0]} */
    const arrays = {
      coords: { shape: [coords.length / dimension, dimension], data: coords },
      offsets: { shape: [offsets.length], data: BigInt64Array.from(Array.from(offsets), BigInt) },
    };
    if (t) arrays.t = { shape: [t.length], data: Float64Array.from(t) };
    if (weights) arrays.weight = { shape: [weights.length], data: Float64Array.from(weights) };
    if (closed !== undefined) {
      const flags = typeof closed === 'boolean' ? Array(count).fill(closed) : [...closed];
      arrays.closed = { shape: [flags.length], data: Uint8Array.from(flags, Number) };
    }
    const args = ['fit', 'in.npz', '-o', 'out.npz', '--report', 'report.json', '--quiet', ...words(others)];
    const run = this.run(args, { ...files, 'in.npz': writeNpz(arrays) });
    if (!('report.json' in run.files)) throw new Error(sentence(run.stderr));
    const report = JSON.parse(new TextDecoder().decode(run.files['report.json']));
    const { coords: points, offsets: ends, ...columns } = readNpz(run.files['out.npz']);
    for (const name of ['closed', 'names', 'status']) delete columns[name];
    return {
      coords: /** @type {Float64Array} */ (points.data),
      offsets: Uint32Array.from(/** @type {Float64Array} */ (ends.data)),
      status: report.curves.map((/** @type {any} */ curve) => curve.status),
      message: report.curves.map((/** @type {any} */ curve) => curve.message ?? ''),
      report,
      columns: Object.fromEntries(Object.entries(columns).map(([name, column]) => [name, /** @type {Float64Array} */ (column.data)])),
    };
  }
}

/**
 * The library counts letters in place of bytes.
 * @param {WASI} wasi
 */
function sizesOf(wasi) {
  return (/** @type {number} */ count, /** @type {number} */ size) => {
    const memory = new DataView(wasi.inst.exports.memory.buffer);
    const bytes = wasi.args.map((argument) => new TextEncoder().encode(argument).length + 1);
    memory.setUint32(count, bytes.length, true);
    memory.setUint32(size, bytes.reduce((sum, length) => sum + length, 0), true);
    return 0;
  };
}

/**
 * Options as a command line has them: `minRadius: 2` is `--min-radius=2`. Of a list of lists every
 * entry is an option of its own, as in `keepOut: [[0, 0, 1], [5, 0, 1]]`.
 * @param {Record<string, any>} options
 * @returns {string[]}
 */
export function words(options) {
  const text = (/** @type {any} */ value) => {
    if (Array.isArray(value)) return value.join(',');
    if (value !== null && typeof value === 'object') return Object.entries(value).map(([name, weight]) => `${name}=${weight}`).join(',');
    return String(value);
  };
  return Object.entries(options).flatMap(([name, value]) => {
    const option = `--${name.replace(/[A-Z]/g, (letter) => `-${letter.toLowerCase()}`)}`;
    if (value === undefined || value === false) return [];
    if (value === true) return [option];
    const values = Array.isArray(value) && Array.isArray(value[0]) ? value : [value];
    return values.map((one) => `${option}=${text(one)}`);
  });
}

/**
 * What the program said last, without its name.
 * @param {string} stderr
 */
export function sentence(stderr) {
  const lines = stderr.trim().split('\n');
  const at = lines.findLastIndex((line) => /^(faircurve|error): /.test(line));
  return lines.slice(Math.max(at, 0)).join('\n').replace(/^(faircurve|error): /, '');
}
