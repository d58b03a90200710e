// @ts-check
// Colours of the style sheet, as canvases need them.

/** @type {Record<string, string>} */
let known = {};

/** @param {string} name such as `after`, of `--after` */
export function colour(name) {
  return (known[name] ??= getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim());
}

/** @param {() => void} act */
export function whenColoursChange(act) {
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => {
    known = {};
    act();
  });
}
