/** The closed-form document as the service gives it (docs/closed-form.md, "Fields"). */

export const FORMAT = "veselova.closed-form/3";

/** Formats that are read besides: a row of `modes` is one mode there, and `scale` is missing. */
const EARLIER = ["veselova.closed-form/1", "veselova.closed-form/2"];

export type Decimal = number | string;
export type Pair = [number, Decimal];

/** Rows [m_1, …, m_g, count], and F·scale of each mode. */
export interface ModeFields {
  modes: number[][];
  coefficients: Decimal[];
  scale?: Decimal;
}

export type Mode = [mode: number[], coefficient: number];

/** Modes are doubled here. */
export interface PathSeries extends ModeFields {
  turn: number;
}

/** What a body with an area constant has beside the body on whose torus it moves. */
export interface AreaFields {
  odd: PathSeries;
  attitude: Decimal[][];
  momentum: Decimal[];
  inverse: Decimal[][];
  form: Decimal[][];
  constant: Decimal;
}

export interface PathFields {
  radius: Decimal;
  position: Decimal[];
  speed: Decimal;
  transverse: PathSeries[];
  /** With an area constant only: what stands in the place of ℜ, and the factor of the odd time. */
  plane?: Decimal[][];
  odd?: Decimal;
}

export interface ClosedFormDocument extends ModeFields {
  format: string;
  time: "t" | "s" | "tau1";
  digits: number;
  genus: number;
  A: Decimal[];
  axes: Decimal[][] | null;
  riemann_matrix: Decimal[][];
  reduction: { basis: number[][]; waves: number[] } | null;
  characteristics: [number[], number[]][];
  q: Pair[];
  q_prime: Pair[];
  normals: Pair[][];
  gamma: Pair[];
  phases: Decimal[];
  frequencies: Decimal[];
  rotation: Decimal[][];
  directions: Decimal[][];
  frozen: Decimal[][];
  mean_rate: Decimal;
  rate: { characteristic: number; constant: Decimal; power: number };
  error: { at_start: number; per_unit_time: number };
  path?: PathFields;
  area?: AreaFields;
  problem: { system: string };
}

export const number = (value: Decimal): number => Number(value);
export const vector = (values: Decimal[]): number[] => values.map(Number);
export const matrix = (rows: Decimal[][]): number[][] => rows.map(vector);

/** Throw an error in one sentence unless this is a document of a version that is read here. */
export function requireDocument(value: unknown): asserts value is ClosedFormDocument {
  const { format } = (value ?? {}) as { format?: unknown };
  if (format !== FORMAT && !EARLIER.includes(String(format))) {
    throw new Error(`The document must have the format ${FORMAT}; given ${String(format)}.`);
  }
}

/** Return each mode and its coefficient F; the last entries of a row's modes increase by `stride`. */
export function modesOf(
  { modes, coefficients, scale = 1 }: ModeFields,
  genus: number,
  stride: number,
): Mode[] {
  const all = modes.flatMap((row) =>
    Array.from({ length: row[genus] ?? 1 }, (_, k) => [
      ...row.slice(0, genus - 1),
      row[genus - 1] + stride * k,
    ]),
  );
  return all.map((mode, k) => [mode, number(coefficients[k]) / number(scale)]);
}
