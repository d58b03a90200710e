// The package in Node, compared with the native program that FAIRCURVE names.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { test } from 'node:test';
import { load, readNpz, words, writeNpz } from 'faircurve';
import { difference } from './compare.mjs';

const DATA = new URL('../../examples/data/', import.meta.url);
const faircurve = await load();
const zigzag = Float64Array.of(0, 0, 1, 1, 2, 0, 3, 1);

test('curves go through their points', () => {
  for (const method of ['natural', 'fair', 'scf']) {
    const fit = faircurve.fit(zigzag, [0, 4], { method, samples: 8, write: ['curvature', 'tangent'] });
    assert.deepEqual(fit.status, ['converged'], method);
    assert.deepEqual([...fit.offsets], [0, 25]);
    for (let i = 0; i < 4; i++) {
      assert.ok(Math.abs(fit.coords[16 * i] - zigzag[2 * i]) < 1e-12 && Math.abs(fit.coords[16 * i + 1] - zigzag[2 * i + 1]) < 1e-12, method);
    }
    assert.equal(fit.columns.curvature.length, 25);
    assert.ok(Math.abs(Math.hypot(fit.columns.tangent_x[5], fit.columns.tangent_y[5]) - 1) < 1e-12);
  }
});

test('options reach the program', () => {
  const square = Float64Array.of(0, 0, 2, 0, 2, 2, 0, 2);
  const open = faircurve.fit(square, [0, 4], { samples: 4 });
  const closed = faircurve.fit(square, [0, 4], { samples: 4, closed: true });
  assert.deepEqual([open.offsets[1], closed.offsets[1]], [13, 16]);
  const path = faircurve.fit(zigzag, Uint32Array.of(0, 4), { method: 'fair', minRadius: 0.3, deviation: 0.2, points: 64, keepOut: [[1, 0, 0.4], [2, 1, 0.4]] });
  assert.equal(path.offsets[1], 64);
  for (let i = 0; i < 64; i++) assert.ok(Math.hypot(path.coords[2 * i] - 1, path.coords[2 * i + 1]) > 0.4 - 1e-3);
  const timed = faircurve.fit(zigzag, [0, 4], { t: [0, 1, 2, 5], samples: 1 });
  assert.deepEqual([...timed.columns.t], [0, 1, 2, 5]);
  const heavy = faircurve.fit(zigzag, [0, 4], { method: 'smoothing', smoothing: 10, pin: 'none', samples: 1, weights: [1, 1e9, 1, 1] });
  assert.ok(Math.hypot(heavy.coords[2] - 1, heavy.coords[3] - 1) < 1e-6 && Math.abs(heavy.coords[5]) > 1e-3);
  const space = faircurve.fit(Float64Array.of(0, 0, 0, 1, 1, 0, 2, 0, 1), [0, 3], { dimension: 3, samples: 1 });
  assert.equal(space.coords.length, 9);
  assert.deepEqual(words({ minRadius: 2, energy: { bending: 1, length: 0.1 }, keepOut: [[0, 0, 1], [5, 0, 1]], strict: true, closed: undefined }),
    ['--min-radius=2', '--energy=bending=1,length=0.1', '--keep-out=0,0,1', '--keep-out=5,0,1', '--strict']);
});

test('one bad curve keeps its neighbours, and says why', () => {
  const coords = Float64Array.of(...zigzag, 0, 0, NaN, 1, 2, 2);
  const fit = faircurve.fit(coords, [0, 4, 7], { samples: 1 });
  assert.deepEqual(fit.status, ['converged', 'invalid']);
  assert.match(fit.message[1], /curve 1/);
});

test('errors are the sentences of the program', () => {
  assert.throws(() => faircurve.fit(zigzag, [0, 4], { method: 'natural', minRadius: 2 }), { name: 'Error', message: '--min-radius belongs to --method fair' });
  assert.throws(() => faircurve.fit(zigzag, [0, 4], { methood: 'natural' }), /unexpected argument '--methood' found/);
  const { status, stderr } = faircurve.run(['fit', 'none.csv', '-o', 'out.csv']);
  assert.equal(status, 2);
  assert.match(stderr, /none\.csv/);
});

test('names may have any letters, and inputs stay as they are', () => {
  const run = faircurve.run(['fit', 'Länder 1.csv', '-o', 'ö.csv', '--quiet'], { 'Länder 1.csv': 'x,y\n0,0\n1,1\n2,0\n' });
  assert.deepEqual([run.status, Object.keys(run.files)], [0, ['ö.csv']]);
  const forced = faircurve.run(['fit', 'a.csv', '-o', 'b.csv', '--quiet'], { 'a.csv': 'x,y\n0,0\n1,1\n', 'b.csv': 'kept' });
  assert.equal(forced.status, 2);
  assert.match(forced.stderr, /b\.csv/);
});

test('NPZ files are read as they are written', () => {
  const arrays = { coords: { shape: [2, 2], data: Float64Array.of(1, 2, 3, 4.5) }, offsets: { shape: [2], data: BigInt64Array.of(0n, 2n) }, closed: { shape: [1], data: Uint8Array.of(1) } };
  const read = readNpz(writeNpz(arrays));
  assert.deepEqual(read.coords, arrays.coords);
  assert.deepEqual([...read.offsets.data, ...read.closed.data], [0, 2, 1]);
});

test('output is that of the native program', { skip: !process.env.FAIRCURVE && 'FAIRCURVE names no native program' }, () => {
  const folder = mkdtempSync(join(tmpdir(), 'faircurve-'));
  try {
    for (const [input, ...args] of [
      ['octopus.csv', 'fit', 'octopus.csv', '-o', 'out.npz', '--method', 'scf', '--write', 'curvature,tangent'],
      ['countries-110m.geojson', 'fit', 'countries-110m.geojson', '-o', 'out.geojson'],
      ['countries-110m.geojson', 'map', 'countries-110m.geojson', '-o', 'out.geojson', '--within', '20km'],
      ['heights.csv', 'grid', 'heights.csv', '-o', 'out.csv'],
      ['control_points.csv', 'bezier', 'control_points.csv', '-o', 'out.csv', '--tangents', 'derivatives'],
      ['path.csv', 'fit', 'path.csv', '-o', 'out.svg', '--method', 'fair', '--as', 'bezier'],
    ]) {
      const [content, output] = [readFileSync(new URL(input, DATA)), args[args.indexOf('-o') + 1]];
      writeFileSync(join(folder, input), content);
      execFileSync(process.env.FAIRCURVE, [...args, '--quiet', '--force'], { cwd: folder });
      const run = faircurve.run([...args, '--quiet'], { [input]: content });
      const off = difference(output, run.files[output], readFileSync(join(folder, output)));
      console.log(`${args.join(' ')}: largest difference ${off.toExponential(1)}`);
      assert.ok(off < 1e-9, args.join(' '));
    }
  } finally {
    rmSync(folder, { recursive: true });
  }
});

test('a run starts in a few milliseconds', () => {
  const time = (args, files) => {
    const times = Array.from({ length: 60 }, () => {
      const started = performance.now();
      faircurve.run(args, files);
      return performance.now() - started;
    }).slice(-30);
    return times.sort((a, b) => a - b)[15];
  };
  const instance = time(['--version'], {});
  console.log(`instance, start and --version: ${instance.toFixed(1)} ms; a natural spline: ${time(['fit', 'a.csv', '-o', 'b.csv', '--quiet'], { 'a.csv': 'x,y\n0,0\n1,1\n2,0\n' }).toFixed(1)} ms`);
  assert.ok(instance < 60, `${instance} ms`);
});
