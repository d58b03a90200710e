// @ts-check
// A canvas that pans and zooms.

/** @typedef {{ x: number, y: number, scale: number }} Camera where the middle is, and pixels per unit */

const ZOOM = 1.4;

export class View {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {{ paint: (context: CanvasRenderingContext2D | null, view: View) => void, isElsewhere?: boolean, camera?: Camera, moved?: () => void,
   *   grab?: (event: PointerEvent, view: View) => ((event: PointerEvent, ended: boolean) => void) | null }} options
   *   `grab` may take a pointer, which then does not pan. A canvas that is painted elsewhere has no context.
   */
  constructor(canvas, { paint, isElsewhere = false, camera = { x: 0, y: 0, scale: 1 }, moved = () => this.request(), grab = () => null }) {
    this.canvas = canvas;
    this.paint = paint;
    this.camera = camera;
    this.moved = moved;
    this.grab = grab;
    this.context = isElsewhere ? null : canvas.getContext('2d');
    /** @type {Map<number, { x: number, y: number, drag: ((event: PointerEvent, ended: boolean) => void) | null }>} */
    this.pointers = new Map();
    this.pending = 0;
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
    if (this.context) Object.assign(this.canvas, { width: Math.round(width * ratio), height: Math.round(height * ratio) });
    this.fitted?.();
    this.request();
  }

  /** Draws before the next frame is shown. */
  request() {
    this.pending ||= requestAnimationFrame(() => {
      this.pending = 0;
        const { context, ratio = 1 } = this;
      context?.setTransform(ratio, 0, 0, ratio, 0, 0);
      context?.clearRect(0, 0, this.size.width, this.size.height);
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

  /** @param {number} x @param {number} y @returns {[number, number]} */
  toScreen(x, y) {
    const { camera, size } = this;
    return [(x - camera.x) * camera.scale + size.width / 2, (camera.y - y) * camera.scale + size.height / 2];
  }

  /** @param {number} x @param {number} y @returns {[number, number]} */
  toWorld(x, y) {
    const { camera, size } = this;
    return [(x - size.width / 2) / camera.scale + camera.x, camera.y - (y - size.height / 2) / camera.scale];
  }

  /** Where a pointer is on the canvas. @param {MouseEvent} event @returns {[number, number]} */
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
