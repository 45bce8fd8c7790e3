/** The closed-form document as the service gives it (docs/closed-form.md, "Fields"). */

export const FORMAT = "veselova.closed-form/1";

/** The format of a body with an area constant, which this evaluator does not have. */
export const AREA_FORMAT = "veselova.closed-form/2";

export type Decimal = number | string;
export type Pair = [number, Decimal];

export interface PathSeries {
  modes: number[][];
  coefficients: Decimal[];
  turn: number;
}

export interface ClosedFormDocument {
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
  modes: number[][];
  coefficients: Decimal[];
  rate: { characteristic: number; constant: Decimal; power: number };
  error: { at_start: number; per_unit_time: number };
  path?: { radius: Decimal; position: Decimal[]; speed: Decimal; transverse: PathSeries[] };
  problem: { system: string };
}

export const number = (value: Decimal): number => Number(value);
export const vector = (values: Decimal[]): number[] => values.map(Number);
export const matrix = (rows: Decimal[][]): number[][] => rows.map(vector);

/** Throw an error in one sentence unless this is a document of the version that is read here. */
export function requireDocument(value: unknown): asserts value is ClosedFormDocument {
  const format = (value as { format?: unknown } | null)?.format;
  if (format !== FORMAT) {
    throw new Error(
      `The document must have the format ${FORMAT}; this server gave ${String(format)}.`,
    );
  }
}
