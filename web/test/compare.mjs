// Compares files number by number.
import { gunzipSync } from 'node:zlib';
import { readNpz } from '../npz.mjs';

const NUMBER = /-?\d+(?:\.\d+)?(?:e[+-]?\d+)?/gi;
/** Bytes of the header of a TRK file. */
const TRK_HEADER = 1000;

/** Numbers of a file in order, and everything between them. */
function contentOf(name, bytes) {
  if (name.endsWith('.gz')) return contentOf(name.slice(0, -3), gunzipSync(bytes));
  if (name.endsWith('.npz')) {
    const arrays = Object.entries(readNpz(bytes));
    const isExact = ([key, { data }]) => key === 'offsets' || typeof data[0] === 'string';
    const numbers = arrays.filter((array) => !isExact(array)).flatMap(([, { data }]) => [...data]);
    return { numbers, rest: JSON.stringify(arrays.map((array) => [array[0], array[1].shape, isExact(array) ? [...array[1].data] : null])) };
  }
  if (name.endsWith('.trk')) {
    const body = new Uint8Array(bytes.subarray(TRK_HEADER)).buffer;
    return { numbers: [...new Float32Array(body, 0, body.byteLength >> 2)], rest: String(bytes.subarray(0, TRK_HEADER)) };
  }
  const text = new TextDecoder().decode(bytes);
  if (name.endsWith('.topojson')) return contentOfTopology(JSON.parse(text));
  return { numbers: (text.match(NUMBER) ?? []).map(Number), rest: text.replace(NUMBER, '#') };
}

/** The positions of arcs, which the file has as steps from one to the next. */
function contentOfTopology({ arcs, transform, ...others }) {
  const { scale = [1, 1], translate = [0, 0] } = transform ?? {};
  const numbers = arcs.flatMap((arc) => {
    let [x, y] = [0, 0];
    return arc.flatMap(([dx, dy]) => {
      [x, y] = transform ? [x + dx, y + dy] : [dx, dy];
      return [x * scale[0] + translate[0], y * scale[1] + translate[1]];
    });
  });
  return { numbers, rest: JSON.stringify([arcs.map((arc) => arc.length), others.objects]) };
}

/** The largest difference of two files' numbers, as a part of the largest number; Infinity where the rest differs. */
export function difference(name, a, b) {
  const [one, other] = [contentOf(name, a), contentOf(name, b)];
  if (one.rest !== other.rest || one.numbers.length !== other.numbers.length) return Infinity;
  let [size, most] = [0, 0];
  one.numbers.forEach((number, i) => {
    size = Math.max(size, Math.abs(number) || 0);
    if (!Object.is(number, other.numbers[i])) most = Math.max(most, Math.abs(number - other.numbers[i]));
  });
  return most / (size || 1);
}
