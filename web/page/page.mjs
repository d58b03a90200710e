// @ts-check
// The two rooms of the page.

import { load } from '../faircurve.mjs';
import { Dots } from './dots.mjs';
import { Files } from './files.mjs';

/** @param {string} id */
export const find = (id) => /** @type {any} */ (document.getElementById(id));

/** @param {Error} error */
function fail(error) {
  Object.assign(find('failure'), { hidden: false, textContent: `The page cannot run the program: ${error.message}` });
}

/** Opens the room that the address names. @param {Files} files @param {Dots} dots */
function open(files, dots) {
  const room = location.hash.startsWith('#dots') ? 'dots' : 'files';
  for (const name of ['files', 'dots']) {
    find(`${name}-room`).hidden = name !== room;
    find(`to-${name}`).toggleAttribute('aria-current', name === room);
  }
  if (room === 'dots') dots.open();
  else files.open();
}

async function main() {
  const { module } = await load(new URL('../dist/faircurve.wasm', import.meta.url));
  const [files, dots] = [new Files(module), new Dots(module)];
  addEventListener('hashchange', () => open(files, dots));
  open(files, dots);
  document.documentElement.dataset.ready = 'yes';
}

main().catch(fail);
