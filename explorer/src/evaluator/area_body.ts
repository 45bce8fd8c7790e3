/**
 * A body with an area constant, (Ω,γ) = c or (K,γ) = c, from the frame [v n_2 γ'] of its torus
 * (docs/closed-form.md, "Area constants").
 *
 * [γ e_2 e_3] is that frame times a constant rotation, so that v is fixed in space like γ. The
 * momentum K is fixed in space too, and Ω = B(K + σγ) with σ = (c − (BK,γ))/(Gγ,γ).
 */
import type { AreaFields } from "./document.ts";
import { apply, cross, dot } from "./linear_algebra.ts";
import type { BodyState } from "./motion.ts";

export class AreaBody {
  readonly #area: AreaFields;

  constructor(area: AreaFields) {
    this.#area = area;
  }

  /** Return the state of the body from the frame of its torus, 3 × 3 row by row. */
  stateOf(own: Float64Array): BodyState {
    const { attitude, inverse } = this.#area;
    const frame = new Float64Array(9);
    for (let i = 0; i < 3; i++) {
      for (let j = 0; j < 3; j++) {
        for (let k = 0; k < 3; k++) frame[3 * i + j] += own[3 * i + k] * attitude[k][j];
      }
    }
    const q = columnOf(frame, [1, 0, 0]);
    const Omega = Float64Array.from(apply(inverse, this.#angularMomentum(frame, q)[0]));
    return { frame, q, velocity: cross(q, Omega), prime: new Float64Array(0), Omega };
  }

  /** The horizontal components of K, along e_2 and e_3. */
  get horizontalMomentum(): [number, number] {
    const [, second, third] = this.#area.momentum;
    return [second, third];
  }

  /** Return v in the body, of which the torus knows the coordinates λ, from a frame at a place. */
  axisOf(frame: ArrayLike<number>, from = 0): Float64Array {
    return columnOf(frame, this.#area.attitude[0], from);
  }

  /** Return (K,Ω) − cσ, which is constant: but for a constant twice the Jacobi integral. */
  integralOf({ frame, q, Omega }: BodyState): number {
    const [, sigma] = this.#angularMomentum(frame, q);
    return dot(columnOf(frame, this.#area.momentum), Omega) - this.#area.constant * sigma;
  }

  /** Return K + σγ in the body, and σ. */
  #angularMomentum(frame: Float64Array, q: Float64Array): [number[], number] {
    const { momentum, inverse, form, constant } = this.#area;
    const K = columnOf(frame, momentum);
    // (BK,γ) = (K,γ)(B − G)₁₁ + (GK,γ), which keeps its digits where G is small beside B
    const along = momentum[0] * (inverse[0][0] - form[0][0]) + dot(apply(form, K), q);
    const sigma = (constant - along) / dot(apply(form, q), q);
    return [Array.from(K, (entry, i) => entry + sigma * q[i]), sigma];
  }
}

/** Return a vector in the body from its components along e_1, e_2, e_3. */
function columnOf(frame: ArrayLike<number>, along: number[], from = 0): Float64Array {
  return Float64Array.from(along, (_, i) =>
    along.reduce((sum, entry, j) => sum + entry * frame[from + 3 * i + j], 0),
  );
}
