/**
 * A shell around a sphere of half its radius, from Neumann's point x and dx/dτ₁: γ is y = B^{1/2}x
 * over its length, and the frame Re Σ_j ψ_j(z) e^{2πi α_jτ₁} b_j (docs/closed-form.md, "Shells").
 */
import type { BodyState } from "./body_state.ts";
import { matrix, vector } from "./document.ts";
import type { ShellFields } from "./document.ts";
import { apply, cross, dot } from "./linear_algebra.ts";
import type { Matrix } from "./linear_algebra.ts";
import { powersOfWaves } from "./theta.ts";

export class ShellBody {
  readonly #shell: ShellFields;
  readonly #roots: number[];
  /** The directions that move, and the part of the frame that stands, along the given axes. */
  readonly #directions: Matrix;
  readonly #still: Matrix;
  readonly #start: Matrix[];
  /** The modes of one term after the other, their coefficients, and places in ψ. */
  readonly #orders: Int32Array;
  readonly #real: Float64Array;
  readonly #imaginary: Float64Array;
  readonly #columns: Int32Array;
  readonly #most: number;
  readonly #waves: [Float64Array[], Float64Array[]];

  constructor(shell: ShellFields, directions: Matrix, still: Matrix) {
    this.#shell = shell;
    this.#roots = vector(shell.roots);
    this.#directions = directions;
    this.#still = still;
    this.#start = shell.start.map(matrix);
    this.#orders = Int32Array.from(shell.modes.flat());
    this.#real = Float64Array.from(shell.real);
    this.#imaginary = Float64Array.from(shell.imaginary);
    this.#columns = Int32Array.from(shell.columns);
    this.#most = this.#orders.reduce((most, m) => Math.max(most, Math.abs(m)), 0);
    const room = () => (shell.modes[0] ?? []).map(() => new Float64Array(2 * this.#most + 1));
    this.#waves = [room(), room()];
  }

  /** Return the state of the ball and the contact point on the sphere. */
  stateOf(x: number[], xPrime: number[], z: Float64Array, tau: number): BodyState & { position: number[] } {
    const y = x.map((entry, i) => entry * this.#roots[i]);
    const yPrime = xPrime.map((entry, i) => entry * this.#roots[i]);
    const size = Math.hypot(...y);
    const along = dot(y, yPrime) / size ** 2;
    // dt/dτ₁ = C/|y|
    const rate = yPrime.map((entry, i) => (entry - along * y[i]) / this.#shell.constant);
    const inSpace = (values: number[]) => Float64Array.from(apply(this.#directions, values));
    const q = inSpace(y.map((entry) => entry / size));
    const velocity = inSpace(rate);
    const frame = this.#frame(z, tau);
    const n = q.length;
    const position = Array.from(q, (_, j) =>
      q.reduce((sum, entry, i) => sum + this.#shell.sphere * frame[n * i + j] * entry, 0),
    );
    // ω = γ∧v with γ̇ = −v
    const Omega = n === 3 ? cross(q, velocity) : new Float64Array(0);
    return { frame, q, velocity, prime: new Float64Array(0), Omega, position };
  }

  #frame(z: Float64Array, tau: number): Float64Array {
    const [m, n, most] = [this.#roots.length, this.#still.length, this.#most];
    const [real, imaginary] = this.#waves;
    powersOfWaves(z, most, Math.PI, real, imaginary);
    const psi = [new Float64Array(m * m), new Float64Array(m * m)];
    const g = real.length;
    for (let k = 0; k < this.#columns.length; k++) {
      let x = this.#real[k];
      let y = this.#imaginary[k];
      for (let s = 0; s < g; s++) {
        const c = real[s][most + this.#orders[k * g + s]];
        const i = imaginary[s][most + this.#orders[k * g + s]];
        const turned = x * c - y * i;
        y = x * i + y * c;
        x = turned;
      }
      psi[0][this.#columns[k]] += x;
      psi[1][this.#columns[k]] += y;
    }
    const attitude = this.#roots.map(() => new Array<number>(n).fill(0));
    this.#shell.rates.forEach((rate, j) => {
      const angle = 2 * Math.PI * ((rate * tau) % 1);
      const [c, s] = [Math.cos(angle), Math.sin(angle)];
      attitude.forEach((row, i) => {
        const [a, b] = [psi[0][m * j + i], psi[1][m * j + i]];
        const [x, y] = [a * c - b * s, a * s + b * c];
        row.forEach((_, k) => (row[k] += x * this.#start[0][j][k] - y * this.#start[1][j][k]));
      });
    });
    return Float64Array.from({ length: n * n }, (_, at) => {
      const [i, k] = [Math.floor(at / n), at % n];
      return this.#directions[i].reduce((sum, d, l) => sum + d * attitude[l][k], this.#still[i][k]);
    });
  }
}
