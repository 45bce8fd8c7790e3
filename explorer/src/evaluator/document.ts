/** The closed-form document as the service gives it (docs/closed-form.md, "Fields"). */

/** The format, and those with a field besides: of an area constant, and of a shell around a sphere. */
const FORMAT = "veselova.closed-form/1";
const EXTENSIONS = { area: "veselova.closed-form/2", shell: "veselova.closed-form/3" };

export type Pair = [number, number];

export interface PathSeries {
  modes: number[][];
  coefficients: number[];
  turn: number;
}

/** What a body with an area constant has beside the body on whose torus it moves. */
export interface AreaFields {
  odd: PathSeries;
  attitude: number[][];
  momentum: number[];
  inverse: number[][];
  form: number[][];
  constant: number;
}

/** What a shell around a sphere of half its radius has beside Neumann's point. */
export interface ShellFields {
  sphere: number;
  constant: number;
  roots: number[];
  rates: number[];
  start: number[][][];
  still: number[][];
  modes: number[][];
  columns: number[];
  real: number[];
  imaginary: number[];
}

export interface PathFields {
  radius: number;
  position: number[];
  speed: number;
  transverse: PathSeries[];
  /** With an area constant only: what stands in the place of ℜ, and the factor of the odd time. */
  plane?: number[][];
  odd?: number;
}

export interface ClosedFormDocument {
  format: string;
  time: "t" | "s" | "tau1";
  genus: number;
  A: number[];
  axes: number[][] | null;
  riemann_matrix: number[][];
  reduction: { basis: number[][]; waves: number[] } | null;
  characteristics: [number[], number[]][];
  q: Pair[];
  q_prime: Pair[];
  normals: Pair[][];
  gamma: Pair[];
  phases: number[];
  frequencies: number[];
  rotation: number[][];
  directions: number[][];
  frozen: number[][];
  mean_rate: number;
  modes: number[][];
  coefficients: number[];
  rate: { characteristic: number; constant: number; power: number };
  error: { at_start: number; per_unit_time: number };
  path?: PathFields;
  area?: AreaFields;
  shell?: ShellFields;
}

/** Throw an error in one sentence unless this is a document of a version that is read here. */
export function requireDocument(value: unknown): asserts value is ClosedFormDocument {
  const document = (value ?? {}) as Record<string, unknown>;
  const given = String(document.format);
  const formats = [FORMAT, ...Object.values(EXTENSIONS)];
  if (!formats.includes(given)) {
    throw new Error(`The document must have the format ${formats.join(" or ")}; given ${given}.`);
  }
  for (const [field, format] of Object.entries(EXTENSIONS)) {
    const has = document[field] !== undefined;
    if (has === (given === format)) continue;
    throw new Error(`A document has the field ${field} with ${format} alone; ${given} has ${has ? "one" : "none"}.`);
  }
}
