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
    const numbers = arrays.flatMap(([, { data }]) => (typeof data[0] === 'string' ? [] : [...data]));
    return { numbers, rest: JSON.stringify(arrays.map(([key, { shape, data }]) => [key, shape, typeof data[0] === 'string' ? data : null])) };
  }
  if (name.endsWith('.trk')) {
    const body = new Uint8Array(bytes.subarray(TRK_HEADER)).buffer;
    return { numbers: [...new Float32Array(body, 0, body.byteLength >> 2)], rest: String(bytes.subarray(0, TRK_HEADER)) };
  }
  const text = new TextDecoder().decode(bytes);
  return { numbers: (text.match(NUMBER) ?? []).map(Number), rest: text.replace(NUMBER, '#') };
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
