/**
 * A shell around a sphere of half its radius, from Neumann's point x and dx/dτ₁: γ is y = B^{1/2}x
 * over its length, and the frame Re Σ_j ψ_j(z) e^{2πi α_jτ₁} b_j (docs/closed-form.md, "Shells").
 */
import * as dd from "./double_double.ts";
import type { ShellFields } from "./document.ts";
import { apply, cross, dot, type Matrix } from "./linear_algebra.ts";
import type { BodyState } from "./motion.ts";
import { type Terms, Waves } from "./waves.ts";

export class ShellBody {
  readonly #shell: ShellFields;
  /** The directions that move, and the part of the frame that stands, along the given axes. */
  readonly #directions: Matrix;
  readonly #still: Matrix;
  /** Real and imaginary parts of ψ, one column after the other. */
  readonly #psi: Terms[];
  readonly #waves: Waves;

  constructor(shell: ShellFields, directions: Matrix, still: Matrix) {
    this.#shell = shell;
    this.#directions = directions;
    this.#still = still;
    const { modes, columns, real, imaginary, roots } = shell;
    const most = modes.flat().reduce((largest, m) => Math.max(largest, Math.abs(m)), 0);
    this.#waves = new Waves(modes[0]?.length ?? 0, most);
    this.#psi = [...new Set(columns)].map((column) => {
      const own = columns.flatMap((one, k) => (one === column ? [k] : []));
      const [a, b] = [real, imaginary].map((parts) => Float64Array.from(own, (k) => parts[k]));
      return {
        orders: Int32Array.from(own.flatMap((k) => modes[k])),
        cosines: [a, b],
        sines: [b.map((x) => -x), a],
        places: [column, roots.length ** 2 + column],
      };
    });
  }

  /** Return the state of the ball and the contact point on the sphere. */
  stateOf(
    x: number[],
    xPrime: number[],
    z: Float64Array,
    tau: dd.DoubleDouble,
  ): BodyState & { position: Float64Array } {
    const { roots, constant, sphere } = this.#shell;
    const y = x.map((entry, i) => entry * roots[i]);
    const yPrime = xPrime.map((entry, i) => entry * roots[i]);
    const size = Math.hypot(...y);
    const along = dot(y, yPrime) / size ** 2;
    // dt/dτ₁ = C/|y|
    const rate = yPrime.map((entry, i) => (entry - along * y[i]) / constant);
    const given = (values: number[]) => Float64Array.from(apply(this.#directions, values));
    const q = given(y.map((entry) => entry / size));
    const velocity = given(rate);
    const frame = this.#frame(z, tau);
    const n = q.length;
    const position = q.map((_, j) => q.reduce((sum, entry, i) => sum + sphere * frame[n * i + j] * entry, 0));
    // ω = γ∧v with γ̇ = −v
    const Omega = n === 3 ? cross(q, velocity) : new Float64Array(0);
    return { frame, q, velocity, prime: new Float64Array(0), Omega, position };
  }

  #frame(z: Float64Array, tau: dd.DoubleDouble): Float64Array {
    const { rates, roots, start } = this.#shell;
    const [m, n] = [roots.length, this.#still.length];
    const psi = new Float64Array(2 * m * m);
    this.#waves.take(z);
    for (const terms of this.#psi) this.#waves.add(terms, 1, psi);
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
    return Float64Array.from({ length: n * n }, (_, at) => {
      const [i, k] = [Math.floor(at / n), at % n];
      return this.#directions[i].reduce((sum, d, l) => sum + d * attitude[l][k], this.#still[i][k]);
    });
  }
}
