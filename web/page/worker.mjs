// @ts-check
// A worker: runs the program, and makes of its files what the page draws.

import { Faircurve, readNpz, sentence } from '../faircurve.mjs';
import { layerOf, marksOf, statisticsOf } from './layers.mjs';

/** @type {Faircurve} */
let program;

/** What a message may ask for. */
const TASKS = {
  /** The points of a file. @param {any} ask */
  read({ name, bytes, look }) {
    return readLayer({ [name]: bytes }, look);
  },

  /** A run whose output is read back. @param {any} ask */
  job({ args, files, output, report, look, before }) {
    const started = performance.now();
    const run = program.run(args, files);
    const milliseconds = performance.now() - started;
    const written = run.files[output];
    if (!written) throw new Error(sentence(run.stderr) || `the program ended with status ${run.status}`);
    const told = JSON.parse(new TextDecoder().decode(run.files[report]));
    const { layer, summary } = readLayer({ [output]: written }, look);
    return {
      layer, milliseconds, stderr: run.stderr,
      // The page holds no bytes, but a name for them.
      written: new Blob([/** @type {BlobPart} */ (written)]), status: run.status, memoryBytes: run.memoryBytes,
      statistics: statisticsOf(told, before, summary),
      unusable: run.status === 0 ? [] : told.curves.flatMap(unusable),
      marks: marksOf(run.stderr, look),
    };
  },

  /** Dots and the curve through them. @param {any} ask */
  dots({ args, csv }) {
    const started = performance.now();
    const run = program.run(args, { 'dots.csv': csv });
    const milliseconds = performance.now() - started;
    if (!run.files['curve.npz']) throw new Error(sentence(run.stderr) || `the program ended with status ${run.status}`);
    const arrays = readNpz(run.files['curve.npz']);
    const [curve] = JSON.parse(new TextDecoder().decode(run.files['report.json'])).curves;
    const column = (/** @type {string} */ name) => arrays[name]?.data;
    return {
      coords: column('coords'), curvature: column('curvature'), closed: !!column('closed')?.[0],
      tangents: [column('tangent_x'), column('tangent_y')], curve, milliseconds,
    };
  },
};

/**
 * A curve that is no result of its method. A single point is none either, but no trouble.
 * @param {any} curve
 * @param {number} i
 */
function unusable({ status, points_in, message }, i) {
  return ['converged', 'not_unique'].includes(status) || points_in === 1 ? [] : [{ i, status, message }];
}

/**
 * The curves of a file as the program reads them.
 * @param {Record<string, Uint8Array>} files
 * @param {import('./layers.mjs').Look} look
 */
function readLayer(files, look) {
  const [name] = Object.keys(files);
  const read = look.cubic ? ['bezier', name] : ['fit', name, '--samples', '1', '--topology', 'no', '--antimeridian', 'keep'];
  const columns = look.columns ? ['--columns', look.columns] : [];
  const run = program.run([...read, ...columns, '-o', 'points.npz', '--quiet'], files);
  if (!run.files['points.npz']) throw new Error(sentence(run.stderr) || `the program ended with status ${run.status}`);
  return layerOf(readNpz(run.files['points.npz']), look);
}

addEventListener('message', ({ data }) => {
  if (data.module) {
    program = new Faircurve(data.module);
    return;
  }
  try {
    const result = TASKS[/** @type {keyof typeof TASKS} */ (data.task)](data);
    postMessage({ id: data.id, result }, { transfer: buffersOf(result) });
  } catch (error) {
    postMessage({ id: data.id, error: error instanceof Error ? error.message : String(error) });
  }
});

/**
 * The buffers of a result, which move to the page without a copy.
 * @param {any} value
 * @returns {ArrayBuffer[]}
 */
function buffersOf(value) {
  if (ArrayBuffer.isView(value)) return [/** @type {ArrayBuffer} */ (value.buffer)];
  if (value === null || typeof value !== 'object') return [];
  return [...new Set(Object.values(value).flatMap(buffersOf))];
}
