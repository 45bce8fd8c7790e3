/**
 * The contact point of a rolling ball: x(t) = x(0) − a ℜᵀ (y_2, …, y_g, speed·t) with integrals y_k
 * of series along the orbit (docs/balls.md).
 *
 * With an area constant `plane` stands in the place of ℜ, and to y_γ = speed·t comes `odd` times the
 * integral of the odd part of dt/dτ₁, which is a series like the others.
 */
import type { ClosedFormDocument, PathFields } from "./document.ts";
import type { DoubleDouble } from "./double_double.ts";
import { dot, transpose } from "./linear_algebra.ts";
import { OrbitSeries } from "./orbit_series.ts";

/** Return the contact point of a ball; `meanRate` is the mean of dt/dτ₁. */
export function contactPath(document: ClosedFormDocument, path: PathFields, meanRate: number) {
  const { radius, speed, odd = 0, position, plane = document.rotation } = path;
  const { area, frequencies, phases } = document;
  const fastest = Math.max(...frequencies.map(Math.abs));
  const series = [...path.transverse, area?.odd ?? { modes: [], coefficients: [], turn: 0 }].map((one) => {
    const size = one.coefficients.reduce((sum, entry) => sum + Math.abs(entry), 0);
    return new OrbitSeries([one], frequencies, phases, size / fastest);
  });
  const columns = transpose(plane);
  /** Return −a ℜᵀy from the integrals and the time t. */
  const inPlane = (integrals: number[], time: number) => {
    const y = [...integrals.slice(0, -1), speed * time + odd * integrals[integrals.length - 1]];
    return position.map((_, j) => -radius * dot(y, columns[j]));
  };
  return {
    /** The mean velocity of the contact point over all times. */
    meanVelocity: inPlane(series.map(({ mean }) => mean / meanRate), 1),

    /** Return the contact point at phases z (modulo 2) and their times. */
    at(z: ArrayLike<number>, tau: DoubleDouble, time: DoubleDouble): number[] {
      const moved = inPlane(series.map((one) => one.at(z, tau)[0]), time[0]);
      return position.map((entry, j) => entry + moved[j]);
    },
  };
}
