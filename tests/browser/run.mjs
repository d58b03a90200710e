// The second WGSL compiler check: runs captured dispatches in headless Chromium's WebGPU and compares the buffers.
//
//   node tests/browser/run.mjs CAPTURE.json [MORE.json …]
//
// A capture is an array of dispatches, each
//   { "kernel": name, "wgsl": source, "entry": entry point, "constants": {override: number}, "groups": [x, y, z],
//     "buffers": [{ "binding": n, "group": 0, "kind": "uniform" | "read" | "read_write",
//                   "before": base64, "after": base64 | null, "words": "f32" | "u32" }],
//     "tolerance": t, "subgroup_size": n (only where the kernel counts on subgroups of at least n lanes) }
// Every `after` is compared word by word: u32 words bit for bit, f32 words by |a - b| <= t * max(1, |b|).
//
// Exit status: 0 all passed, 1 some failed, 2 bad usage or capture, 77 nothing could be checked (no Chromium, no
// playwright-core, no WebGPU adapter). Environment: CHROMIUM names the browser's executable.

import { existsSync, readFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { compare } from './compare.mjs';
import { adapterInfo, runDispatch } from './page.mjs';

const UNAVAILABLE = 77;
const FLAGS = [
  '--no-sandbox', '--no-first-run', '--disable-background-networking', '--disable-component-update', '--disable-sync',
  '--disable-default-apps', '--disable-extensions', '--metrics-recording-only',
  // SwiftShader comes with Chromium, so the check needs no GPU and gives the same bits everywhere.
  '--enable-unsafe-webgpu', '--enable-features=Vulkan', '--use-webgpu-adapter=swiftshader',
];

function stop(status, sentence) {
  console.error(sentence);
  process.exit(status);
}

function findChromium() {
  const asked = process.env.CHROMIUM;
  if (asked) return existsSync(asked) ? asked : stop(2, `CHROMIUM names ${asked}, which does not exist`);
  const found = ['/usr/bin/chromium', '/usr/bin/chromium-browser'].find((path) => existsSync(path));
  return found ?? stop(UNAVAILABLE, 'NOTICE: browser check skipped: no Chromium here (install it, or set CHROMIUM)');
}

async function loadPlaywright() {
  try {
    return (await import('playwright-core')).chromium;
  } catch {
    return stop(UNAVAILABLE, 'NOTICE: browser check skipped: no playwright-core (npm ci --prefix tests/browser)');
  }
}

function readCaptures(paths) {
  return paths.flatMap((path) => {
    let captures;
    try {
      captures = JSON.parse(readFileSync(path, 'utf8'));
    } catch (error) {
      stop(2, `cannot read the capture ${path}: ${error.message}`);
    }
    if (!Array.isArray(captures) || captures.length === 0) stop(2, `${path} holds no dispatch: an array of at least one is needed`);
    return captures;
  });
}

// WebGPU exists in secure contexts only, and http://localhost is one.
async function serveEmptyPage() {
  const server = createServer((_, response) => {
    response.setHeader('Content-Type', 'text/html');
    response.end('<!doctype html><title>faircurve</title>');
  });
  await new Promise((ready) => server.listen(0, '127.0.0.1', ready));
  return server;
}

// The line to print for one dispatch, and how it went.
async function check(page, dispatch, offered) {
  const subgroups = /\bsubgroup(_\w|[A-Z])/.test(dispatch.wgsl.replace(/\/\/.*$/gm, ''));
  const needed = dispatch.subgroup_size ?? (subgroups ? 1 : 0);
  const compileOnly = needed > 0 && (!offered.subgroups || offered.subgroupMinSize < needed);
  const result = await page.evaluate(runDispatch, { dispatch, subgroups, compileOnly });
  const notes = result.messages.map((message) => `\n    ${message}`).join('');
  if (result.error) return { outcome: 'failed', line: `FAILED ${dispatch.kernel}: ${result.error}${notes}` };
  if (compileOnly) {
    const why = `needs subgroups of ${needed} lanes, the adapter has ${offered.subgroupMinSize || 'none'}`;
    const what = result.compiled ? 'compiled, not run' : 'not even compiled';
    return { outcome: 'skipped', line: `skipped ${dispatch.kernel}: ${what}: ${why}${notes}` };
  }
  const verdict = compare(dispatch, result.after);
  const line = verdict.failures.length
    ? `FAILED ${dispatch.kernel}: ${verdict.failures.join('; ')}`
    : `ok     ${dispatch.kernel}: ${verdict.words} words, largest difference ${verdict.worst.toExponential(1)}`;
  return { outcome: verdict.failures.length ? 'failed' : 'passed', line: line + notes };
}

async function main() {
  const paths = process.argv.slice(2);
  if (paths.length === 0) stop(2, 'usage: node tests/browser/run.mjs CAPTURE.json [MORE.json …]');
  const dispatches = readCaptures(paths);
  const executablePath = findChromium();
  const playwright = await loadPlaywright();
  const server = await serveEmptyPage();
  // playwright gives every launch a new user-data directory and removes it at the end.
  const browser = await playwright.launch({ executablePath, headless: true, args: FLAGS });
  const count = { passed: 0, failed: 0, skipped: 0 };
  try {
    const page = await browser.newPage();
    await page.goto(`http://localhost:${server.address().port}/`);
    const offered = await page.evaluate(adapterInfo);
    if (!offered) {
      console.error(`NOTICE: browser check skipped: Chromium ${browser.version()} has no WebGPU adapter here`);
      return UNAVAILABLE;
    }
    const subgroups = offered.subgroups
      ? `subgroups of ${offered.subgroupMinSize} to ${offered.subgroupMaxSize} lanes` : 'no subgroups';
    console.log(`Chromium ${browser.version()}, adapter: ${offered.name}; ${subgroups}`);
    for (const dispatch of dispatches) {
      const { outcome, line } = await check(page, dispatch, offered);
      count[outcome] += 1;
      console.log(line);
    }
  } finally {
    await browser.close();
    server.close();
  }
  const skipped = count.skipped ? `, ${count.skipped} skipped` : '';
  console.log(`${count.passed} passed, ${count.failed} failed${skipped}`);
  return count.failed ? 1 : 0;
}

process.exitCode = await main();
