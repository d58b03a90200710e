// @ts-check
// A worker: paints curves before and after onto the page's canvas.

import { paintLayer } from './curves.mjs';

/** Polygons are filled while they have no more points than this. */
const MOST_FILLED = 60000;
/** A picture that takes longer than this is a draft while it moves, in milliseconds. */
const SLOW = 30;
/** Many open curves, and when they are apart: the pixels of an edge. */
const [MANY, APART] = [200, 24];
/** A picture that was moved rests after this, in milliseconds. */
const REST = 160;

/** @type {any} what is painted */
const state = { before: null, after: null, marks: [], unusable: [] };
/** @type {OffscreenCanvas} */
let canvas;
/** @type {OffscreenCanvasRenderingContext2D} */
let context;
/** @type {any[]} timers, and how long the last picture took */
let [pending, rest, lasted] = [0, 0, 0];

addEventListener('message', ({ data }) => {
  if (data.canvas) {
    canvas = data.canvas;
    context = /** @type {OffscreenCanvasRenderingContext2D} */ (canvas.getContext('2d'));
    return;
  }
  Object.assign(state, data);
  // Several messages make one picture.
  pending ||= setTimeout(() => {
    pending = 0;
    clearTimeout(rest);
    const draft = state.moves && lasted > SLOW;
    paint(draft);
    if (draft) rest = setTimeout(() => paint(false), REST);
  });
});

/** Curves that lie on each other by the hundred are drawn thin until they come apart. @param {any} layer */
function isDense({ offsets, closed, edge }) {
  return offsets.length > MANY && !closed.includes(1) && Math.max(edge, state.before.edge) * state.camera.scale < APART;
}

/** @param {boolean} draft */
function paint(draft) {
  const { before, after, marks, unusable, size, ratio, camera, colours, show, isWorld, asked } = state;
  if (!size) return;
  const started = performance.now();
  const [width, height] = [Math.round(size.width * ratio), Math.round(size.height * ratio)];
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, size.width, size.height);
  if (before) {
    const shown = show.after ? after : null;
    const fill = !draft && (shown ?? before).coords.length / 2 <= MOST_FILLED;
    // A map of the whole world goes on at both of its sides.
    for (const shift of isWorld ? [-360, 0, 360] : [0]) {
      const style = { vertices: !draft, draft, shift };
      if (show.before) paintLayer(/** @type {any} */ (context), state, before, { ...style, stroke: colours.before, width: 1.2, fill: fill && !shown ? colours['before-fill'] : undefined });
      if (shown) paintLayer(/** @type {any} */ (context), state, shown, { ...style, stroke: colours.after, width: isDense(shown) ? 0.9 : 1.7, fill: fill ? colours['after-fill'] : undefined });
      if (unusable.length > 0) paintLayer(/** @type {any} */ (context), state, before, { stroke: colours.bad, width: 2, only: unusable, dash: [5, 4], shift });
    }
    context.strokeStyle = colours.cross;
    context.lineWidth = 2;
    for (const [x, y] of marks) {
      context.beginPath();
      context.arc((x - camera.x) * camera.scale + size.width / 2, (camera.y - y) * camera.scale + size.height / 2, 9, 0, 7);
      context.stroke();
    }
  }
  if (!draft) lasted = performance.now() - started;
  postMessage({ asked, milliseconds: performance.now() - started, draft });
}
