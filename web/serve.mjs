// Serves the page on this machine: node web/serve.mjs [PORT] [FOLDER]
import { readFile } from 'node:fs/promises';
import { createServer } from 'node:http';
import { extname, join, normalize } from 'node:path';
import { fileURLToPath } from 'node:url';

const HERE = fileURLToPath(new URL('.', import.meta.url));
const TYPES = {
  '.html': 'text/html; charset=utf-8', '.css': 'text/css', '.mjs': 'text/javascript', '.js': 'text/javascript',
  '.svg': 'image/svg+xml', '.wasm': 'application/wasm', '.json': 'application/json',
};

/** A server for a folder. Samples of the repository lie elsewhere in it. */
export function serve(folder = HERE, port = 0) {
  const server = createServer(async (request, response) => {
    const path = normalize(decodeURIComponent(new URL(request.url, 'http://localhost').pathname)).replace(/\/$/, '/index.html');
    const isSample = folder === HERE && path.startsWith('/samples/');
    const file = isSample ? join(HERE, '../examples/data', path.slice(9)) : join(folder, path);
    try {
      const content = await readFile(file);
      response.writeHead(200, { 'Content-Type': TYPES[extname(file)] ?? 'application/octet-stream', 'Cache-Control': 'no-cache' });
      response.end(content);
    } catch {
      response.writeHead(404, { 'Content-Type': 'text/plain' });
      response.end(`There is no file ${path} here.\n`);
    }
  });
  return new Promise((ready, fail) => server.once('error', fail).listen(port, '127.0.0.1', () => ready(server)));
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const [port = 8000, folder = HERE] = process.argv.slice(2);
  const server = await serve(folder, Number(port)).catch(() => serve(folder));
  console.log(`The page is at http://localhost:${server.address().port}/`);
}
