// @ts-check
// What the program can do with a file, and the command lines for it.

/** @typedef {{ option: string, label: string, unit: 'ground' | 'file' | 'degrees', optional?: boolean }} Knob */

/** What `draw` is short for, but with points in place of Béziers, is for formats that hold points.
 * @type {Record<string, { title: string, says: string, words: string[], points?: string[], knob?: Knob }>} */
export const JOBS = {
  map: { title: 'Map', says: 'Borders stay shared, areas stay, nothing crosses.', words: ['map'], knob: { option: '--within', label: 'Within', unit: 'ground' } },
  draw: { title: 'Drawing', says: 'Traced noise becomes few Béziers with sharp corners.', words: ['draw'],
    points: ['fit', '--method', 'smoothing', '--tolerance', 'auto', '--corners', 'auto', '--only', 'paths', '--topology', 'yes'], knob: { option: '--within', label: 'Within', unit: 'file' } },
  track: { title: 'Track', says: 'Smooth in time, near every point.', words: ['track'], knob: { option: '--within', label: 'Within', unit: 'ground', optional: true } },
  tracts: { title: 'Streamlines', says: 'Smooth near every point.', words: ['tracts'], knob: { option: '--deviation', label: 'Within', unit: 'file' } },
  path: { title: 'Path', says: 'No turn sharper than a radius.', words: ['path'], knob: { option: '--min-radius', label: 'Smallest radius', unit: 'ground' } },
  natural: { title: 'Fit: natural splines', says: 'Through every point.', words: ['fit', '--method', 'natural'] },
  smoothing: { title: 'Fit: smoothing splines', says: 'Near every point.', words: ['fit', '--method', 'smoothing'], knob: { option: '--deviation', label: 'Within', unit: 'degrees' } },
  fair: { title: 'Fit: fair curves', says: 'Least bending and tautness, through every point or near it.', words: ['fit', '--method', 'fair'], knob: { option: '--deviation', label: 'Within', unit: 'degrees', optional: true } },
  scf: { title: 'Fit: smooth connection functions', says: 'The roundest curves through the points.', words: ['fit', '--method', 'scf', '--tension', '1'] },
};

/** Formats that the page reads, and the job that each is likely to want. */
const FORMATS = /** @type {Record<string, { job: string, geographic?: boolean, out?: string }>} */ ({
  geojson: { job: 'map', geographic: true }, topojson: { job: 'map', geographic: true }, json: { job: 'map', geographic: true },
  svg: { job: 'draw' }, csv: { job: 'natural' }, tsv: { job: 'natural' }, gpx: { job: 'track', geographic: true },
  trk: { job: 'tracts' }, tck: { job: 'tracts' }, npz: { job: 'natural' }, npy: { job: 'natural', out: 'npz' },
});

/** Formats that are written. */
export const WRITTEN = ['topojson', 'geojson', 'svg', 'csv', 'csv.gz', 'gpx', 'trk', 'tck', 'npz'];

/** Those that hold points in space alone. */
export const OF_SPACE = ['trk', 'tck'];

/**
 * A file's name in parts.
 * @param {string} name
 */
export function partsOf(name) {
  const [, base, format = '', packed = ''] = /^(.*?)(?:\.([a-z]+))?(\.gz)?$/i.exec(name) ?? [];
  return { base, format: format.toLowerCase(), packed: packed.toLowerCase() };
}

/**
 * What a file is, by its name and its first lines.
 * @param {string} name
 * @param {string} head
 */
export function guess(name, head) {
  const { format, packed } = partsOf(name);
  const known = FORMATS[format];
  if (!known) {
    const all = Object.keys(FORMATS).map((word) => `.${word}`).join(', ');
    throw new Error(`${name}: ${format ? `.${format}` : 'a name without an extension'} is no format that faircurve reads: ${all}, each also with .gz`);
  }
  const table = format === 'csv' || format === 'tsv' ? columnsOf(head) : null;
  const isJson = format.endsWith('json');
  const topojson = isJson && head.includes('"Topology"');
  const planar = isJson && /"crs"\s*:/.test(head) && !/CRS84|4326/.test(head);
  return {
    job: table?.times || (isJson && /"(coordTimes|times?)"/.test(head)) ? 'track' : known.job,
    geographic: table ? table.geographic : !planar && !!known.geographic,
    columns: table?.columns ?? '',
    out: (topojson ? 'topojson' : (known.out ?? format)) + packed,
  };
}

const ROLES = /** @type {[string, RegExp][]} */ ([
  ['curve', /^(curve|id|mmsi|track|trajectory|storm|sid|ship|name)$/i],
  ['x', /^(x|lon|long|lng|longitude)$/i],
  ['y', /^(y|lat|latitude)$/i],
  ['z', /^(z)$/i],
  ['t', /^(t|time|times|timestamp|datetime|date|hours|seconds|utc)$/i],
]);
const OWN = /^(curve|x|y|z|t|weight|tx|ty|tz|kx|ky|kz|nu|known|pinned|kmax|corridor|corridor_left|corridor_right|closed)$/;

/**
 * Which columns of a table are which.
 * @param {string} head
 */
export function columnsOf(head) {
  const [line = ''] = head.split(/\r?\n/).filter((text) => text.trim() && !text.startsWith('sep='));
  const separator = [';', '\t', ','].find((mark) => line.includes(mark)) ?? ',';
  const names = line.split(separator).map((name) => name.trim().replace(/^"|"$/g, ''));
  const roles = ROLES.map(([role, pattern]) => [role, names.find((name) => pattern.test(name))]).filter(([, name]) => name);
  const geographic = names.some((name) => /^(lon|long|lng|longitude)$/i.test(name));
  const isPlain = names.every((name) => OWN.test(name)) || roles.length < 2;
  return {
    geographic,
    times: roles.some(([role]) => role === 't'),
    columns: isPlain ? '' : roles.map(([role, name]) => `${role}=${name}`).join(','),
  };
}

/**
 * Words as a shell splits them.
 * @param {string} text
 */
export function split(text) {
  return [...text.matchAll(/(?:[^\s'"]+|'[^']*'|"[^"]*")+/g)].map(([word]) => word.replace(/'([^']*)'|"([^"]*)"/g, '$1$2'));
}

/**
 * A command line as a shell reads it.
 * @param {string[]} words
 */
export function quoted(words) {
  return words.map((word) => (/^[\w./=,:%+@-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`)).join(' ');
}

/**
 * A number with three digits, and no more zeros than it needs.
 * @param {number} value
 */
export function short(value) {
  return String(Number(value.toPrecision(3)));
}

/**
 * The nearest of 1, 2, 5, 10, 20, …
 * @param {number} value
 */
export function round(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return Number((([1, 2, 5, 10].findLast((step) => step * power <= 1.2 * value) ?? 1) * power).toPrecision(1));
}
