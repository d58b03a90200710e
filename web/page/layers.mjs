// @ts-check
// Curves as the page draws them.

/**
 * How a file is read and drawn.
 * @typedef {{ geographic: boolean, cubic: boolean, columns: string, plane: 'xy' | 'xz' | 'yz' }} Look
 * @typedef {{ coords: Float64Array, offsets: Uint32Array, closed: Uint8Array, bounds: Float64Array,
 *   edge: number, cubic: boolean }} Layer
 * @typedef {{ box: number[], curves: number, points: number, area: number, rings: number, edge: number,
 *   dimension: number, geographic: boolean }} Summary
 */

const DEGREE = Math.PI / 180;

/**
 * Miller's projection, whose poles are at a finite distance; in degrees of the equator.
 * @param {number} latitude
 */
export function miller(latitude) {
  return 1.25 * Math.log(Math.tan(Math.PI / 4 + 0.4 * latitude * DEGREE)) / DEGREE;
}

/** @param {number} y */
export function latitudeOf(y) {
  return 2.5 * (Math.atan(Math.exp(0.8 * y * DEGREE)) - Math.PI / 4) / DEGREE;
}

/**
 * @param {ReturnType<typeof import('../npz.mjs').readNpz>} arrays
 * @param {Look} asked
 * @returns {{ layer: Layer, summary: Summary }}
 */
export function layerOf(arrays, asked) {
  const [{ shape: [count, dimension], data }, offsets] = [arrays.coords, Uint32Array.from(/** @type {any} */ (arrays.offsets.data))];
  const given = /** @type {Float64Array} */ (data);
  const curves = offsets.length - 1;
  const closed = /** @type {Uint8Array} */ (arrays.closed?.data ?? new Uint8Array(curves));
  const [a, b] = dimension === 3 ? [...asked.plane].map((axis) => 'xyz'.indexOf(axis)) : [0, 1];
  const coords = new Float64Array(2 * count);
  for (let i = 0; i < count; i++) {
    coords[2 * i] = given[dimension * i + a];
    coords[2 * i + 1] = given[dimension * i + b];
  }
  const look = { ...asked, geographic: asked.geographic && areDegrees(coords) };
  // The area of Béziers on the globe is not computed.
  let sum = 0;
  for (let i = 0; i < curves && !(look.cubic && look.geographic); i++) if (closed[i]) sum += Math.abs(area(coords, offsets[i], offsets[i + 1], look));
  const edge = medianEdge(coords, offsets);
  if (look.geographic) for (let i = 1; i < coords.length; i += 2) coords[i] = miller(coords[i]);
  const bounds = new Float64Array(4 * curves);
  const box = [Infinity, Infinity, -Infinity, -Infinity];
  for (let i = 0; i < curves; i++) {
    const own = [Infinity, Infinity, -Infinity, -Infinity];
    for (let j = offsets[i]; j < offsets[i + 1]; j++) include(own, coords[2 * j], coords[2 * j + 1]);
    bounds.set(own, 4 * i);
    if (own[0] <= own[2]) {
      include(box, own[0], own[1]);
      include(box, own[2], own[3]);
    }
  }
  const summary = { box: box[0] <= box[2] ? box : [0, 0, 1, 1], curves, points: count, area: sum, rings: closed.reduce((all, one) => all + one, 0), edge, dimension, geographic: look.geographic };
  return { layer: { coords, offsets, closed, bounds, edge, cubic: look.cubic }, summary };
}

/** Whether points may be longitudes and latitudes. @param {Float64Array} coords */
function areDegrees(coords) {
  return coords.every((value, i) => !(Math.abs(value) > (i % 2 ? 90 + 1e-9 : 360)));
}

/** Widens a box until it holds a point. @param {number[]} box @param {number} x @param {number} y */
function include(box, x, y) {
  if (x < box[0]) box[0] = x;
  if (y < box[1]) box[1] = y;
  if (x > box[2]) box[2] = x;
  if (y > box[3]) box[3] = y;
}

/**
 * The area within a closed curve; of longitudes and latitudes that on a sphere of radius 1.
 * @param {Float64Array} coords
 * @param {number} from
 * @param {number} to
 * @param {Look} look
 */
function area(coords, from, to, look) {
  if (look.cubic) return cubicArea(coords, from, to);
  let sum = 0;
  for (let i = from, last = to - 1; i < to; last = i++) {
    const [x0, y0, x1, y1] = [coords[2 * last], coords[2 * last + 1], coords[2 * i], coords[2 * i + 1]];
    if (!look.geographic) sum += x0 * y1 - x1 * y0;
    else sum -= ((((x1 - x0 + 540) % 360) + 360) % 360 - 180) * DEGREE * (Math.sin(y0 * DEGREE) + Math.sin(y1 * DEGREE));
  }
  return sum / 2;
}

/**
 * The area within a chain of cubics, exactly: ½∮ x dy − y dx, term by term.
 * @param {Float64Array} coords
 * @param {number} from
 * @param {number} to
 */
function cubicArea(coords, from, to) {
  const weights = [[0, 6, 3, 1], [-6, 0, 3, 3], [-3, -3, 0, 6], [-1, -3, -6, 0]];
  let sum = 0;
  for (let start = from; start + 2 < to; start += 3) {
    const place = [0, 1, 2, 3].map((k) => (start + k < to ? start + k : from));
    for (let j = 0; j < 4; j++) {
      for (let k = 0; k < 4; k++) sum += weights[j][k] * coords[2 * place[j]] * coords[2 * place[k] + 1];
    }
  }
  return sum / 20;
}

/**
 * @param {Float64Array} coords
 * @param {Uint32Array} offsets
 */
function medianEdge(coords, offsets) {
  const lengths = [];
  const step = Math.max(1, Math.floor(coords.length / 2e5));
  for (let i = 0; i + 1 < offsets.length; i++) {
    for (let j = offsets[i] + 1; j < offsets[i + 1]; j += step) {
      const length = Math.hypot(coords[2 * j] - coords[2 * j - 2], coords[2 * j + 1] - coords[2 * j - 1]);
      if (length > 0) lengths.push(length);
    }
  }
  return lengths.sort((a, b) => a - b)[lengths.length >> 1] ?? 1;
}

/**
 * The numbers beside the drawing.
 * @param {any} report
 * @param {Summary} before
 * @param {Summary} after
 */
export function statisticsOf(report, before, after) {
  const sum = (/** @type {string} */ what) => report.curves.reduce((/** @type {number} */ all, /** @type {any} */ curve) => all + curve[what], 0);
  const deviations = report.curves.map((/** @type {any} */ curve) => curve.max_deviation).filter(Number.isFinite);
  return {
    curves: report.curves.length,
    usable: report.totals.usable,
    pointsBefore: sum('points_in'),
    pointsAfter: sum('points_out'),
    deviation: deviations.reduce((/** @type {number} */ most, /** @type {number} */ one) => Math.max(most, one), 0),
    areaChange: before.area > 0 && after.area > 0 && after.rings >= before.rings ? after.area / before.area - 1 : null,
  };
}

/**
 * The crossings that the program names, where they are drawn.
 * @param {string} stderr
 * @param {Look} look
 */
export function marksOf(stderr, look) {
  return [...stderr.matchAll(/near (-?[\d.]+), (-?[\d.]+)/g)].map(([, x, y]) => [Number(x), look.geographic ? miller(Number(y)) : Number(y)]);
}
