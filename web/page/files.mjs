// @ts-check
// The room of files: a file in, curves before and after, a file out.

import { colour, whenColoursChange } from './colours.mjs';
import { guess, JOBS, OF_SPACE, partsOf, quoted, round, short, split, WRITTEN } from './jobs.mjs';
import { latitudeOf } from './layers.mjs';
import { Cancelled, Runner } from './runner.mjs';
import { View } from './view.mjs';

/** Kilometres of a degree of the equator. */
const DEGREE = 111.195;
/** Steps of the slider, and factors of its middle value at both of its ends. */
const [STEPS, REACH] = [1000, 100];
/** Names of colours that the painter needs. */
const COLOURS = ['before', 'before-fill', 'after', 'after-fill', 'bad', 'cross'];
/** A slider that moves starts a run this much later, in milliseconds. */
const DELAY = 80;

/** @param {string} id */
const find = (id) => /** @type {any} */ (document.getElementById(id));

export class Files {
  /** @param {WebAssembly.Module} module */
  constructor(module) {
    this.runner = new Runner(module);
    this.painter = new Worker(new URL('./painter.mjs', import.meta.url), { type: 'module' });
    const canvas = find('canvas').transferControlToOffscreen();
    this.painter.postMessage({ canvas }, [canvas]);
    this.painter.onmessage = ({ data }) => !data.draft && Object.assign(find('canvas').dataset, { painted: data.asked, milliseconds: data.milliseconds });
    this.view = new View(find('canvas'), { paint: () => this.paint(), isElsewhere: true, moved: () => this.paintSoon(true) });
    /** @type {any} the file, and how it is read */
    this.file = null;
    /** @type {any} what came of it */
    this.result = null;
    /** @type {import('./layers.mjs').Summary | null} */
    this.before = null;
    this.middle = 1;
    this.timer = 0;
    this.listen();
    whenColoursChange(() => this.paintSoon());
  }

  open() {
    this.view.resize();
  }

  listen() {
    const [file, drop] = [find('file'), find('drop')];
    file.addEventListener('change', () => file.files[0] && this.choose(file.files[0]));
    for (const name of ['dragover', 'dragleave', 'drop']) {
      addEventListener(name, (/** @type {any} */ event) => {
        event.preventDefault();
        drop.classList.toggle('over', name === 'dragover');
        if (name === 'drop' && event.dataTransfer?.files[0]) {
          location.hash = '#files';
          this.choose(event.dataTransfer.files[0]);
        }
      });
    }
    for (const button of document.querySelectorAll('[data-sample]')) {
      button.addEventListener('click', async () => {
        const { sample } = /** @type {HTMLElement} */ (button).dataset;
        const response = await fetch(`samples/${sample}`);
        if (!response.ok) return this.fail(new Error(`cannot read the sample ${sample}: ${response.status} ${response.statusText}`));
        this.choose(new File([await response.arrayBuffer()], sample ?? ''));
      });
    }
    find('job').replaceChildren(...Object.entries(JOBS).map(([value, { title }]) => new Option(title, value)));
    find('job').addEventListener('change', () => this.setJob(find('job').value));
    find('slider').addEventListener('input', () => {
      find('amount').value = short(this.middle * REACH ** (2 * find('slider').value / STEPS - 1));
      this.soon();
    });
    find('amount').addEventListener('input', () => {
      this.setSlider();
      this.soon();
    });
    find('auto').addEventListener('change', () => this.setAuto());
    find('format').addEventListener('change', () => this.soon());
    find('more').addEventListener('change', () => this.soon());
    for (const id of ['columns', 'plane']) find(id).addEventListener('change', () => this.read());
    for (const id of ['show-before', 'show-after']) find(id).addEventListener('change', () => this.paintSoon());
    for (const button of document.querySelectorAll('[data-zoom]')) {
      button.addEventListener('click', () => this.view.key(new KeyboardEvent('keydown', { key: /** @type {any} */ (button).dataset.zoom })));
    }
    find('copy').addEventListener('click', async () => {
      await navigator.clipboard.writeText(find('command').textContent);
      find('copy').textContent = 'Copied';
      setTimeout(() => (find('copy').textContent = 'Copy'), 1200);
    });
    for (const form of document.querySelectorAll('form')) form.addEventListener('submit', (event) => event.preventDefault());
  }

  /** @param {File} file */
  async choose(file) {
    this.runner.cancel();
    clearTimeout(this.timer);
    try {
      const bytes = new Uint8Array(await file.arrayBuffer());
      const guessed = guess(file.name, await headOf(file));
      this.file = { name: file.name, bytes, ...guessed, cubic: partsOf(file.name).format === 'svg' };
      const isSlices = ['trk', 'tck'].includes(partsOf(file.name).format);
      find('columns').value = guessed.columns;
      find('columns-row').hidden = !/\.[ct]sv(\.gz)?$/i.test(file.name);
      find('plane-row').hidden = !isSlices;
      find('plane').value = isSlices ? 'xz' : 'xy';
      await this.read(guessed.job);
    } catch (error) {
      this.fail(/** @type {Error} */ (error));
    }
  }

  look(cubic = this.file.cubic, columns = find('columns').value) {
    return { geographic: this.file.geographic, cubic, columns: this.isTable(this.file.name) ? columns : '', plane: find('plane').value };
  }

  /** @param {string} name */
  isTable(name) {
    return /\.[ct]sv(\.gz)?$/i.test(name);
  }

  /** Reads the file for the drawing. @param {string} [job] */
  async read(job) {
    if (!this.file) return;
    const { name, bytes } = this.file;
    Object.assign(this, { before: null, result: null });
    this.busy('Reading');
    try {
      const { layer, summary } = await this.runner.run({ task: 'read', name, bytes, look: this.look() });
      this.before = summary;
      this.file.geographic = summary.geographic;
      if (job) this.offer(summary.dimension);
      this.hand({ before: layer, after: null, unusable: [], marks: [] });
      find('file-name').textContent = name;
      find('file-says').textContent = `${summary.curves.toLocaleString('en')} curves, ${summary.points.toLocaleString('en')} ${this.file.cubic ? 'control points' : 'points'}, ${bytesOf(bytes.length)}`;
      find('files-room').dataset.has = 'file';
      find('work').hidden = false;
      this.view.fit(summary.box);
      if (job) this.setJob(job);
      else this.run();
    } catch (error) {
      this.fail(/** @type {Error} */ (error));
    }
  }

  /** Offers the formats that hold points of this dimension. @param {number} dimension */
  offer(dimension) {
    const formats = WRITTEN.filter((format) => dimension === 3 || !OF_SPACE.includes(format));
    find('format').replaceChildren(...formats.map((format) => new Option(format)));
    find('format').value = formats.includes(this.file.out) ? this.file.out : 'csv';
  }

  /** @param {string} job */
  setJob(job) {
    const { says, knob } = JOBS[job];
    find('job').value = job;
    find('job-says').textContent = says;
    find('knob').hidden = !knob;
    find('auto-row').hidden = !knob?.optional;
    find('auto-label').textContent = job === 'track' ? 'As much as the noise asks' : 'Through every point';
    find('auto').checked = !!knob?.optional && job !== 'track';
    if (knob && this.before) {
      const isGround = this.file.geographic && knob.unit === 'ground';
      find('knob-label').textContent = knob.label;
      find('unit').textContent = isGround ? 'km' : this.unit();
      const edge = this.before.edge * (isGround ? DEGREE : 1);
      this.middle = round(this.file.cubic ? this.drawingSize() / 300 : edge / 2);
      find('amount').value = short(this.middle);
      this.setSlider();
    }
    this.setAuto();
  }

  /** The width or height of a drawing, whichever is more. */
  drawingSize() {
    const [x0, y0, x1, y1] = /** @type {any} */ (this.before).box;
    return Math.max(x1 - x0, y1 - y0);
  }

  /** The unit of the numbers in the file. */
  unit() {
    const { format } = partsOf(this.file.name);
    if (this.file.geographic) return '°';
    return format === 'svg' ? 'px' : format === 'trk' || format === 'tck' ? 'mm' : 'units';
  }

  setAuto() {
    const isOff = find('auto').checked && !find('auto-row').hidden;
    find('slider').disabled = find('amount').disabled = isOff;
    this.run();
  }

  setSlider() {
    const factor = Number(find('amount').value) / this.middle;
    if (factor > 0) find('slider').value = Math.round(STEPS / 2 * (1 + Math.log(factor) / Math.log(REACH)));
  }

  /** Runs once the slider rests for a moment. */
  soon() {
    clearTimeout(this.timer);
    this.timer = window.setTimeout(() => this.run(), DELAY);
  }

  /** The command line for what is chosen. */
  command() {
    const { name } = this.file;
    const { base } = partsOf(name);
    const { words, points = words, knob } = JOBS[find('job').value];
    const [output, report] = [`${base}-smooth.${find('format').value}`, `${base}-report.json`];
    const args = [...(output.endsWith('.svg') ? words : points), name, '-o', output];
    if (this.isTable(name) && find('columns').value) args.push('--columns', find('columns').value);
    if (knob && !find('amount').disabled) {
      args.push(knob.option, `${find('amount').value}${this.file.geographic && knob.unit === 'ground' ? 'km' : ''}`);
    }
    args.push('--report', report, ...split(find('more').value));
    return { args, output, report };
  }

  async run() {
    clearTimeout(this.timer);
    if (!this.before) return;
    const { args, output, report } = this.command();
    const columns = 'curve=curve,x=x,y=y' + (this.before.dimension === 3 ? ',z=z' : '');
    this.busy('Working');
    try {
      const ask = { task: 'job', args, output, report, files: { [this.file.name]: this.file.bytes }, before: this.before };
      const look = { ...this.look(output.endsWith('.svg')), columns: this.isTable(output) ? columns : '' };
      this.result = await this.runner.run({ ...ask, look });
      this.show(args, output);
    } catch (error) {
      this.fail(/** @type {Error} */ (error));
    }
  }

  /** @param {string[]} args @param {string} output */
  show(args, output) {
    const { layer, statistics: numbers, unusable, marks, milliseconds, stderr, written, memoryBytes } = this.result;
    const places = unusable.map((/** @type {any} */ { i }) => i).filter((/** @type {number} */ i) => i < (this.before?.curves ?? 0));
    this.hand({ after: layer, unusable: places, marks });
    this.busy(null);
    find('sentence').hidden = true;
    find('outcome').hidden = false;
    find('outcome').classList.remove('failed');
    const count = (/** @type {number} */ n) => n.toLocaleString('en');
    const rows = [
      ['Curves', count(numbers.curves) + (unusable.length ? `, ${count(unusable.length)} not usable` : '')],
      ['Points', `${count(numbers.pointsBefore)} → ${count(numbers.pointsAfter)}`],
      ['Largest deviation', this.lengthText(numbers.deviation)],
      ...(numbers.areaChange === null ? [] : [['Area', percent(numbers.areaChange)]]),
      ['Size', `${bytesOf(this.file.bytes.length)} → ${bytesOf(written.size)}`],
      ['Time', milliseconds < 995 ? `${Math.round(milliseconds)} ms` : `${(milliseconds / 1000).toFixed(1)} s`],
    ];
    find('numbers').replaceChildren(...rows.map(([name, value]) => pair(name, value)));
    Object.assign(find('numbers').dataset, { milliseconds, memory: memoryBytes, points: numbers.pointsBefore });
    const lines = stderr.trim().split('\n').filter(Boolean).map((/** @type {string} */ line) => line.replace(/^faircurve: /, ''));
    find('said-row').hidden = lines.length === 0;
    find('said-row').open = unusable.length > 0;
    find('said').replaceChildren(...lines.map((/** @type {string} */ line) => paragraph(line, unusable)));
    find('bad-legend').hidden = unusable.length === 0;
    find('cross-legend').hidden = marks.length === 0;
    URL.revokeObjectURL(find('download').href);
    Object.assign(find('download'), { href: URL.createObjectURL(written), download: output, title: output, ariaLabel: `Download ${output}` });
    find('command').textContent = quoted(['faircurve', ...args]);
    find('status').textContent = `Done: ${rows.map((row) => row.join(' ')).join(', ')}`;
    find('files-room').dataset.runs = Number(find('files-room').dataset.runs ?? 0) + 1;
  }

  /** A deviation in the unit of the report: metres on the ground. @param {number} value */
  lengthText(value) {
    if (!value) return '0';
    const { knob } = JOBS[find('job').value];
    if (!this.file.geographic) return `${short(value)} ${this.unit()}`;
    if (knob?.unit !== 'ground') return `${short(value)}°`;
    return value < 1000 ? `${short(value)} m` : `${short(value / 1000)} km`;
  }

  /** Shows that work is under way; null: that it ended. @param {string | null} what */
  busy(what) {
    clearInterval(this.clock);
    find('busy').hidden = what === null;
    if (what === null) return;
    const started = performance.now();
    const tell = () => {
      const seconds = (performance.now() - started) / 1000;
      find('busy').querySelector('span').textContent = seconds < 1 ? `${what} …` : `${what} for ${seconds.toFixed(0)} s …`;
    };
    tell();
    this.clock = setInterval(tell, 250);
  }

  /** @param {Error} error */
  fail(error) {
    if (error instanceof Cancelled) return;
    this.busy(null);
    this.result = null;
    // Another format may do.
    find('outcome').hidden = !this.before;
    find('outcome').classList.add('failed');
    Object.assign(find('sentence'), { hidden: false, textContent: error.message });
    find('files-room').dataset.runs = Number(find('files-room').dataset.runs ?? 0) + 1;
    this.hand({ after: null, unusable: [], marks: [] });
  }

  /** Hands curves to the painter. @param {Record<string, any>} what */
  hand(what) {
    const buffers = [what.before, what.after].filter(Boolean).flatMap(({ coords, offsets, closed, bounds }) => [coords.buffer, offsets.buffer, closed.buffer, bounds.buffer]);
    this.painter.postMessage(what, [...new Set(buffers)]);
    this.paintSoon();
  }

  /** @param {boolean} [moves] whether the picture is on the move */
  paintSoon(moves = false) {
    this.moves = moves;
    this.asked = (this.asked ?? 0) + 1;
    find('canvas').dataset.asked = this.asked;
    this.view.request();
  }

  /** Tells the painter what is to be seen. */
  paint() {
    const { size, ratio, camera } = this.view;
    const [x0, , x1] = this.before?.box ?? [0, 0, 0];
    this.painter.postMessage({
      asked: this.asked, size, ratio, camera, moves: this.moves,
      colours: Object.fromEntries(COLOURS.map((name) => [name, colour(name)])),
      show: { before: find('show-before').checked, after: find('show-after').checked },
      isWorld: !!this.file?.geographic && x1 - x0 > 300,
    });
    if (this.before) this.paintScale();
  }

  paintScale() {
    const { camera } = this.view;
    const isGround = this.file.geographic;
    // Of Miller's map the scale is that along the parallel in the middle.
    const unit = isGround ? DEGREE * Math.cos(latitudeOf(camera.y) * Math.PI / 180) : 1;
    const length = round(90 / camera.scale * unit);
    find('scale').hidden = !Number.isFinite(length) || length <= 0 || unit < 5 && isGround;
    find('scale').style.width = `${length / unit * camera.scale}px`;
    find('scale').firstElementChild.textContent = isGround && length < 1 ? `${short(1000 * length)} m` : `${short(length)} ${isGround ? 'km' : this.unit()}`;
  }
}

/** The first lines of a file, unpacked. @param {File} file */
async function headOf(file) {
  const head = file.slice(0, 1 << 16);
  if (!file.name.endsWith('.gz')) return head.text();
  const reader = file.stream().pipeThrough(new DecompressionStream('gzip')).getReader();
  const { value } = await reader.read().catch(() => ({ value: new Uint8Array() }));
  reader.cancel().catch(() => {});
  return new TextDecoder().decode(value);
}

/** @param {number} bytes */
function bytesOf(bytes) {
  return bytes < 1000 ? `${bytes} B` : bytes < 1e6 ? `${short(bytes / 1000)} kB` : `${short(bytes / 1e6)} MB`;
}

/** @param {number} part */
function percent(part) {
  const text = Math.abs(part) < 5e-6 ? '0' : short(100 * Math.abs(part));
  return `${text === '0' ? '±' : part > 0 ? '+' : '−'}${text} %`;
}

/** @param {string} name @param {string} value */
function pair(name, value) {
  const row = document.createElement('div');
  const [term, description] = [document.createElement('dt'), document.createElement('dd')];
  [term.textContent, description.textContent] = [name, value];
  row.append(term, description);
  return row;
}

/** @param {string} line @param {any[]} unusable */
function paragraph(line, unusable) {
  const made = document.createElement('p');
  made.textContent = line.trim();
  made.classList.toggle('bad', unusable.length > 0 && /^\s+\w+: |not usable/.test(line));
  return made;
}
