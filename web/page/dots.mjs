// @ts-check
// The room of dots: four curves through the same dots, as they are dragged.

import { colour, whenColoursChange } from './colours.mjs';
import { quoted, short } from './jobs.mjs';
import { Latest } from './runner.mjs';
import { View } from './view.mjs';

/** @typedef {{ x: number, y: number, tangent: [number, number] | null }} Dot y points up */
/** @typedef {{ x: number, y: number, r: number }} Disc */

/** The sheet on which dots lie. */
const SHEET = [0, -50, 1000, 690];
/** How near a pointer must be to what it takes, in pixels. */
const [NEAR, NEAR_TOUCH] = [11, 24];
/** Pixels from a dot to the knob of its tangent. */
const HANDLE = 52;
/** Samples of a curve, and the fewest and the most of a span. */
const [SAMPLES, FEWEST, MOST] = [600, 16, 48];

const METHODS = /** @type {const} */ ({
  natural: { title: 'Natural spline', short: 'Natural', takes: 'ends' },
  smoothing: { title: 'Smoothing spline', short: 'Smoothing', takes: 'none' },
  fair: { title: 'Fair curve', short: 'Fair', takes: 'all' },
  scf: { title: 'Smooth connection functions', short: 'SCF', takes: 'all' },
});
/** @typedef {keyof typeof METHODS} Method */

/** What sliders mean: from 0 to 100 to a number of the program, or null for none. */
const KNOBS = /** @type {Record<string, { value: number, meaning: (at: number) => number | null }>} */ ({
  nu: { value: 17, meaning: (at) => two(1.25 * 16 ** (at / 100)) },
  tension: { value: 20, meaning: (at) => at / 20 },
  deviation: { value: 50, meaning: (at) => two(100 ** (at / 100)) },
  radius: { value: 0, meaning: (at) => (at === 0 ? null : two(2 * 100 ** (at / 100))) },
});

const STARTS = /** @type {Record<string, { closed: boolean, dots: number[][] }>} */ ({
  octopus: {
    closed: true,
    dots: [
      [500, 620], [630, 570], [695, 455], [665, 340], [790, 330], [905, 245], [870, 175], [735, 235], [760, 75], [640, 50],
      [575, 195], [500, 60], [425, 195], [360, 50], [240, 75], [265, 235], [130, 175], [95, 245], [210, 330], [335, 340], [305, 455], [370, 570],
    ],
  },
  wave: { closed: false, dots: [[80, 200], [220, 470], [330, 250], [480, 330], [560, 560], [700, 180], [930, 420]] },
  none: { closed: false, dots: [] },
});

/** @param {number} value */
function two(value) {
  return Number(value.toPrecision(2));
}

/** @param {string} id */
const find = (id) => /** @type {any} */ (document.getElementById(id));

export class Dots {
  /** @param {WebAssembly.Module} module */
  constructor(module) {
    this.module = module;
    /** @type {Dot[]} */
    this.dots = [];
    /** @type {Disc | null} */
    this.disc = null;
    this.chosen = -1;
    this.camera = { x: 0, y: 0, scale: 1 };
    this.addedAt = 0;
    /** @type {any[]} */
    this.cards = [];
  }

  /** Shows the room, with what the address says. */
  open() {
    if (this.cards.length === 0) this.build();
    const words = new URLSearchParams(location.hash.replace(/^#dots\??/, ''));
    if (words.has('p')) this.read(words);
    else if (this.dots.length === 0) this.start('octopus');
    for (const { view } of this.cards) view.resize();
    this.frame();
  }

  build() {
    for (const method of /** @type {Method[]} */ (Object.keys(METHODS))) this.cards.push(this.card(method));
    for (const [name, { value }] of Object.entries(KNOBS)) {
      find(name).value = value;
      find(name).addEventListener('input', () => this.changed());
    }
    for (const button of document.querySelectorAll('[data-start]')) {
      button.addEventListener('click', () => this.start(/** @type {any} */ (button).dataset.start));
    }
    find('closed').addEventListener('change', () => this.changed());
    for (const id of ['combs', 'comb-scale', 'tangents']) find(id).addEventListener('input', () => this.draw());
    find('tangents').addEventListener('change', () => {
      if (!find('tangents').checked) for (const dot of this.dots) dot.tangent = null;
      else if (this.chosen < 0) this.chosen = 0;
      this.changed();
    });
    find('obstacle').addEventListener('change', () => {
      this.disc = find('obstacle').checked ? this.discInTheWay() : null;
      this.changed();
    });
    find('link').addEventListener('click', async () => {
      this.write();
      await navigator.clipboard.writeText(location.href);
      find('link').textContent = 'Copied';
      setTimeout(() => (find('link').textContent = 'Copy a link to these dots'), 1200);
    });
    whenColoursChange(() => this.draw());
    this.show('fair');
  }

  /** A disc on the longest way from one dot to the next. @returns {Disc} */
  discInTheWay() {
    const spans = this.dots.slice(1).map((b, i) => ({ a: this.dots[i], b, length: Math.hypot(b.x - this.dots[i].x, b.y - this.dots[i].y) }));
    const [{ a, b, length } = { a: { x: 400, y: 330 }, b: { x: 600, y: 330 }, length: 200 }] = spans.sort((one, other) => other.length - one.length);
    return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, r: Math.max(4, Math.min(70, 0.25 * length)) };
  }

  /** Everything of one method. @param {Method} method */
  card(method) {
    const { title, short: word } = METHODS[method];
    const card = document.createElement('article');
    card.className = 'card';
    card.id = `card-${method}`;
    card.innerHTML = `<h2><i></i><span></span><small></small></h2><canvas tabindex="0" role="img"></canvas><p class="sentence" aria-live="polite"></p>`;
    const [canvas, numbers, sentence] = ['canvas', 'small', 'p'].map((tag) => /** @type {any} */ (card.querySelector(tag)));
    /** @type {any} */ (card.querySelector('h2 span')).textContent = title;
    canvas.setAttribute('aria-label', `${title} through the dots. N and P choose a dot, arrows move it, Delete removes it, Enter adds one.`);
    find('four').append(card);
    const tab = document.createElement('button');
    Object.assign(tab, { type: 'button', textContent: word, id: `tab-${method}` });
    tab.setAttribute('role', 'tab');
    tab.setAttribute('aria-controls', card.id);
    tab.addEventListener('click', () => this.show(method));
    find('four').querySelector('.tabs').append(tab);
    const made = { method, card, canvas, numbers, sentence, tab, result: /** @type {any} */ (null), view: /** @type {any} */ (null), latest: /** @type {any} */ (null) };
    made.view = new View(canvas, {
      camera: this.camera,
      paint: (context) => context && this.paint(context, made),
      moved: () => this.draw(),
      grab: (event) => this.grab(event, made),
    });
    made.latest = new Latest(this.module, (result, error) => this.take(made, result, error));
    canvas.addEventListener('click', (/** @type {MouseEvent} */ event) => this.click(event, made));
    canvas.addEventListener('dblclick', (/** @type {MouseEvent} */ event) => {
      const at = this.hit(event, made.view, false);
      if (at?.dot !== undefined && performance.now() - this.addedAt > 600) this.remove(at.dot);
    });
    card.addEventListener('keydown', (event) => this.key(event), { capture: true });
    return made;
  }

  /** Which method a narrow screen shows. @param {Method} method */
  show(method) {
    for (const { card, tab, method: own } of this.cards) {
      card.classList.toggle('shown', own === method);
      tab.setAttribute('aria-selected', String(own === method));
    }
    this.ask();
  }

  /** @param {string} name */
  start(name) {
    const { closed, dots } = STARTS[name];
    this.dots = dots.map(([x, y]) => ({ x, y, tangent: null }));
    this.chosen = -1;
    this.disc = null;
    find('closed').checked = closed;
    find('obstacle').checked = find('tangents').checked = false;
    this.changed();
    this.frame();
  }

  frame() {
    const [x0, y0, x1, y1] = SHEET;
    for (const { view } of this.cards) if (view.canvas.offsetParent) view.fit([x0, y0, x1, y1]);
  }

  /** @param {string} name */
  knob(name) {
    return KNOBS[name].meaning(Number(find(name).value));
  }

  /** Asks for new curves, and draws the dots where they are now. */
  changed() {
    this.ask();
    this.draw();
    clearTimeout(this.writing);
    this.writing = setTimeout(() => this.write(), 250);
  }

  ask() {
    const texts = { nu: `${this.knob('nu')}`, tension: `${this.knob('tension')}`, deviation: `${this.knob('deviation')}`, radius: `${this.knob('radius') ?? 'none'}` };
    for (const [name, text] of Object.entries(texts)) find(`${name}-value`).textContent = text;
    find('four').dataset.dots = this.dots.length;
    const lines = [];
    for (const card of this.cards) {
      if (this.dots.length < 2) {
        Object.assign(card, { result: null });
        [card.numbers.textContent, card.sentence.textContent] = ['', ''];
        continue;
      }
      const args = this.command(card.method);
      lines.push(quoted(['faircurve', ...args.filter((word) => word !== '--quiet')]));
      if (card.canvas.offsetParent) card.latest.ask({ task: 'dots', args, csv: this.table(card.method) });
    }
    find('lines').replaceChildren(...lines.map((line) => Object.assign(document.createElement('code'), { textContent: line })));
  }

  /** Samples of a span. */
  samples() {
    return Math.min(MOST, Math.max(FEWEST, Math.round(SAMPLES / this.dots.length)));
  }

  /** @param {Method} method */
  command(method) {
    const [nu, tension, radius] = [this.knob('nu'), this.knob('tension'), this.knob('radius')];
    const { disc } = this;
    const own = {
      natural: [],
      smoothing: ['--deviation', `${this.knob('deviation')}`],
      fair: [
        ...(nu === 2 ? [] : ['--exponent', `${nu}`, '--energy', 'bending=1,tautness=1']),
        ...(radius ? ['--min-radius', `${radius}`] : []),
        ...(disc ? ['--keep-out', [disc.x, disc.y, disc.r].map((value) => value.toFixed(1)).join(',')] : []),
      ],
      scf: ['--exponent', `${nu}`, ...(tension ? ['--tension', `${tension}`] : [])],
    };
    const closed = ['--closed', find('closed').checked ? 'yes' : 'no'];
    return ['fit', 'dots.csv', '-o', 'curve.npz', '--method', method, ...own[method], ...closed, '--samples', `${this.samples()}`, '--write', 'curvature,tangent', '--report', 'report.json', '--quiet'];
  }

  /** The dots as CSV, with the tangents that a method takes. @param {Method} method */
  table(method) {
    const { takes } = METHODS[method];
    const last = this.dots.length - 1;
    const taken = (/** @type {number} */ i) => takes === 'all' || (takes === 'ends' && !find('closed').checked && (i === 0 || i === last));
    const hasTangents = this.dots.some(({ tangent }, i) => tangent && taken(i));
    const rows = this.dots.map(({ x, y, tangent }, i) => {
      const own = tangent && taken(i) ? tangent.map((part) => part.toFixed(6)) : ['', ''];
      return [x.toFixed(1), y.toFixed(1), ...(hasTangents ? own : [])].join(',');
    });
    return `${hasTangents ? 'x,y,tx,ty' : 'x,y'}\n${rows.join('\n')}\n`;
  }

  /** Shows what the program answered. @param {any} card @param {any} result @param {Error | null} error */
  take(card, result, error) {
    card.result = result;
    card.card.dataset.results = Number(card.card.dataset.results ?? 0) + 1;
    const { status, message, length, max_curvature: curvature } = result?.curve ?? {};
    const isGood = status === 'converged' || status === 'not_unique';
    card.card.classList.toggle('failed', !isGood);
    card.card.dataset.milliseconds = result?.milliseconds ?? '';
    card.numbers.textContent = result ? `${status.replaceAll('_', ' ')} · length ${short(length)}${curvature ? ` · sharpest radius ${short(1 / curvature)}` : ''} · ${Math.max(1, Math.round(result.milliseconds))} ms` : 'refused';
    const sentence = error?.message ?? message ?? '';
    if (card.sentence.textContent !== sentence) card.sentence.textContent = sentence.replace(/^dots\.csv, line \d+, curve 0, point (\d+): /, (/** @type {string} */ _, /** @type {string} */ point) => `Dot ${Number(point) + 1}: `);
    card.view.request();
  }

  draw() {
    for (const { view } of this.cards) view.request();
  }

  /** Where the knob of a dot's tangent is, on the canvas. @param {number} i @param {View} view @returns {[number, number]} */
  handle(i, view) {
    const { x, y, tangent } = this.dots[i];
    const [sx, sy] = view.toScreen(x, y);
    const [dx, dy] = tangent ?? this.direction(i);
    return [sx + HANDLE * dx, sy - HANDLE * dy];
  }

  /** The direction in which the dots go on. @param {number} i @returns {[number, number]} */
  direction(i) {
    const { dots } = this;
    const isClosed = find('closed').checked;
    const before = dots[i - 1] ?? (isClosed ? dots[dots.length - 1] : dots[i]);
    const after = dots[i + 1] ?? (isClosed ? dots[0] : dots[i]);
    const length = Math.hypot(after.x - before.x, after.y - before.y) || 1;
    return [(after.x - before.x) / length, (after.y - before.y) / length];
  }

  /** What lies under a pointer. @param {MouseEvent} event @param {View} view @param {boolean} withDisc */
  hit(event, view, withDisc) {
    const [px, py] = view.at(event);
    const reach = /** @type {any} */ (event).pointerType === 'touch' ? NEAR_TOUCH : NEAR;
    const distance = (/** @type {[number, number]} */ [x, y]) => Math.hypot(px - x, py - y);
    if (find('tangents').checked) {
      const knobs = this.dots.flatMap((dot, i) => (dot.tangent || i === this.chosen ? [i] : []));
      const knob = knobs.find((i) => distance(this.handle(i, view)) < reach);
      if (knob !== undefined) return { knob };
    }
    const near = this.dots.map(({ x, y }, dot) => ({ dot, far: distance(view.toScreen(x, y)) })).sort((a, b) => a.far - b.far)[0];
    if (near && near.far < reach) return { dot: near.dot };
    if (withDisc && this.disc) {
      const far = distance(view.toScreen(this.disc.x, this.disc.y));
      const rim = this.disc.r * view.camera.scale;
      if (Math.abs(far - rim) < reach) return { rim: true };
      if (far < rim) return { disc: true };
    }
    return null;
  }

  /** @param {PointerEvent} event @param {any} card */
  grab(event, { view, method }) {
    const hit = this.hit(event, view, method === 'fair');
    this.press = { x: event.clientX, y: event.clientY, taken: !!hit };
    if (!hit) return null;
    const [wx, wy] = view.toWorld(...view.at(event));
    const { dots, disc } = this;
    if (hit.dot !== undefined) {
      this.chosen = hit.dot;
      const dot = dots[hit.dot];
      const [dx, dy] = [dot.x - wx, dot.y - wy];
      this.draw();
      return this.dragging((x, y) => Object.assign(dot, { x: x + dx, y: y + dy }), view);
    }
    if (hit.knob !== undefined) {
      const dot = dots[hit.knob];
      return this.dragging((x, y) => {
        const length = Math.hypot(x - dot.x, y - dot.y) || 1;
        dot.tangent = [(x - dot.x) / length, (y - dot.y) / length];
      }, view);
    }
    if (!disc) return null;
    const [dx, dy] = [disc.x - wx, disc.y - wy];
    if ('rim' in hit) return this.dragging((x, y) => (disc.r = Math.max(4, Math.hypot(x - disc.x, y - disc.y))), view);
    return this.dragging((x, y) => Object.assign(disc, { x: x + dx, y: y + dy }), view);
  }

  /** @param {(x: number, y: number) => void} act @param {View} view */
  dragging(act, view) {
    return (/** @type {PointerEvent} */ event, /** @type {boolean} */ ended) => {
      if (ended) return;
      const [x, y] = view.toWorld(...view.at(event));
      act(x, y);
      this.changed();
    };
  }

  /** A click beside everything adds a dot. @param {MouseEvent} event @param {any} card */
  click(event, card) {
    const { press } = this;
    if (!press || press.taken || Math.hypot(event.clientX - press.x, event.clientY - press.y) > 4) return;
    const [x, y] = card.view.toWorld(...card.view.at(event));
    this.add(x, y, this.spanAt(event, card));
  }

  /** @param {number} x @param {number} y @param {number} at */
  add(x, y, at) {
    this.dots.splice(at, 0, { x, y, tangent: null });
    this.chosen = at;
    this.addedAt = performance.now();
    this.changed();
  }

  /** Between which dots a click lies: on the curve, or else at its end. @param {MouseEvent} event @param {any} card */
  spanAt(event, { view, result }) {
    const end = this.dots.length;
    if (!result) return end;
    const [px, py] = view.at(event);
    const { coords } = result;
    for (let i = 0; i < coords.length / 2; i++) {
      const [x, y] = view.toScreen(coords[2 * i], coords[2 * i + 1]);
      if (Math.hypot(px - x, py - y) < NEAR) return Math.min(Math.floor(i / this.samples()) + 1, end);
    }
    return end;
  }

  /** @param {number} at */
  remove(at) {
    this.dots.splice(at, 1);
    this.chosen = Math.min(at, this.dots.length - 1);
    this.changed();
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const { dots, chosen } = this;
    const step = (event.shiftKey ? 1 : 8) / this.camera.scale;
    const go = (/** @type {number} */ by) => (this.chosen = dots.length ? (chosen + by + dots.length) % dots.length : -1);
    const by = (/** @type {number} */ dx, /** @type {number} */ dy) => {
      dots[chosen].x += dx * step;
      dots[chosen].y += dy * step;
    };
    const always = /** @type {Record<string, () => void>} */ ({
      n: () => go(1), p: () => go(chosen < 0 ? 0 : -1),
      Enter: () => this.add(this.camera.x, this.camera.y, chosen + 1 || dots.length),
    });
    const ofChosen = /** @type {Record<string, () => void>} */ ({
      Delete: () => this.remove(chosen), Backspace: () => this.remove(chosen), Escape: () => (this.chosen = -1),
      ArrowLeft: () => by(-1, 0), ArrowRight: () => by(1, 0), ArrowUp: () => by(0, 1), ArrowDown: () => by(0, -1),
    });
    const act = always[event.key] ?? (dots[chosen] && ofChosen[event.key]);
    if (!act) return;
    event.preventDefault();
    act();
    this.changed();
  }

  /** Puts everything into the address. */
  write() {
    if (find('dots-room').hidden) return;
    const p = this.dots.map(({ x, y, tangent }) => [x.toFixed(1), y.toFixed(1), ...(tangent ?? []).map((part) => part.toFixed(3))].join(',')).join(';');
    const words = { p, closed: Number(find('closed').checked), combs: Number(find('combs').checked) };
    for (const [name, { value }] of Object.entries(KNOBS)) if (Number(find(name).value) !== value) Object.assign(words, { [name]: find(name).value });
    if (this.disc) Object.assign(words, { o: [this.disc.x, this.disc.y, this.disc.r].map((value) => value.toFixed(1)).join(',') });
    const text = Object.entries(words).map(([name, value]) => `${name}=${value}`).join('&');
    history.replaceState(null, '', `#dots?${text}`);
  }

  /** @param {URLSearchParams} words */
  read(words) {
    const numbers = (/** @type {string} */ text) => text.split(',').map(Number).filter(Number.isFinite);
    const rows = (words.get('p') ?? '').split(';').map(numbers).filter((row) => row.length >= 2);
    this.dots = rows.map(([x, y, tx, ty]) => ({ x, y, tangent: ty === undefined ? null : [tx, ty] }));
    const [x, y, r] = numbers(words.get('o') ?? '');
    this.disc = r > 0 ? { x, y, r } : null;
    this.chosen = -1;
    find('closed').checked = words.get('closed') === '1';
    find('combs').checked = words.get('combs') !== '0';
    find('obstacle').checked = !!this.disc;
    find('tangents').checked = this.dots.some(({ tangent }) => tangent);
    for (const [name, { value }] of Object.entries(KNOBS)) find(name).value = words.get(name) ?? value;
    this.ask();
    this.draw();
  }

  /** @param {CanvasRenderingContext2D} context @param {{ method: Method, view: View, result: any }} card */
  paint(context, { method, view, result }) {
    const own = colour(method);
    if (method === 'fair' && this.disc) this.paintDisc(context, view, this.disc);
    if (result) {
      if (find('combs').checked) this.paintComb(context, view, result, own);
      const { coords, closed, curve } = result;
      context.beginPath();
      for (let i = 0; i < coords.length; i += 2) context.lineTo(...view.toScreen(coords[i], coords[i + 1]));
      if (closed) context.closePath();
      const isGood = ['converged', 'not_unique'].includes(curve.status);
      Object.assign(context, { strokeStyle: isGood ? own : colour('bad'), lineWidth: 2.6, lineJoin: 'round' });
      context.setLineDash(isGood ? [] : [6, 5]);
      context.stroke();
      context.setLineDash([]);
    }
    const showsTangents = find('tangents').checked;
    this.dots.forEach(({ x, y, tangent }, i) => {
      const [sx, sy] = view.toScreen(x, y);
      if (showsTangents && (tangent || i === this.chosen)) {
        const [hx, hy] = this.handle(i, view);
        Object.assign(context, { strokeStyle: colour(tangent ? 'fg' : 'muted'), fillStyle: colour('panel'), lineWidth: 1.4 });
        context.setLineDash(tangent ? [] : [3, 3]);
        context.beginPath();
        context.moveTo(sx, sy);
        context.lineTo(hx, hy);
        context.stroke();
        context.setLineDash([]);
        context.beginPath();
        context.arc(hx, hy, 5, 0, 7);
        context.fill();
        context.stroke();
      }
      context.beginPath();
      context.arc(sx, sy, i === this.chosen ? 6 : 4.2, 0, 7);
      context.fillStyle = i === this.chosen ? own : colour('fg');
      context.fill();
      Object.assign(context, { strokeStyle: colour('panel'), lineWidth: 1.5 });
      context.stroke();
    });
  }

  /** @param {CanvasRenderingContext2D} context @param {View} view @param {Disc} disc */
  paintDisc(context, view, { x, y, r }) {
    context.beginPath();
    context.arc(...view.toScreen(x, y), r * view.camera.scale, 0, 7);
    context.fillStyle = colour('obstacle');
    context.fill();
    Object.assign(context, { strokeStyle: colour('bad'), lineWidth: 1.5 });
    context.stroke();
  }

  /** Quills as long as the curve is curved. @param {CanvasRenderingContext2D} context @param {View} view @param {any} result @param {string} own */
  paintComb(context, view, { coords, curvature, tangents, closed }, own) {
    if (!curvature || !tangents[0]) return;
    const [x0, y0, x1, y1] = SHEET;
    const diagonal = Math.hypot(x1 - x0, y1 - y0);
    const scale = 0.0018 * diagonal ** 2 * 10 ** (find('comb-scale').value / 200);
    const most = 0.09 * diagonal;
    const tips = [];
    for (let i = 0; i < curvature.length; i++) {
      const quill = Math.max(-most, Math.min(most, scale * curvature[i])) || 0;
      tips.push(view.toScreen(coords[2 * i] + quill * tangents[1][i], coords[2 * i + 1] - quill * tangents[0][i]));
    }
    context.beginPath();
    tips.forEach(([x, y], i) => {
      context.moveTo(...view.toScreen(coords[2 * i], coords[2 * i + 1]));
      context.lineTo(x, y);
    });
    Object.assign(context, { strokeStyle: own, lineWidth: 0.8, globalAlpha: 0.45 });
    context.stroke();
    context.beginPath();
    for (const [x, y] of tips) context.lineTo(x, y);
    if (closed) context.closePath();
    context.globalAlpha = 0.8;
    context.stroke();
    context.globalAlpha = 1;
  }
}
