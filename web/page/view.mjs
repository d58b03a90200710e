// @ts-check
// A canvas that pans and zooms.

/** @typedef {import('./layers.mjs').Layer} Layer */
/** @typedef {{ x: number, y: number, scale: number }} Camera where the middle is, and pixels per unit */

/** Points nearer to the last one drawn than this are left out, in pixels. */
const DETAIL = 0.6;
/** A path of canvases is quick while it is short. */
const PATH_POINTS = 4000;
/** Vertices are drawn while no more than these are seen. */
const MOST_VERTICES = 1500;
const ZOOM = 1.4;

export class View {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {{ paint: (context: CanvasRenderingContext2D, view: View) => void, camera?: Camera, moved?: () => void,
   *   grab?: (event: PointerEvent, view: View) => ((event: PointerEvent, ended: boolean) => void) | null }} options
   *   `grab` may take a pointer, which then does not pan.
   */
  constructor(canvas, { paint, camera = { x: 0, y: 0, scale: 1 }, moved = () => this.request(), grab = () => null }) {
    this.canvas = canvas;
    this.paint = paint;
    this.camera = camera;
    this.moved = moved;
    this.grab = grab;
    this.context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
    /** @type {Map<number, { x: number, y: number, drag: ((event: PointerEvent, ended: boolean) => void) | null }>} */
    this.pointers = new Map();
    this.pending = 0;
    this.frames = 0;
    this.size = { width: 1, height: 1 };
    new ResizeObserver(() => this.resize()).observe(canvas);
    canvas.addEventListener('wheel', (event) => this.wheel(event), { passive: false });
    canvas.addEventListener('pointerdown', (event) => this.down(event));
    canvas.addEventListener('pointermove', (event) => this.move(event));
    for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, (event) => this.up(/** @type {PointerEvent} */ (event)));
    canvas.addEventListener('keydown', (event) => this.key(event));
    this.resize();
  }

  resize() {
    const { width, height } = this.canvas.getBoundingClientRect();
    if (width === 0) return;
    const ratio = Math.min(devicePixelRatio, 2);
    this.size = { width, height };
    this.ratio = ratio;
    Object.assign(this.canvas, { width: Math.round(width * ratio), height: Math.round(height * ratio) });
    this.fitted?.();
    this.request();
  }

  /** Draws before the next frame is shown. */
  request() {
    this.pending ||= requestAnimationFrame(() => {
      this.pending = 0;
      this.frames++;
      const { context, ratio = 1 } = this;
      context.setTransform(ratio, 0, 0, ratio, 0, 0);
      context.clearRect(0, 0, this.size.width, this.size.height);
      this.paint(context, this);
    });
  }

  /**
   * Shows a box, at every size of the canvas, until the view is moved.
   * @param {number[]} box
   */
  fit(box) {
    this.home = box;
    this.fitted = () => {
      const [x0, y0, x1, y1] = box;
      const { width, height } = this.size;
      const scale = 0.92 * Math.min(width / (x1 - x0 || 1), height / (y1 - y0 || 1));
      Object.assign(this.camera, { x: (x0 + x1) / 2, y: (y0 + y1) / 2, scale });
      this.moved();
    };
    this.fitted();
  }

  /** @param {number} x @param {number} y */
  toScreen(x, y) {
    const { camera, size } = this;
    return [(x - camera.x) * camera.scale + size.width / 2, (camera.y - y) * camera.scale + size.height / 2];
  }

  /** @param {number} x @param {number} y */
  toWorld(x, y) {
    const { camera, size } = this;
    return [(x - size.width / 2) / camera.scale + camera.x, camera.y - (y - size.height / 2) / camera.scale];
  }

  /** Where a pointer is on the canvas. @param {MouseEvent} event */
  at(event) {
    const box = this.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  /** @param {number} dx @param {number} dy pixels */
  pan(dx, dy) {
    this.fitted = undefined;
    this.camera.x -= dx / this.camera.scale;
    this.camera.y += dy / this.camera.scale;
    this.moved();
  }

  /** Zooms about a place of the canvas. @param {number} factor */
  zoom(factor, x = this.size.width / 2, y = this.size.height / 2) {
    this.fitted = undefined;
    const [wx, wy] = this.toWorld(x, y);
    this.camera.scale *= factor;
    const [nx, ny] = this.toWorld(x, y);
    this.camera.x += wx - nx;
    this.camera.y += wy - ny;
    this.moved();
  }

  /** @param {WheelEvent} event */
  wheel(event) {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 16 : 1;
    // A pinch on a touchpad arrives as a wheel with the control key.
    this.zoom(Math.exp(-event.deltaY * lines * (event.ctrlKey ? 0.01 : 0.0018)), ...this.at(event));
  }

  /** @param {PointerEvent} event */
  down(event) {
    this.canvas.focus({ preventScroll: true });
    const [x, y] = this.at(event);
    const drag = this.pointers.size === 0 ? this.grab(event, this) : null;
    this.pointers.set(event.pointerId, { x, y, drag });
    this.canvas.setPointerCapture(event.pointerId);
  }

  /** @param {PointerEvent} event */
  move(event) {
    const pointer = this.pointers.get(event.pointerId);
    if (!pointer) return;
    const [x, y] = this.at(event);
    const others = [...this.pointers].filter(([id]) => id !== event.pointerId);
    if (pointer.drag) {
      pointer.drag(event, false);
    } else if (others.length === 0) {
      this.pan(x - pointer.x, y - pointer.y);
    } else {
      const [, other] = others[0];
      const spread = Math.hypot(x - other.x, y - other.y) / (Math.hypot(pointer.x - other.x, pointer.y - other.y) || 1);
      this.zoom(spread, (x + other.x) / 2, (y + other.y) / 2);
      this.pan((x - pointer.x) / 2, (y - pointer.y) / 2);
    }
    Object.assign(pointer, { x, y });
  }

  /** @param {PointerEvent} event */
  up(event) {
    this.pointers.get(event.pointerId)?.drag?.(event, true);
    this.pointers.delete(event.pointerId);
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey) return;
    const step = 60;
    const moves = /** @type {Record<string, () => void>} */ ({
      '+': () => this.zoom(ZOOM), '=': () => this.zoom(ZOOM), '-': () => this.zoom(1 / ZOOM),
      0: () => this.home && this.fit(this.home),
      ArrowLeft: () => this.pan(step, 0), ArrowRight: () => this.pan(-step, 0),
      ArrowUp: () => this.pan(0, step), ArrowDown: () => this.pan(0, -step),
    });
    if (!moves[event.key]) return;
    event.preventDefault();
    moves[event.key]();
  }
}

/**
 * The box around all curves.
 * @param {Layer} layer
 */
export function boxOf({ bounds }) {
  const box = [Infinity, Infinity, -Infinity, -Infinity];
  for (let i = 0; i < bounds.length; i += 4) {
    box[0] = Math.min(box[0], bounds[i]);
    box[1] = Math.min(box[1], bounds[i + 1]);
    box[2] = Math.max(box[2], bounds[i + 2]);
    box[3] = Math.max(box[3], bounds[i + 3]);
  }
  return Number.isFinite(box[0]) && Number.isFinite(box[3]) ? box : [0, 0, 1, 1];
}

/**
 * Draws curves. What is out of sight, or finer than pixels, is left out.
 * @param {CanvasRenderingContext2D} context
 * @param {View} view
 * @param {Layer} layer
 * @param {{ stroke: string, width: number, fill?: string, vertices?: boolean, only?: Iterable<number>, dash?: number[], shift?: number }} style
 */
export function paintLayer(context, view, layer, { stroke, width, fill, vertices = false, only, dash = [], shift = 0 }) {
  const { coords, offsets, closed, bounds, cubic } = layer;
  const { camera: { x: cx, y: cy, scale }, size } = view;
  const [left, bottom] = view.toWorld(-20 - shift * scale, size.height + 20);
  const [right, top] = view.toWorld(size.width + 20 - shift * scale, -20);
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
  Object.assign(context, { strokeStyle: stroke, lineWidth: width, lineJoin: 'round', lineCap: 'round' });
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
      if (Math.abs(ex - sx) < DETAIL && Math.abs(ey - sy) < DETAIL && j < to - 1) continue;
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
