/**
 * A shell around a sphere of half its radius, from Neumann's point x and dx/dτ₁: γ is y = B^{1/2}x
 * over its length, and the frame Re Σ_j ψ_j(z) e^{2πi α_jτ₁} b_j (docs/closed-form.md, "Shells").
 */
import * as dd from "./double_double.ts";
import type { ShellFields } from "./document.ts";
import { apply, cross, dot, type Matrix } from "./linear_algebra.ts";
import { type Terms, Waves } from "./waves.ts";

/** Return what gives the state of a shell, from the directions that move and the part of the frame that stands. */
export function shellBody(shell: ShellFields, directions: Matrix, still: Matrix) {
  const { roots, rates, start, constant, sphere, modes, columns, real, imaginary } = shell;
  const [m, n] = [roots.length, still.length];
  const most = modes.flat().reduce((largest, order) => Math.max(largest, Math.abs(order)), 0);
  const waves = new Waves(modes[0]?.length ?? 0, most);
  // Real and imaginary parts of ψ, one column after the other.
  const parts = [...new Set(columns)].map((column): Terms => {
    const own = columns.flatMap((one, k) => (one === column ? [k] : []));
    const [a, b] = [real, imaginary].map((values) => Float64Array.from(own, (k) => values[k]));
    return {
      orders: Int32Array.from(own.flatMap((k) => modes[k])),
      cosines: [a, b],
      sines: [b.map((x) => -x), a],
      places: [column, m * m + column],
    };
  });
  const frameOf = (z: Float64Array, tau: dd.DoubleDouble): Float64Array => {
    const psi = new Float64Array(2 * m * m);
    waves.take(z);
    for (const terms of parts) waves.add(terms, 1, psi);
    const attitude = roots.map(() => new Array<number>(n).fill(0));
    rates.forEach((rate, j) => {
      const angle = 2 * Math.PI * dd.remainder(dd.multiply(tau, [rate, 0]), 1);
      const [c, s] = [Math.cos(angle), Math.sin(angle)];
      attitude.forEach((row, i) => {
        const [a, b] = [psi[m * j + i], psi[m * m + m * j + i]];
        const [x, y] = [a * c - b * s, a * s + b * c];
        row.forEach((_, k) => (row[k] += x * start[0][j][k] - y * start[1][j][k]));
      });
    });
    return Float64Array.from(
      still.flatMap((row, i) => row.map((x, k) => directions[i].reduce((sum, d, l) => sum + d * attitude[l][k], x))),
    );
  };

  /** Return the state of the ball and the contact point on the sphere. */
  return (x: number[], xPrime: number[], z: Float64Array, tau: dd.DoubleDouble) => {
    const [y, yPrime] = [x, xPrime].map((vector) => vector.map((entry, i) => entry * roots[i]));
    const size = Math.hypot(...y);
    const along = dot(y, yPrime) / size ** 2;
    const given = (values: number[]) => Float64Array.from(apply(directions, values));
    const q = given(y.map((entry) => entry / size));
    // dt/dτ₁ = C/|y|
    const velocity = given(yPrime.map((entry, i) => (entry - along * y[i]) / constant));
    const frame = frameOf(z, tau);
    const position = q.map((_, j) => q.reduce((sum, entry, i) => sum + sphere * frame[n * i + j] * entry, 0));
    // ω = γ∧v with γ̇ = −v
    const Omega = n === 3 ? cross(q, velocity) : new Float64Array(0);
    return { frame, q, velocity, prime: new Float64Array(0), Omega, position };
  };
}
