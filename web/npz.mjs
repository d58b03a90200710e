// @ts-check
// NPZ as the program writes and reads it: a ZIP archive of arrays in NumPy's format, stored without compression.

/** @typedef {{ shape: number[], data: Float64Array | Uint8Array | string[] }} NumpyArray */

const CRC_TABLE = Uint32Array.from({ length: 256 }, (_, n) => {
  for (let bit = 0; bit < 8; bit++) n = n & 1 ? 0xedb88320 ^ (n >>> 1) : n >>> 1;
  return n;
});

/** @param {Uint8Array} bytes */
function crc32(bytes) {
  let crc = ~0;
  for (const byte of bytes) crc = CRC_TABLE[(crc ^ byte) & 255] ^ (crc >>> 8);
  return ~crc >>> 0;
}

/**
 * Reads the arrays of an NPZ file. Integers become floats, which hold them exactly up to 2⁵³.
 * @param {Uint8Array} bytes
 * @returns {Record<string, NumpyArray>}
 */
export function readNpz(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  /** @type {Record<string, NumpyArray>} */
  const arrays = {};
  let at = 0;
  while (at + 30 <= bytes.length && view.getUint32(at, true) === 0x04034b50) {
    const [method, size] = [view.getUint16(at + 8, true), view.getUint32(at + 18, true)];
    const [nameBytes, extraBytes] = [view.getUint16(at + 26, true), view.getUint16(at + 28, true)];
    const name = new TextDecoder().decode(bytes.subarray(at + 30, at + 30 + nameBytes));
    if (method !== 0) throw new Error(`${name} is compressed: write it with numpy.savez, which does not compress`);
    const start = at + 30 + nameBytes + extraBytes;
    arrays[name.replace(/\.npy$/, '')] = readArray(bytes.subarray(start, start + size), name);
    at = start + size;
  }
  return arrays;
}

/**
 * @param {Uint8Array} bytes
 * @param {string} name
 * @returns {NumpyArray}
 */
function readArray(bytes, name) {
  const headerBytes = bytes[8] + 256 * bytes[9];
  const header = new TextDecoder().decode(bytes.subarray(10, 10 + headerBytes));
  const kind = /'descr': '([^']*)'/.exec(header)?.[1] ?? '';
  const shape = (/'shape': \(([^)]*)\)/.exec(header)?.[1] ?? '').split(',').filter((length) => length.trim()).map(Number);
  const count = shape.reduce((product, length) => product * length, 1);
  // A copy: elements of eight bytes lie at multiples of eight. A slice of a Buffer of Node is none.
  const { buffer } = new Uint8Array(bytes.subarray(10 + headerBytes));
  if (kind === '<f8') return { shape, data: new Float64Array(buffer, 0, count) };
  if (kind === '<i8') return { shape, data: Float64Array.from(new BigInt64Array(buffer, 0, count), Number) };
  if (kind === '|b1' || kind === '|u1') return { shape, data: new Uint8Array(buffer, 0, count) };
  if (kind.startsWith('<U')) {
    const [length, points] = [Number(kind.slice(2)), new Uint32Array(buffer)];
    const text = (/** @type {number} */ i) => {
      const own = points.subarray(i * length, (i + 1) * length);
      const end = own.indexOf(0);
      return Array.from(end < 0 ? own : own.subarray(0, end), (point) => String.fromCodePoint(point)).join('');
    };
    return { shape, data: Array.from({ length: count }, (_, i) => text(i)) };
  }
  throw new Error(`${name} has elements of type ${kind}: <f8, <i8, |b1, |u1 and <U are read`);
}

/**
 * Writes arrays of 64-bit floats, of 64-bit integers, and of bytes as booleans, into an NPZ file.
 * @param {Record<string, { shape: number[], data: Float64Array | BigInt64Array | Uint8Array }>} arrays
 * @returns {Uint8Array}
 */
export function writeNpz(arrays) {
  const [entries, directory] = [/** @type {Uint8Array[]} */ ([]), /** @type {Uint8Array[]} */ ([])];
  let at = 0;
  for (const [name, { shape, data }] of Object.entries(arrays)) {
    const kind = data instanceof Float64Array ? '<f8' : data instanceof BigInt64Array ? '<i8' : '|b1';
    const text = `{'descr': '${kind}', 'fortran_order': False, 'shape': (${shape.map((n) => `${n}, `).join('')}), }`;
    // The elements begin at a multiple of 64 bytes. A new line ends the header.
    const length = 64 * Math.ceil((text.length + 11) / 64) - 10;
    const start = Uint8Array.of(0x93, ...new TextEncoder().encode('NUMPY'), 1, 0, length & 255, length >> 8);
    const header = new TextEncoder().encode(`${text.padEnd(length - 1)}\n`);
    const content = joined([start, header, new Uint8Array(data.buffer, data.byteOffset, data.byteLength)]);
    const file = new TextEncoder().encode(`${name}.npy`);
    const shared = [20, 0, 0, 0, 0x21, crc32(content), content.length, content.length, file.length, 0];
    entries.push(record([0x04034b50, ...shared], 'WHHHHHWWWHH', file), content);
    directory.push(record([0x02014b50, 20, ...shared, 0, 0, 0, 0, at], 'WHHHHHHWWWHHHHHWW', file));
    at += 30 + file.length + content.length;
  }
  const size = directory.reduce((sum, entry) => sum + entry.length, 0);
  const end = record([0x06054b50, 0, 0, entries.length / 2, entries.length / 2, size, at, 0], 'WHHHHWWH', new Uint8Array());
  return joined([...entries, ...directory, end]);
}

/**
 * Words (W, 4 bytes) and half words (H), and what follows them.
 * @param {number[]} values
 * @param {string} widths
 * @param {Uint8Array} rest
 */
function record(values, widths, rest) {
  const bytes = [...widths].flatMap((width, i) => Array.from({ length: width === 'W' ? 4 : 2 }, (_, k) => (values[i] >>> (8 * k)) & 255));
  return joined([Uint8Array.from(bytes), rest]);
}

/** @param {Uint8Array[]} parts */
function joined(parts) {
  const all = new Uint8Array(parts.reduce((sum, part) => sum + part.length, 0));
  let at = 0;
  for (const part of parts) {
    all.set(part, at);
    at += part.length;
  }
  return all;
}
