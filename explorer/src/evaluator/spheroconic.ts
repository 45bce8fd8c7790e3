/** Spheroconic coordinates λ_s of q: the zeros of Σ q_i²/(λ − I_i), one in each [I_s, I_{s+1}]. */

export class Spheroconic {
  /** The numbers I, increasing. */
  readonly moments: number[];
  /** Which of those given each is. */
  readonly #order: number[];

  constructor(I: number[]) {
    this.#order = I.map((_, i) => i).sort((i, j) => I[i] - I[j]);
    this.moments = this.#order.map((i) => I[i]);
  }

  /** Return λ_1 < … < λ_{n−1} of q and the signs of dλ_s/dt. */
  of(q: ArrayLike<number>, velocity: ArrayLike<number>): { lambda: Float64Array; directions: number[] } {
    const I = this.moments;
    const x = this.#order.map((i) => q[i]);
    const zeros = I.slice(1).map((right, s) => zeroBetween(x, I, I[s], right));
    const directions = zeros.map((value) => {
      const slope = x.reduce((sum, entry, i) => sum + (entry * velocity[this.#order[i]]) / (value - I[i]), 0);
      return slope >= 0 ? 1 : -1;
    });
    return { lambda: Float64Array.from(zeros), directions };
  }
}

function zeroBetween(q: number[], I: number[], left: number, right: number): number {
  const width = right - left;
  if (!(width > 0)) return left;
  // Bisection in x with λ = left + width·x; the function decreases from +∞ to −∞ on the interval.
  let low = 0;
  let high = 1;
  for (let step = 0; step < 54 && high - low > 1e-16 * high; step++) {
    const middle = (low + high) / 2;
    let sum = 0;
    for (let i = 0; i < I.length; i++) sum += (q[i] * q[i]) / (left - I[i] + width * middle);
    if (sum > 0) low = middle;
    else high = middle;
  }
  return left + width * ((low + high) / 2);
}
