/** The state of the body. */
export interface BodyState {
  /** The frame [e_1 … e_n], row by row; e_1 = q. */
  frame: Float64Array;
  q: Float64Array;
  /** dq/dt. */
  velocity: Float64Array;
  /** q' = dq/dτ₁; empty where τ₁ is not known, and with an area constant. */
  prime: Float64Array;
  /** Ω in the body where n = 3, q̇×q where it is horizontal; empty elsewhere. */
  Omega: Float64Array;
}
