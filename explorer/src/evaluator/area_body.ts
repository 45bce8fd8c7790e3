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

export type AreaBody = ReturnType<typeof areaBody>;

export function areaBody({ attitude, momentum, inverse, form, constant }: AreaFields) {
  /** Return K + σγ in the body, and σ. */
  const angularMomentum = (frame: Float64Array, q: Float64Array): [number[], number] => {
    const K = columnOf(frame, momentum);
    // (BK,γ) = (K,γ)(B − G)₁₁ + (GK,γ), which keeps its digits where G is small beside B
    const along = momentum[0] * (inverse[0][0] - form[0][0]) + dot(apply(form, K), q);
    const sigma = (constant - along) / dot(apply(form, q), q);
    return [Array.from(K, (entry, i) => entry + sigma * q[i]), sigma];
  };
  return {
    /** The horizontal components of K, along e_2 and e_3. */
    horizontalMomentum: [momentum[1], momentum[2]] as [number, number],

    /** Return v in the body, of which the torus knows the coordinates λ, from a frame at a place. */
    axisOf: (frame: ArrayLike<number>, from = 0) => columnOf(frame, attitude[0], from),

    /** Return (K,Ω) − cσ, which is constant: but for a constant twice the Jacobi integral. */
    integralOf({ frame, q, Omega }: BodyState): number {
      const [, sigma] = angularMomentum(frame, q);
      return dot(columnOf(frame, momentum), Omega) - constant * sigma;
    },

    /** Return the state of the body from the frame of its torus, 3 × 3 row by row. */
    stateOf(own: Float64Array): BodyState {
      const columns = [0, 1, 2].map((j) => columnOf(own, attitude.map((row) => row[j])));
      const frame = Float64Array.from({ length: 9 }, (_, at) => columns[at % 3][Math.floor(at / 3)]);
      const q = columns[0];
      const Omega = Float64Array.from(apply(inverse, angularMomentum(frame, q)[0]));
      return { frame, q, velocity: cross(q, Omega), prime: new Float64Array(0), Omega };
    },
  };
}

/** Return a vector in the body from its components along e_1, e_2, e_3. */
function columnOf(frame: ArrayLike<number>, along: number[], from = 0): Float64Array {
  return Float64Array.from(along, (_, i) =>
    along.reduce((sum, entry, j) => sum + entry * frame[from + 3 * i + j], 0),
  );
}
