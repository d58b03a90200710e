// Prints how large the page in a folder is, packed as hosts send it, file by file: node size.mjs FOLDER
// Samples are sent only where someone asks for one.
import { readdirSync, readFileSync } from 'node:fs';
import { join, relative } from 'node:path';
import { brotliCompressSync, gzipSync } from 'node:zlib';

const MOST = 3e6;
const [folder] = process.argv.slice(2);
const files = readdirSync(folder, { recursive: true, withFileTypes: true }).filter((entry) => entry.isFile() && relative(folder, entry.parentPath ?? entry.path) !== 'samples');
const sum = { plain: 0, gzip: 0, brotli: 0 };
for (const entry of files) {
  const content = readFileSync(join(entry.parentPath ?? entry.path, entry.name));
  sum.plain += content.length;
  sum.gzip += gzipSync(content, { level: 9 }).length;
  sum.brotli += brotliCompressSync(content).length;
}
const text = (bytes) => `${(bytes / 1e6).toFixed(2)} MB`;
console.log(`${folder}: ${files.length} files, ${text(sum.plain)}; ${text(sum.gzip)} with gzip, ${text(sum.brotli)} with brotli`);
if (sum.gzip > MOST) {
  console.error(`${text(sum.gzip)} with gzip are more than ${text(MOST)}: make the program smaller`);
  process.exit(1);
}
