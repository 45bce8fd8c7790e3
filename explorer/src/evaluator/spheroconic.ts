/** Spheroconic coordinates λ_s of q: the zeros of Σ q_i²/(λ − I_i), one in each [I_s, I_{s+1}]. */

/** Return the numbers I, increasing, and what gives λ. */
export function spheroconic(given: number[]) {
  const order = given.map((_, i) => i).sort((i, j) => given[i] - given[j]);
  const I = order.map((i) => given[i]);
  return {
    moments: I,

    /** Return λ_1 < … < λ_{n−1} of q and the signs of dλ_s/dt. */
    of(q: ArrayLike<number>, velocity: ArrayLike<number>) {
      const x = order.map((i) => q[i]);
      const lambda = Float64Array.from(I.slice(1), (right, s) => zeroBetween(x, I, I[s], right));
      const directions = Array.from(lambda, (value) => {
        const slope = x.reduce((sum, entry, i) => sum + (entry * velocity[order[i]]) / (value - I[i]), 0);
        return slope >= 0 ? 1 : -1;
      });
      return { lambda, directions };
    },
  };
}

function zeroBetween(q: number[], I: number[], left: number, right: number): number {
  const width = right - left;
  if (!(width > 0)) return left;
  // Bisection in x with λ = left + width·x; the function decreases from +∞ to −∞ on the interval.
  let [low, high] = [0, 1];
  for (let step = 0; step < 54 && high - low > 1e-16 * high; step++) {
    const middle = (low + high) / 2;
    let sum = 0;
    for (let i = 0; i < I.length; i++) sum += (q[i] * q[i]) / (left - I[i] + width * middle);
    if (sum > 0) low = middle;
    else high = middle;
  }
  return left + width * ((low + high) / 2);
}
