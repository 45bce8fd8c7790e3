/** The closed-form document as the service gives it (docs/closed-form.md, "Fields"). */

export const FORMAT = "veselova.closed-form/1";

/** The format of a body with an area constant, whose document has the field `area`. */
export const AREA_FORMAT = "veselova.closed-form/2";

/** The format of a shell around a sphere, whose document has the field `shell`. */
export const SHELL_FORMAT = "veselova.closed-form/3";

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
  digits: number;
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
  problem: { system: string };
}

/** Throw an error in one sentence unless this is a document of a version that is read here. */
export function requireDocument(value: unknown): asserts value is ClosedFormDocument {
  const { format, area, shell } = (value ?? {}) as Record<string, unknown>;
  const formats = [FORMAT, AREA_FORMAT, SHELL_FORMAT];
  if (!formats.includes(String(format))) {
    throw new Error(`The document must have the format ${formats.join(" or ")}; given ${String(format)}.`);
  }
  if ((shell !== undefined) !== (format === SHELL_FORMAT)) {
    throw new Error(`A document has the field shell with ${SHELL_FORMAT} alone, given ${String(format)}.`);
  }
  if ((area !== undefined) !== (format === AREA_FORMAT)) {
    const given = area === undefined ? "none" : "one";
    throw new Error(`A document has the field area with ${AREA_FORMAT} alone; ${format} has ${given}.`);
  }
}
