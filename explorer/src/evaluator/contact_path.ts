/**
 * The contact point of a rolling ball: x(t) = x(0) − a ℜᵀ (y_2, …, y_g, speed·t) with integrals y_k
 * of series along the orbit (docs/balls.md).
 *
 * With an area constant `plane` stands in the place of ℜ, and to y_γ = speed·t comes `odd` times the
 * integral of the odd part of dt/dτ₁, which is a series like the others.
 */
import type { ClosedFormDocument, PathFields } from "./document.ts";
import type { DoubleDouble } from "./double_double.ts";
import { dot } from "./linear_algebra.ts";
import { OrbitSeries } from "./orbit_series.ts";

export class ContactPath {
  readonly #path: PathFields;
  readonly #plane: number[][];
  readonly #series: OrbitSeries[];
  /** The mean velocity of the contact point over all times. */
  readonly meanVelocity: number[];

  /** `meanRate` is the mean of dt/dτ₁. */
  constructor(document: ClosedFormDocument, path: PathFields, meanRate: number) {
    const { area, frequencies, phases } = document;
    this.#path = path;
    this.#plane = path.plane ?? document.rotation;
    const fastest = Math.max(...frequencies.map(Math.abs));
    const odd = area?.odd ?? { modes: [], coefficients: [], turn: 0 };
    this.#series = [...path.transverse, odd].map((one) => {
      const size = one.coefficients.reduce((sum, entry) => sum + Math.abs(entry), 0);
      return new OrbitSeries([one], frequencies, phases, size / fastest);
    });
    const means = this.#series.map(({ mean }) => mean / meanRate);
    this.meanVelocity = this.#inPlane(means, 1);
  }

  /** Return −a ℜᵀy from the integrals and the time t. */
  #inPlane(integrals: number[], time: number): number[] {
    const { radius, speed, odd = 0, position } = this.#path;
    const y = [...integrals.slice(0, -1), speed * time + odd * integrals[integrals.length - 1]];
    return position.map((_, j) => -radius * dot(y, this.#plane.map((row) => row[j])));
  }

  /** Return the contact point at phases z (modulo 2) and their times. */
  at(z: ArrayLike<number>, tau: DoubleDouble, time: DoubleDouble): number[] {
    const moved = this.#inPlane(this.#series.map((one) => one.at(z, tau)[0]), time[0]);
    return this.#path.position.map((entry, j) => entry + moved[j]);
  }
}
