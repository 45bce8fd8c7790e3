/** Matrices of the size of a genus, as arrays of rows. */

export type Matrix = number[][];

export const dot = (a: ArrayLike<number>, b: ArrayLike<number>): number => {
  let sum = 0;
  for (let i = 0; i < a.length; i++) sum += a[i] * b[i];
  return sum;
};

export const apply = (A: Matrix, x: ArrayLike<number>): number[] => A.map((row) => dot(row, x));

export const transpose = (A: Matrix): Matrix =>
  (A[0] ?? []).map((_, j) => A.map((row) => row[j]));

export const product = (A: Matrix, B: Matrix): Matrix => {
  const columns = transpose(B);
  return A.map((row) => columns.map((column) => dot(row, column)));
};

/** Return A⁻¹, by Gauss and Jordan with pivots. */
export function inverse(A: Matrix): Matrix {
  const n = A.length;
  const rows = A.map((row, i) => [...row, ...row.map((_, j) => (i === j ? 1 : 0))]);
  for (let i = 0; i < n; i++) {
    let pivot = i;
    for (let k = i; k < n; k++) if (Math.abs(rows[k][i]) > Math.abs(rows[pivot][i])) pivot = k;
    [rows[i], rows[pivot]] = [rows[pivot], rows[i]];
    const scale = rows[i][i];
    for (let j = 0; j < 2 * n; j++) rows[i][j] /= scale;
    for (let k = 0; k < n; k++) {
      const factor = rows[k][i];
      if (k !== i) for (let j = 0; j < 2 * n; j++) rows[k][j] -= factor * rows[i][j];
    }
  }
  return rows.map((row) => row.slice(n));
}

export const block = (A: Matrix, rows: number[], columns: number[]): Matrix =>
  rows.map((i) => columns.map((j) => A[i][j]));

/** Return a×b. */
export function cross(a: ArrayLike<number>, b: ArrayLike<number>): Float64Array {
  return Float64Array.of(
    a[1] * b[2] - a[2] * b[1],
    a[2] * b[0] - a[0] * b[2],
    a[0] * b[1] - a[1] * b[0],
  );
}
