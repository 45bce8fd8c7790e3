/** Numbers as their texts state them, exactly: 0.7, 1e12 and 7/10. */

/** Numerator and denominator, of any sign. */
export type Fraction = [bigint, bigint];

const DECIMAL = /^\s*([-+]?\d*)\.?(\d*)(?:e([-+]?\d{1,3}))?\s*$/i;

/** Return the number that a text states; null of what states none. */
export function fractionOf(text: string): Fraction | null {
  const parts = text.split("/").map(decimalOf);
  const [above, below = [1n, 1n]] = parts;
  if (parts.length > 2 || !above || !below?.[0]) return null;
  return [above[0] * below[1], above[1] * below[0]];
}

function decimalOf(text: string): Fraction | null {
  const [, whole, places, power = "0"] = DECIMAL.exec(text) ?? [];
  if (!/\d/.test(`${whole ?? ""}${places ?? ""}`)) return null;
  const shift = Number(power) - places.length;
  const ten = 10n ** BigInt(Math.abs(shift));
  const digits = BigInt(whole + places);
  return shift > 0 ? [digits * ten, 1n] : [digits, ten];
}

/** Return a fraction as text: a short decimal where that is exact. */
export function textOf([above, below]: Fraction): string {
  let [divisor, rest] = [above, below];
  while (rest) [divisor, rest] = [rest, divisor % rest];
  if (divisor < 0n !== below < 0n) divisor = -divisor;
  const [n, d] = [above / divisor, below / divisor];
  const short = 10n ** 9n % d === 0n && n * n < 10n ** 30n;
  return short ? String(Number(n) / Number(d)) : `${n}/${d}`;
}
