// @ts-check
// Curves on a canvas.

/** @typedef {import('./layers.mjs').Layer} Layer */
/** @typedef {{ size: { width: number, height: number }, camera: import('./view.mjs').Camera }} Seen what a canvas shows */

/** Points nearer to the last one drawn than this are left out, in pixels. */
const DETAIL = 0.6;
/** A path of canvases is quick while it is short. */
const PATH_POINTS = 4000;
/** Of layers with more points than this, thinner copies are drawn where they look the same. */
const LARGE = 50000;
/** Vertices are drawn while no more than these are seen. */
const MOST_VERTICES = 1500;

/** @type {WeakMap<Layer, Map<number, Layer>>} */
const copies = new WeakMap();

/**
 * The layer, or a copy without points that are nearer to the last one than a distance.
 * @param {Layer} layer
 * @param {number} distance
 * @returns {Layer}
 */
function thinned(layer, distance) {
  if (layer.cubic || layer.coords.length / 2 < LARGE) return layer;
  const power = Math.floor(Math.log(distance) / Math.log(4));
  const known = copies.get(layer) ?? new Map();
  copies.set(layer, known);
  if (!known.has(power)) known.set(power, thin(layer, 4 ** power));
  return known.get(power);
}

/**
 * @param {Layer} layer
 * @param {number} distance
 */
function thin(layer, distance) {
  const { coords, offsets } = layer;
  const kept = new Float64Array(coords.length);
  const ends = new Uint32Array(offsets.length);
  let count = 0;
  for (let i = 0; i + 1 < offsets.length; i++) {
    let [lastX, lastY] = [Infinity, Infinity];
    for (let j = offsets[i]; j < offsets[i + 1]; j++) {
      const [x, y] = [coords[2 * j], coords[2 * j + 1]];
      if (Math.abs(x - lastX) < distance && Math.abs(y - lastY) < distance && j + 1 < offsets[i + 1]) continue;
      kept[2 * count] = lastX = x;
      kept[2 * count++ + 1] = lastY = y;
    }
    ends[i + 1] = count;
  }
  return { ...layer, coords: kept.slice(0, 2 * count), offsets: ends };
}

/**
 * Draws curves. What is out of sight, or finer than pixels, is left out.
 * @param {CanvasRenderingContext2D} context
 * @param {Seen} seen
 * @param {Layer} whole
 * @param {{ stroke: string, width: number, fill?: string, vertices?: boolean, only?: Iterable<number>, dash?: number[], shift?: number,
 *   draft?: boolean }} style
 */
export function paintLayer(context, { camera, size }, whole, { stroke, width, fill, vertices = false, only, dash = [], shift = 0, draft = false }) {
  const { x: cx, y: cy, scale } = camera;
  const detail = draft ? 4 * DETAIL : DETAIL;
  const layer = thinned(whole, detail / scale);
  const { coords, offsets, closed, bounds, cubic } = layer;
  const [halfWidth, halfHeight] = [(size.width / 2 + 20) / scale, (size.height / 2 + 20) / scale];
  const [left, right, bottom, top] = [cx - shift - halfWidth, cx - shift + halfWidth, cy - halfHeight, cy + halfHeight];
  const [ox, oy] = [size.width / 2 - (cx - shift) * scale, size.height / 2 + cy * scale];
  const indices = only ?? offsets.subarray(1).keys();
  const seen = [];
  for (const i of indices) {
    const at = 4 * i;
    if (bounds[at] <= right && bounds[at + 2] >= left && bounds[at + 1] <= top && bounds[at + 3] >= bottom) seen.push(i);
  }
  if (fill) {
    context.beginPath();
    for (const i of seen) if (closed[i]) (cubic ? traceCubics : traceAll)(context, coords, offsets[i], offsets[i + 1], true, scale, ox, oy);
    context.fillStyle = fill;
    // Holes of maps turn the other way, and layers may lie on each other.
    context.fill(cubic ? 'evenodd' : 'nonzero');
  }
  Object.assign(context, { strokeStyle: stroke, lineWidth: width, lineJoin: draft ? 'bevel' : 'round', lineCap: draft ? 'butt' : 'round' });
  context.setLineDash(dash);
  context.beginPath();
  let [length, total] = [0, 0];
  const flush = () => {
    context.stroke();
    context.beginPath();
    length = 0;
  };
  const code = (/** @type {number} */ x, /** @type {number} */ y) => (x < left ? 1 : x > right ? 2 : 0) | (y < bottom ? 4 : y > top ? 8 : 0);
  for (const i of seen) {
    const [from, to] = [offsets[i], offsets[i + 1]];
    total += to - from;
    if (cubic) {
      traceCubics(context, coords, from, to, !!closed[i], scale, ox, oy);
      if ((length += to - from) > PATH_POINTS) flush();
      continue;
    }
    let [px, py] = [coords[2 * from], coords[2 * from + 1]];
    let [sx, sy] = [px * scale + ox, oy - py * scale];
    let [last, down] = [code(px, py), false];
    for (let j = from + 1; j < to + closed[i]; j++) {
      const k = j < to ? j : from;
      const [x, y] = [coords[2 * k], coords[2 * k + 1]];
      const [ex, ey] = [x * scale + ox, oy - y * scale];
      const now = code(x, y);
      if (Math.abs(ex - sx) < detail && Math.abs(ey - sy) < detail && j < to - 1) continue;
      if ((last & now) === 0) {
        if (!down) context.moveTo(sx, sy);
        context.lineTo(ex, ey);
        down = true;
        if (++length > PATH_POINTS) {
          flush();
          context.moveTo(ex, ey);
        }
      } else {
        down = false;
      }
      [sx, sy, last] = [ex, ey, now];
    }
  }
  context.stroke();
  context.setLineDash([]);
  // Vertices are seen once they are well apart.
  if (!vertices || layer.edge * scale < 14 || total > 20 * MOST_VERTICES) return;
  context.fillStyle = stroke;
  let drawn = 0;
  for (const i of seen) {
    for (let j = offsets[i]; j < offsets[i + 1]; j += cubic ? 3 : 1) {
      if (code(coords[2 * j], coords[2 * j + 1]) !== 0) continue;
      if (++drawn > MOST_VERTICES) return;
      context.beginPath();
      context.arc(coords[2 * j] * scale + ox, oy - coords[2 * j + 1] * scale, 0.9 + width / 2, 0, 7);
      context.fill();
    }
  }
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {Float64Array} coords
 * @param {number} from
 * @param {number} to
 * @param {boolean} closed
 * @param {number} scale
 * @param {number} ox
 * @param {number} oy
 */
function traceAll(context, coords, from, to, closed, scale, ox, oy) {
  let [sx, sy] = [coords[2 * from] * scale + ox, oy - coords[2 * from + 1] * scale];
  context.moveTo(sx, sy);
  for (let j = from + 1; j < to; j++) {
    const [x, y] = [coords[2 * j] * scale + ox, oy - coords[2 * j + 1] * scale];
    if (Math.abs(x - sx) < DETAIL && Math.abs(y - sy) < DETAIL) continue;
    context.lineTo(x, y);
    [sx, sy] = [x, y];
  }
  if (closed) context.closePath();
}

/** @type {typeof traceAll} */
function traceCubics(context, coords, from, to, closed, scale, ox, oy) {
  const [x, y] = [(/** @type {number} */ j) => coords[2 * j] * scale + ox, (/** @type {number} */ j) => oy - coords[2 * j + 1] * scale];
  context.moveTo(x(from), y(from));
  for (let j = from + 1; j + 1 < to; j += 3) {
    const end = j + 2 < to ? j + 2 : from;
    context.bezierCurveTo(x(j), y(j), x(j + 1), y(j + 1), x(end), y(end));
  }
  if (closed) context.closePath();
}
