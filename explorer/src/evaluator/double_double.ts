/**
 * Numbers as unevaluated sums of two doubles, some 32 digits: phases of far times are reduced in
 * them, since one double has no digit left of the phase after 10¹⁶ cycles.
 */

import { fractionOf } from "./fraction.ts";

export type DoubleDouble = readonly [number, number];

const SPLITTER = 134217729; // 2²⁷ + 1: halves a double into two of 26 bits (Dekker)

function sumExactly(a: number, b: number): DoubleDouble {
  const sum = a + b;
  const part = sum - a;
  return [sum, a - (sum - part) + (b - part)];
}

function multiplyExactly(a: number, b: number): DoubleDouble {
  const product = a * b;
  const x = SPLITTER * a;
  const y = SPLITTER * b;
  const aHigh = x - (x - a);
  const bHigh = y - (y - b);
  const aLow = a - aHigh;
  const bLow = b - bHigh;
  return [product, aLow * bLow - (product - aHigh * bHigh - aLow * bHigh - aHigh * bLow)];
}

export function add(a: DoubleDouble, b: DoubleDouble): DoubleDouble {
  const [high, low] = sumExactly(a[0], b[0]);
  return sumExactly(high, low + a[1] + b[1]);
}

export function multiply(a: DoubleDouble, b: DoubleDouble): DoubleDouble {
  const [high, low] = multiplyExactly(a[0], b[0]);
  return sumExactly(high, low + a[0] * b[1] + a[1] * b[0]);
}

export function divide(a: DoubleDouble, b: DoubleDouble): DoubleDouble {
  const first = a[0] / b[0];
  const rest = add(a, multiply(b, [-first, 0]));
  const second = rest[0] / b[0];
  const last = add(rest, multiply(b, [-second, 0]))[0] / b[0];
  return add(sumExactly(first, second), [last, 0]);
}

/** Return a number modulo an even period, in [0, period), as a double. */
export function remainder(a: DoubleDouble, period: number): number {
  const turns = Math.floor(a[0] / period);
  const rest = add(a, multiplyExactly(-turns, period));
  const value = rest[0] + rest[1];
  return value - period * Math.floor(value / period);
}

/** Return the number that a JSON number, or a text such as "0.7", "1e12" or "7/10", states. */
export function parse(value: number | string): DoubleDouble {
  if (typeof value === "number") return [value, 0];
  const fraction = fractionOf(value);
  if (!fraction) return [NaN, 0];
  // In units of 2⁻²⁰⁰, which is nothing beside the digits that any time or phase has.
  const scaled = (fraction[0] << 200n) / fraction[1];
  const high = Number(scaled);
  if (!Number.isFinite(high)) return [high, 0];
  return [high * 2 ** -200, Number(scaled - BigInt(high)) * 2 ** -200];
}
