/** Where the program is: its address, its bytes, or the compiled module. */
export type Source = string | URL | ArrayBuffer | Uint8Array | WebAssembly.Module;

/** What a run of the program did. */
export interface Run {
  /** 0: all is well; 1: some curves could not be used; 2: the run failed; 134: the program ended itself. */
  status: number;
  stdout: Uint8Array;
  /** What it said. */
  stderr: string;
  /** The files that it wrote, by name. */
  files: Record<string, Uint8Array>;
  /** Memory that it took. */
  memoryBytes: number;
}

type Value = string | number | boolean | undefined;

/** Options of a fit: its own, and any of `faircurve fit --help` in camel case. */
export interface FitOptions {
  /** Numbers per point: 2, the default, or 3. */
  dimension?: 2 | 3;
  /** Whether the curves are closed: one answer for all, or one per curve. */
  closed?: boolean | ArrayLike<boolean | number> & Iterable<boolean | number>;
  /** A parameter, such as a time, per point. */
  t?: ArrayLike<number>;
  /** A weight per point. */
  weights?: ArrayLike<number>;
  /** Files that options name, such as `obstacles: 'rocks.geojson'`. */
  files?: Record<string, Uint8Array | string>;
  method?: 'natural' | 'smoothing' | 'fair' | 'scf' | 'geodesic';
  /** `minRadius: 2` is `--min-radius=2`, `energy: { bending: 1, length: 0.1 }` is `--energy=bending=1,length=0.1`. */
  [option: string]: Value | readonly Value[] | readonly (readonly Value[])[] | Record<string, any> | ArrayLike<number>;
}

/** The fitted curves, as samples. */
export interface FitResult {
  coords: Float64Array;
  /** Curve i has the samples offsets[i] … offsets[i + 1] − 1. */
  offsets: Uint32Array;
  /** The status of every curve, such as `converged`. */
  status: string[];
  /** What is to be said of every curve; often nothing. */
  message: string[];
  /** The program's report, as `--report` writes it. */
  report: any;
  /** The parameters `t`, and what `write` asks for, such as `curvature`. */
  columns: Record<string, Float64Array>;
}

/** Compiles the program; by default the one that is beside this module. */
export function load(source?: Source): Promise<Faircurve>;

export class Faircurve {
  constructor(module: WebAssembly.Module);
  readonly module: WebAssembly.Module;
  /** Runs the program as a command line does, in a folder that holds `files`. */
  run(args: string[], files?: Record<string, Uint8Array | string>): Run;
  /** Fits a curve to every point list. Throws an Error with the program's sentence. */
  fit(coords: Float64Array, offsets: ArrayLike<number>, options?: FitOptions): FitResult;
}

/** Options as words of a command line. */
export function words(options: Record<string, any>): string[];
/** The program's last sentence, without its name. */
export function sentence(stderr: string): string;
/** Reads an NPZ file that is not compressed. */
export function readNpz(bytes: Uint8Array): Record<string, { shape: number[]; data: Float64Array | Uint8Array | string[] }>;
/** Writes an NPZ file. */
export function writeNpz(arrays: Record<string, { shape: number[]; data: Float64Array | BigInt64Array | Uint8Array }>): Uint8Array;
