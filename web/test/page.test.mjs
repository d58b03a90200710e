// The page in Chromium, compared with the native program that FAIRCURVE names.
//
// Environment: CHROMIUM names the browser's executable, FOLDER what is served in place of this folder,
// SCREENSHOTS a folder for pictures of the page.
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { existsSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { basename, join } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { split } from '../page/jobs.mjs';
import { serve } from '../serve.mjs';
import { difference } from './compare.mjs';

const DATA = fileURLToPath(new URL('../../examples/data/', import.meta.url));
const EXCERPT = fileURLToPath(new URL('../../tests/data/storms_excerpt.csv', import.meta.url));
const PROGRAM = process.env.FAIRCURVE;
const CHROMIUM = process.env.CHROMIUM ?? '/usr/bin/chromium';
const FLAGS = [
  '--no-sandbox', '--no-first-run', '--disable-background-networking', '--disable-component-update', '--disable-sync',
  '--disable-default-apps', '--disable-extensions', '--metrics-recording-only',
];
const WAIT = 240_000;
/** Frames that the page draws at least while the program works for seconds. */
const FRAMES = 5;

const playwright = await import('../../tests/browser/node_modules/playwright-core/index.mjs').catch(() => null);
const missing = !playwright ? 'no playwright-core (npm ci --prefix tests/browser)' : !existsSync(CHROMIUM) ? `no Chromium at ${CHROMIUM}` : false;
const folder = mkdtempSync(join(tmpdir(), 'faircurve-page-'));
/** @type {any} */
let [server, browser, address] = [];

before(async () => {
  if (missing) return;
  server = await serve(process.env.FOLDER);
  address = `http://localhost:${server.address().port}/`;
  browser = await playwright.chromium.launch({ executablePath: CHROMIUM, headless: true, args: FLAGS });
});
after(async () => {
  await browser?.close();
  server?.close();
  rmSync(folder, { recursive: true });
});

/** Opens the page; the test fails on an error of its scripts. */
async function open(t, hash = '#files', options = {}) {
  const context = await browser.newContext({ viewport: { width: 1400, height: 900 }, acceptDownloads: true, permissions: ['clipboard-read', 'clipboard-write'], ...options });
  const page = await context.newPage();
  const errors = [];
  page.on('pageerror', (error) => errors.push(error.message));
  page.on('request', (request) => request.url().startsWith(address) || request.url().startsWith('blob:') || errors.push(`asked for ${request.url()}`));
  t.after(async () => {
    await context.close();
    assert.deepEqual(errors, []);
  });
  await page.goto(address + hash);
  await page.waitForSelector('html[data-ready]', { timeout: WAIT });
  return page;
}

const runsOf = (page) => page.evaluate(() => Number(document.getElementById('files-room').dataset.runs ?? 0));

/** Does something, and waits until the page has run the program for it. */
async function run(page, act) {
  const runs = await runsOf(page);
  await act();
  await page.waitForFunction((runs) => Number(document.getElementById('files-room').dataset.runs ?? 0) > runs, runs, { timeout: WAIT });
}

async function downloaded(page) {
  const [download] = await Promise.all([page.waitForEvent('download'), page.click('#download')]);
  return { name: download.suggestedFilename(), bytes: readFileSync(await download.path()) };
}

/** What the native program writes for the page's command line. */
async function native(page, name, bytes) {
  const [program, ...args] = split(await page.textContent('#command'));
  assert.equal(program, 'faircurve');
  writeFileSync(join(folder, basename(name)), bytes);
  const { status } = spawnSync(PROGRAM, [...args, '--force'], { cwd: folder });
  assert.ok(status < 2, args.join(' '));
  return readFileSync(join(folder, args[args.indexOf('-o') + 1]));
}

/** Tracks of a table of id, hours, longitude and latitude, from the start of a year on. */
function gpxOf(table) {
  const tracks = new Map();
  for (const row of table.trim().split('\n').slice(1)) {
    const [id, hours, longitude, latitude] = row.split(',');
    const time = new Date(Date.UTC(2024) + 3.6e6 * hours).toISOString();
    const point = `<trkpt lat="${latitude}" lon="${longitude}"><time>${time}</time></trkpt>`;
    tracks.set(id, [...(tracks.get(id) ?? []), point]);
  }
  const made = [...tracks].map(([id, points]) => `<trk><name>${id}</name><trkseg>${points.join('')}</trkseg></trk>`);
  return `<?xml version="1.0"?><gpx version="1.1" xmlns="http://www.topografix.com/GPX/1/1">${made.join('')}</gpx>`;
}

/** Gaps between frames while something happens. */
async function watchFrames(page) {
  await page.evaluate(() => {
    const gaps = (window.gaps = []);
    let last = performance.now();
    const step = (now) => {
      gaps.push(performance.now() - last);
      last = performance.now();
      window.watch = requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  });
  return () => page.evaluate(() => {
    cancelAnimationFrame(window.watch);
    const sorted = window.gaps.slice(1).sort((a, b) => b - a);
    return { most: sorted[0], second: sorted[1], count: sorted.length };
  });
}

/** Waits until the picture is what was asked for last. */
async function painted(page) {
  await page.waitForFunction(() => {
    const { asked, painted } = document.getElementById('canvas').dataset;
    return asked === painted;
  }, null, { timeout: WAIT });
}

async function shoot(page, name) {
  if (!name.startsWith('dots')) await painted(page);
  // A picture that was painted is shown with the next frames.
  await page.waitForTimeout(300);
  if (process.env.SCREENSHOTS) await page.screenshot({ path: join(process.env.SCREENSHOTS, `${name}.png`) });
}

test('every format: the download is what the native program writes', { skip: missing || (!PROGRAM && 'FAIRCURVE names no native program') }, async (t) => {
  const page = await open(t);
  writeFileSync(join(folder, 'excerpt.gpx'), gpxOf(readFileSync(EXCERPT, 'utf8')));
  const inputs = ['world-110m.topojson', 'countries-110m.geojson', 'traced.svg', 'storms.csv.gz', 'tracts.trk'].map((name) => join(DATA, name));
  for (const input of [...inputs, join(folder, 'excerpt.gpx')]) {
    await run(page, () => page.setInputFiles('#file', input));
    assert.equal(await page.isVisible('#sentence'), false, await page.textContent('#sentence'));
    const { name, bytes } = await downloaded(page);
    const off = difference(name, bytes, await native(page, input, readFileSync(input)));
    const milliseconds = await page.getAttribute('#numbers', 'data-milliseconds');
    console.log(`${basename(input)}: ${Math.round(milliseconds)} ms, largest difference ${off.toExponential(1)}; ${await page.textContent('#command')}`);
    assert.ok(off < 1e-9, input);
  }
});

test('samples, the slider, other formats and jobs', { skip: missing }, async (t) => {
  const page = await open(t);
  await run(page, () => page.click('[data-sample="traced.svg"]'));
  const points = async () => (await page.textContent('#numbers')).match(/→ ([\d,]+)/)[1];
  const [amount, few] = [await page.inputValue('#amount'), await points()];
  const slide = (value) => page.$eval('#slider', (slider, value) => {
    slider.value = value;
    slider.dispatchEvent(new Event('input', { bubbles: true }));
  }, value);
  await run(page, () => slide(250));
  assert.equal(Number(await page.inputValue('#amount')), Number((amount / 10).toPrecision(3)));
  assert.ok(Number((await points()).replace(',', '')) > Number(few.replace(',', '')));
  // Of values that follow each other the last is run; the others are ended.
  const runs = await runsOf(page);
  for (const value of [300, 400, 500, 600, 700]) {
    await slide(value);
    await page.waitForTimeout(100);
  }
  await page.waitForFunction(() => document.getElementById('busy').hidden, null, { timeout: WAIT });
  const last = await page.inputValue('#amount');
  assert.match(await page.textContent('#command'), new RegExp(`--within ${last} `));
  console.log(`of 5 values ${(await runsOf(page)) - runs} were run to their end`);
  await run(page, () => page.selectOption('#format', 'geojson'));
  assert.equal(JSON.parse((await downloaded(page)).bytes).type, 'FeatureCollection');
  await run(page, () => page.selectOption('#job', 'natural'));
  assert.match(await page.textContent('#command'), /^faircurve fit --method natural traced\.svg/);
  await page.click('#copy');
  assert.equal(await page.evaluate(() => navigator.clipboard.readText()), await page.textContent('#command'));
});

test('a bad file gives the sentence of the program', { skip: missing }, async (t) => {
  const page = await open(t);
  const bad = '{"type":"FeatureCollection","features":[{"type":"Feature","geometry":{"type":"LineString","coordinates":[[1,"a"]]}}]}';
  writeFileSync(join(folder, 'bad.geojson'), bad);
  await run(page, () => page.setInputFiles('#file', join(folder, 'bad.geojson')));
  const sentence = await page.textContent('#sentence');
  console.log(sentence);
  if (PROGRAM) {
    const { stderr } = spawnSync(PROGRAM, ['fit', 'bad.geojson', '-o', 'out.npz', '--force'], { cwd: folder });
    assert.equal(`faircurve: ${sentence}`, String(stderr).trim().split('\n').at(-1));
  }
  await run(page, () => page.setInputFiles('#file', { name: 'notes.txt', mimeType: 'text/plain', buffer: Buffer.from('a') }));
  assert.match(await page.textContent('#sentence'), /notes\.txt: \.txt is no format/);
  await run(page, () => page.click('[data-sample="tracts.trk"]'));
  assert.equal(await page.isVisible('#sentence'), false);
  await page.click('text=More options');
  await run(page, async () => {
    await page.fill('#more', '--max-climb 2');
    await page.press('#more', 'Tab');
  });
  assert.match(await page.textContent('#sentence'), /--max-climb/);
});

test('a file is dropped, and unusable curves are listed', { skip: missing }, async (t) => {
  const page = await open(t);
  await run(page, () => page.evaluate(() => {
    const transfer = new DataTransfer();
    transfer.items.add(new File(['curve,x,y,t\na,0,0,0\na,1,1,1\na,2,0,1\nb,0,2,0\nb,1,3,1\nb,2,2,2\n'], 'two.csv'));
    document.getElementById('drop').dispatchEvent(new DragEvent('drop', { dataTransfer: transfer, bubbles: true, cancelable: true }));
  }));
  await run(page, () => page.selectOption('#job', 'natural'));
  assert.match(await page.textContent('#numbers'), /1 not usable/);
  assert.match(await page.textContent('#said'), /degenerate: two\.csv, line 4, curve a/);
  assert.equal(await page.isVisible('#bad-legend'), true);
});

test('keys zoom and move the drawing', { skip: missing }, async (t) => {
  const page = await open(t);
  await run(page, () => page.click('[data-sample="traced.svg"]'));
  const scale = () => page.$eval('#scale', (bar) => [bar.textContent, bar.style.width].join());
  const first = await scale();
  await page.focus('#canvas');
  const picture = async () => {
    await painted(page);
    return (await page.locator('#canvas').screenshot()).toString('base64');
  };
  for (const key of ['+', 'ArrowLeft', '-', '-']) {
    const [old, pixels] = [await scale(), await picture()];
    await page.keyboard.press(key);
    await page.waitForTimeout(60);
    assert.notEqual(await picture(), pixels, key);
    if (key !== 'ArrowLeft') assert.notEqual(await scale(), old, key);
  }
  await page.keyboard.press('0');
  await page.waitForTimeout(60);
  assert.equal(await scale(), first);
  const labelled = await page.$$eval('button, input, select, canvas, a', (all) => all.filter((element) => {
    const name = element.getAttribute('aria-label') ?? element.textContent.trim() ?? '';
    return name === '' && (element.labels?.length ?? 0) === 0;
  }).map((element) => element.outerHTML));
  assert.deepEqual(labelled, []);
});

test('100,000 points never freeze the page', { skip: missing }, async (t) => {
  const page = await open(t);
  const rows = ['curve,x,y'];
  for (let curve = 0; curve < 200; curve++) {
    for (let i = 0; i < 500; i++) rows.push(`${curve},${i / 10},${(curve + Math.sin(i / 20) + 0.3 * Math.sin(i * i)).toFixed(4)}`);
  }
  writeFileSync(join(folder, 'many.csv'), rows.join('\n'));
  await run(page, () => page.setInputFiles('#file', join(folder, 'many.csv')));
  const stop = await watchFrames(page);
  await run(page, () => page.selectOption('#job', 'smoothing'));
  const working = await stop();
  const milliseconds = await page.getAttribute('#numbers', 'data-milliseconds');
  const box = await page.locator('#canvas').boundingBox();
  const again = await watchFrames(page);
  await page.mouse.move(box.x + 500, box.y + 400);
  await page.mouse.down();
  for (let i = 0; i < 40; i++) await page.mouse.move(box.x + 500 + 5 * i, box.y + 400);
  await page.mouse.up();
  for (let i = 0; i < 20; i++) await page.mouse.wheel(0, -60);
  const moving = await again();
  console.log(`100,000 points: run in ${Math.round(milliseconds)} ms; longest gap between frames ${Math.round(working.most)} ms at work, ${Math.round(moving.most)} ms while moved`);
  // A page that freezes draws no frame before the run is over. How long a frame takes is the machine's.
  assert.ok(working.count >= FRAMES && working.most < milliseconds / 2, `${working.count} frames, ${working.most} ms of ${milliseconds}`);
});

test('500,000 points', { skip: missing || (process.env.QUICK && 'QUICK') }, async (t) => {
  const page = await open(t);
  const coords = [];
  for (let i = 0; i < 500_000; i++) coords.push(`${(i / 500) | 0},${i % 500},${(50 * Math.sin(i / 30)).toFixed(3)}`);
  writeFileSync(join(folder, 'half.csv'), `curve,x,y\n${coords.join('\n')}\n`);
  await run(page, () => page.setInputFiles('#file', join(folder, 'half.csv')));
  await run(page, async () => {
    await page.click('text=More options');
    await page.fill('#more', '--samples 2');
    await page.press('#more', 'Tab');
  });
  assert.equal(await page.isVisible('#sentence'), false, await page.textContent('#sentence'));
  const { memory, milliseconds, points } = await page.$eval('#numbers', (list) => ({ ...list.dataset }));
  console.log(`${points} points: ${(memory / 2 ** 20).toFixed(0)} MiB of the program's memory, ${(milliseconds / 1000).toFixed(1)} s`);
  assert.equal(Number(points), 500_000);
});

/** Where a dot of the sheet is on a card's canvas. */
async function placeOf(page, method = 'fair') {
  const box = await page.locator(`#card-${method} canvas`).boundingBox();
  const scale = 0.92 * Math.min(box.width / 1000, box.height / 740);
  return (x, y) => [box.x + box.width / 2 + (x - 500) * scale, box.y + box.height / 2 - (y - 320) * scale];
}

const answered = (page, dots) => page.waitForFunction((dots) => {
  const isRight = Number(document.getElementById('four').dataset.dots) === dots;
  return isRight && [...document.querySelectorAll('.card')].every((card) => card.offsetParent === null || card.dataset.milliseconds);
}, dots, { timeout: WAIT });

test('dots are clicked, dragged, deleted and linked', { skip: missing }, async (t) => {
  const page = await open(t, '#dots');
  await page.click('[data-start="none"]');
  const octopus = [
    [500, 610], [625, 565], [690, 455], [660, 340], [790, 320], [890, 240], [735, 225], [770, 80], [640, 60], [570, 200],
    [500, 70], [430, 200], [360, 60], [230, 80], [265, 225], [110, 240], [210, 320], [340, 340], [310, 455], [375, 565],
  ];
  const at = await placeOf(page);
  for (const [x, y] of octopus) await page.mouse.click(...at(x, y));
  await answered(page, 20);
  await page.check('#closed');
  await page.waitForTimeout(1500);
  for (const method of ['natural', 'smoothing', 'fair', 'scf']) {
    assert.match(await page.textContent(`#card-${method} h2`), /converged/, method);
  }
  await shoot(page, 'dots-octopus');
  const hash = () => page.evaluate(() => location.hash);
  await page.mouse.move(...at(500, 610));
  await page.mouse.down();
  await page.mouse.move(...at(520, 640), { steps: 5 });
  await page.mouse.up();
  await page.waitForTimeout(500);
  const [, x, y] = (await hash()).match(/p=([\d.]+),([\d.]+);/).map(Number);
  assert.ok(Math.abs(x - 520) < 3 && Math.abs(y - 640) < 3, `${x}, ${y}`);
  await page.keyboard.press('Delete');
  await answered(page, 19);
  await page.mouse.dblclick(...at(640, 60));
  await answered(page, 18);
  await page.keyboard.press('n');
  await page.keyboard.press('ArrowUp');
  await page.keyboard.press('Enter');
  await answered(page, 19);
  await page.check('#obstacle');
  await page.check('#tangents');
  await page.waitForTimeout(1200);
  const [link, status] = [await hash(), await page.textContent('#card-scf h2')];
  const other = await open(t, link);
  await answered(other, 19);
  await other.waitForTimeout(1500);
  assert.equal(await other.evaluate(() => location.hash), link);
  const strip = (text) => text.replace(/· \d+ ms/, '');
  assert.equal(strip(await other.textContent('#card-scf h2')), strip(status));
});

test('limits and tangents reach the fair curve, and refusals say why', { skip: missing }, async (t) => {
  const page = await open(t, '#dots?p=100,300;500,300;900,300&closed=0&o=300,300,80.0');
  await answered(page, 3);
  await page.waitForTimeout(1200);
  const length = async () => Number((await page.textContent('#card-fair h2')).match(/length (\d+)/)[1]);
  assert.ok((await length()) > 805, 'the curve goes around the disc');
  await page.uncheck('#obstacle');
  await page.waitForTimeout(1200);
  assert.equal(await length(), 800);
  await page.goto(`${address}#dots?p=100,300;500,300,0,1;900,300&closed=0`);
  await page.waitForTimeout(1500);
  assert.ok((await length()) > 850, 'the curve keeps its tangent');
  // Three dots one on another leave no curve.
  await page.goto(`${address}#dots?p=100,300;100,300;100,300&closed=0`);
  await page.waitForFunction(() => document.getElementById('card-natural').classList.contains('failed'), null, { timeout: WAIT });
  assert.match(await page.textContent('#card-natural .sentence'), /^(Dot 1|[^ ]).+/);
  console.log(await page.textContent('#card-natural .sentence'));
});

test('30 dots are dragged with all four curves live', { skip: missing }, async (t) => {
  const dots = Array.from({ length: 30 }, (_, i) => {
    const [angle, r] = [(2 * Math.PI * i) / 30, 230 + 50 * Math.sin(2.3 * i)];
    return `${(500 + r * Math.cos(angle)).toFixed(1)},${(330 + r * Math.sin(angle)).toFixed(1)}`;
  });
  const page = await open(t, `#dots?p=${dots.join(';')}&closed=1&combs=1`);
  await answered(page, 30);
  const at = await placeOf(page);
  const [x, y] = dots[0].split(',').map(Number);
  const drag = async (seconds) => {
    const counts = () => page.$$eval('.card', (cards) => cards.map((card) => Number(card.dataset.results)));
    const start = await counts();
    await page.mouse.move(...at(x, y));
    await page.mouse.down();
    const stop = await watchFrames(page);
    const started = Date.now();
    for (let i = 0; Date.now() - started < 1000 * seconds; i++) {
      await page.mouse.move(...at(x + 25 * Math.sin(i / 9), y + 25 * Math.sin(i / 13)));
    }
    const { count, most } = await stop();
    const took = (Date.now() - started) / 1000;
    await page.mouse.move(...at(x, y));
    await page.mouse.up();
    return { fps: count / took, most, updates: (await counts()).map((now, i) => (now - start[i]) / took) };
  };
  await drag(4);
  const { fps, most, updates } = await drag(5);
  const milliseconds = await page.$$eval('.card', (cards) => cards.map((card) => Math.round(Number(card.dataset.milliseconds))));
  console.log(`30 dots: ${fps.toFixed(0)} frames/s, longest gap ${most.toFixed(0)} ms; natural, smoothing, fair, scf: ${updates.map((rate) => rate.toFixed(0)).join(', ')} curves/s, last runs ${milliseconds.join(', ')} ms`);
  assert.ok(updates.every((rate) => rate > 1), 'all four curves follow');
});

test('the module runs in the browser, too, and nothing leaves the page', { skip: missing }, async (t) => {
  const page = await open(t);
  const result = await page.evaluate(async () => {
    const { load } = await import('./faircurve.mjs');
    const faircurve = await load();
    const fit = faircurve.fit(Float64Array.of(0, 0, 1, 1, 2, 0, 3, 1), [0, 4], { method: 'fair', samples: 4 });
    const refused = await fetch('https://example.com/').then(() => false, () => true);
    return { status: fit.status, count: fit.coords.length, refused };
  });
  assert.deepEqual(result, { status: ['converged'], count: 26, refused: true });
});

test('dark mode, narrow and wide', { skip: missing }, async (t) => {
  for (const [width, height] of [[1400, 900], [390, 844]]) {
    for (const colorScheme of ['light', 'dark']) {
      const page = await open(t, '#dots', { viewport: { width, height }, colorScheme, hasTouch: width < 500 });
      await page.waitForTimeout(2500);
      const [red] = (await page.evaluate(() => getComputedStyle(document.body).backgroundColor)).match(/\d+/g).map(Number);
      assert.ok(colorScheme === 'dark' ? red < 60 : red > 200);
      assert.ok((await page.evaluate(() => document.documentElement.scrollWidth)) <= width, 'nothing is wider than the screen');
      await shoot(page, `dots-${width}-${colorScheme}`);
      await page.goto(`${address}#files`);
      for (const sample of ['world-110m.topojson', 'traced.svg', 'storms.csv.gz']) {
        await run(page, () => page.click(`[data-sample="${sample}"]`));
        assert.ok((await page.evaluate(() => document.documentElement.scrollWidth)) <= width, 'nothing is wider than the screen');
        await shoot(page, `${sample.split('.')[0]}-${width}-${colorScheme}`);
      }
    }
  }
});
