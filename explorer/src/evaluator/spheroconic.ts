/** Spheroconic coordinates λ_s of q: the zeros of Σ q_i²/(λ − I_i), one in each [I_s, I_{s+1}]. */

/** Write λ_1 < … < λ_{n−1} into `out`; `I` must increase. */
export function spheroconic(
  q: ArrayLike<number>,
  I: ArrayLike<number>,
  out: Float64Array,
): Float64Array {
  for (let s = 0; s + 1 < I.length; s++) out[s] = zeroBetween(q, I, I[s], I[s + 1]);
  return out;
}

function zeroBetween(
  q: ArrayLike<number>,
  I: ArrayLike<number>,
  left: number,
  right: number,
): number {
  const width = right - left;
  if (!(width > 0)) return left;
  // Bisection in x with λ = left + width·x; the function decreases from +∞ to −∞ on the interval.
  let low = 0;
  let high = 1;
  for (let step = 0; step < 54 && high - low > 1e-16 * high; step++) {
    const middle = (low + high) / 2;
    let sum = 0;
    for (let i = 0; i < I.length; i++) {
      const distance = left - I[i] + width * middle;
      sum += (q[i] * q[i]) / distance;
    }
    if (sum > 0) low = middle;
    else high = middle;
  }
  return left + width * ((low + high) / 2);
}

/** Return the signs of dλ_s/dt from q and its velocity. */
export function directions(
  q: ArrayLike<number>,
  velocity: ArrayLike<number>,
  I: ArrayLike<number>,
  lambda: ArrayLike<number>,
): number[] {
  return Array.from(lambda, (value) => {
    let slope = 0;
    for (let i = 0; i < I.length; i++) slope += (q[i] * velocity[i]) / (value - I[i]);
    return slope >= 0 ? 1 : -1;
  });
}
