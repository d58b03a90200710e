// Compares the buffers that came back with the captured ones, word by word.

const words = (base64, Type) => {
  const bytes = Buffer.from(base64, 'base64');
  const whole = new Uint8Array(bytes); // a copy starts at offset 0, as typed arrays demand
  return new Type(whole.buffer, 0, Math.floor(whole.length / 4));
};

// { failures: sentences, words: number compared, worst: largest |a - b| / max(1, |b|) of the f32 words }.
export function compare(dispatch, after) {
  const failures = [];
  let compared = 0;
  let worst = 0;
  dispatch.buffers.forEach((buffer, i) => {
    if (buffer.after == null) return;
    const place = `buffer ${buffer.group ?? 0}:${buffer.binding}`;
    if (buffer.words !== 'f32' && buffer.words !== 'u32') {
      failures.push(`${place}: "words" is ${JSON.stringify(buffer.words)}; "f32" and "u32" are possible`);
      return;
    }
    const expected = words(buffer.after, Uint32Array);
    const found = words(after[i], Uint32Array);
    if (expected.length !== found.length) {
      failures.push(`${place}: ${found.length} words came back, ${expected.length} were captured`);
      return;
    }
    const floats = buffer.words === 'f32';
    const tolerance = buffer.tolerance ?? dispatch.tolerance;
    const [a, b] = floats ? [words(after[i], Float32Array), words(buffer.after, Float32Array)] : [found, expected];
    const wrong = [];
    for (let k = 0; k < expected.length; k += 1) {
      if (found[k] === expected[k]) continue;
      const bothNaN = floats && Number.isNaN(a[k]) && Number.isNaN(b[k]);
      const difference = Math.abs(a[k] - b[k]) / Math.max(1, Math.abs(b[k]));
      if (bothNaN) continue;
      if (floats && difference > worst) worst = difference;
      // Written so that a NaN on one side only counts as wrong.
      if (!floats || !(difference <= tolerance)) wrong.push(k);
    }
    compared += expected.length;
    if (wrong.length) {
      const k = wrong[0];
      const by = floats ? `, tolerance ${tolerance}` : '';
      failures.push(`${place}: ${wrong.length} of ${expected.length} words differ, first word ${k}: ${a[k]} here, ${b[k]} captured${by}`);
    }
  });
  if (compared === 0 && failures.length === 0) failures.push('no buffer has an expected content, so nothing was compared');
  return { failures, words: compared, worst };
}
