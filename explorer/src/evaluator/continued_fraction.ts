/** Continued fractions of rotation numbers. */

export interface Convergent {
  numerator: number;
  denominator: number;
  error: number;
}

/** Return the partial quotients of |x| as far as a double has them, at most `count`. */
export function partialQuotients(x: number, count = 8): number[] {
  const quotients: number[] = [];
  let rest = Math.abs(x);
  let uncertainty = Math.abs(x) * 4e-16;
  while (quotients.length < count && Number.isFinite(rest)) {
    const whole = Math.floor(rest);
    quotients.push(whole);
    const fraction = rest - whole;
    uncertainty /= fraction * fraction;
    if (fraction < 1e-9 || uncertainty > 0.1) break;
    rest = 1 / fraction;
  }
  return quotients;
}

/** Return the convergents of |x|. */
export function convergents(x: number, count = 8): Convergent[] {
  let [p0, q0, p1, q1] = [0, 1, 1, 0];
  return partialQuotients(x, count).map((quotient) => {
    [p0, p1] = [p1, quotient * p1 + p0];
    [q0, q1] = [q1, quotient * q1 + q0];
    return { numerator: p1, denominator: q1, error: Math.abs(Math.abs(x) - p1 / q1) };
  });
}
