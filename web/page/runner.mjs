// @ts-check
// Workers that run the program. One that is no longer wanted is ended; the next is ready by then.

export class Runner {
  /** @param {WebAssembly.Module} module */
  constructor(module) {
    this.module = module;
    this.spare = this.start();
    this.worker = this.start();
    /** @type {((reason: Error) => void) | null} */
    this.reject = null;
    this.id = 0;
  }

  start() {
    const worker = new Worker(new URL('./worker.mjs', import.meta.url), { type: 'module' });
    worker.postMessage({ module: this.module });
    return worker;
  }

  /** Ends the run under way, if there is one. */
  cancel() {
    if (!this.reject) return;
    this.worker.terminate();
    this.reject(new Cancelled());
    this.reject = null;
    this.worker = this.spare;
    this.spare = this.start();
  }

  /**
   * @param {Record<string, any>} ask
   * @returns {Promise<any>}
   */
  run(ask) {
    this.cancel();
    const { worker } = this;
    const id = ++this.id;
    return new Promise((resolve, reject) => {
      this.reject = reject;
      const done = (/** @type {() => void} */ settle) => {
        this.reject = null;
        settle();
      };
      worker.onerror = (event) => done(() => reject(new Error(event.message || 'the worker ended')));
      worker.onmessage = ({ data }) => {
        if (data.id === id) done(() => ('error' in data ? reject(new Error(data.error)) : resolve(data.result)));
      };
      worker.postMessage({ ...ask, id });
    });
  }
}

/** Why a run has no result: a newer one took its place. */
export class Cancelled extends Error {}

/** A run that takes longer than this gives way to a newer one, in milliseconds. */
const PATIENCE = 400;

/** Runs the latest of what is asked for, and leaves out what came between. */
export class Latest {
  /** @param {WebAssembly.Module} module @param {(result: any, error: Error | null) => void} show */
  constructor(module, show) {
    this.runner = new Runner(module);
    this.show = show;
    /** @type {Record<string, any> | null} */
    this.next = null;
    this.since = 0;
  }

  /** @param {Record<string, any>} ask */
  ask(ask) {
    if (this.since && performance.now() - this.since < PATIENCE) this.next = ask;
    else this.run(ask);
  }

  /** @param {Record<string, any>} ask */
  async run(ask) {
    this.next = null;
    const since = (this.since = performance.now());
    const late = setTimeout(() => this.next && this.run(this.next), PATIENCE);
    try {
      const result = await this.runner.run(ask);
      this.show(result, null);
    } catch (error) {
      if (error instanceof Cancelled) return;
      this.show(null, /** @type {Error} */ (error));
    } finally {
      clearTimeout(late);
      if (this.since === since) this.since = 0;
    }
    if (this.next) this.run(this.next);
  }
}
