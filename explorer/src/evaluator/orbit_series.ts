/**
 * A series along the orbit z = z⁰ + fτ₁, Σ 2c cos 2π(M·z/2 + turn), and its integral from τ₁ = 0:
 * P(z) − P(z⁰) with P(z) = Σ 2c/(π M·f) sin 2π(M·z/2 + turn).
 *
 * Where M·f is next to nothing P would lose digits: such a mode is written as
 * 2c cos(2π(M·z⁰/2 + turn) + h) sin(h)·2/(π M·f), h = π M·f τ₁/2.
 */
import * as dd from "./double_double.ts";
import type { DoubleDouble } from "./double_double.ts";
import type { PathSeries } from "./document.ts";
import { dot } from "./linear_algebra.ts";
import { type Terms, Waves } from "./waves.ts";

/** Modes with a quotient 2c/(π M·f) above so many scales are nearly resonant. */
const LARGEST_AMPLITUDE = 3;

/** Coefficients below this part of the scale change no double. */
const SMALLEST_COEFFICIENT = 1e-17;

/** Modes with |M·f| below so many roundings of Σ|M_s f_s| stand still, and have a mean. */
const STANDING = 64 * Number.EPSILON;

interface Mode {
  order: number[]; // M
  coefficient: number; // c
  amplitude: number; // 2c/(π M·f)
  turned: number; // 2π·turn
}

interface ResonantMode {
  coefficient: number;
  frequency: DoubleDouble; // M·f/2
  angle: number; // at z⁰
}

export class OrbitSeries {
  /** The mean over all times. */
  readonly mean: number;
  /** P and the series, both without what is nearly resonant. */
  readonly #terms: Terms;
  readonly #resonant: ResonantMode[] = [];
  readonly #waves: Waves;
  /** P(z⁰). */
  #offset = 0;

  /** The sum of some series at frequencies f and phases z⁰; `scale` is that of the integral. */
  constructor(parts: PathSeries[], f: number[], z0: number[], scale: number) {
    const kept: Mode[] = [];
    let mean = 0;
    for (const { modes, coefficients, turn } of parts) {
      modes.forEach((order, k) => {
        const coefficient = coefficients[k];
        if (Math.abs(coefficient) < SMALLEST_COEFFICIENT * scale) return;
        const terms = order.map((entry, s) => dd.multiply([f[s], 0], [entry / 2, 0]));
        const frequency = terms.reduce(dd.add, [0, 0]);
        const angle = 2 * Math.PI * (dot(order, z0) / 2 + turn);
        const size = terms.reduce((sum, [high]) => sum + Math.abs(high), 0);
        if (Math.abs(frequency[0]) <= STANDING * size) mean += 2 * coefficient * Math.cos(angle);
        const amplitude = coefficient / (Math.PI * frequency[0]);
        if (Math.abs(amplitude) < LARGEST_AMPLITUDE * scale) {
          kept.push({ order, coefficient, amplitude, turned: 2 * Math.PI * turn });
        } else {
          this.#resonant.push({ coefficient, frequency, angle });
        }
      });
    }
    this.mean = mean;
    const column = (f: (mode: Mode) => number) => Float64Array.from(kept, f);
    const orders = kept.flatMap(({ order }) => order);
    this.#terms = {
      orders: Int32Array.from(orders),
      cosines: [
        column(({ amplitude, turned }) => amplitude * Math.sin(turned)),
        column(({ coefficient, turned }) => 2 * coefficient * Math.cos(turned)),
      ],
      sines: [
        column(({ amplitude, turned }) => amplitude * Math.cos(turned)),
        column(({ coefficient, turned }) => -2 * coefficient * Math.sin(turned)),
      ],
      places: [0, 1],
    };
    this.#waves = new Waves(f.length, orders.reduce((most, M) => Math.max(most, Math.abs(M)), 1));
    this.#offset = this.at(z0, [0, 0])[0];
  }

  /** Return the integral and the series at phases z (modulo 2) and their time τ₁. */
  at(z: ArrayLike<number>, tau: DoubleDouble): [number, number] {
    const sums = new Float64Array(2);
    this.#waves.take(z);
    this.#waves.add(this.#terms, 1, sums);
    let [integral, value] = sums;
    for (const { coefficient, frequency, angle } of this.#resonant) {
      const cycles = dd.multiply(frequency, tau);
      const h = Math.PI * (Math.abs(cycles[0]) < 1 ? cycles[0] : dd.remainder(cycles, 2));
      const time = Math.abs(cycles[0]) < 1e-9 ? tau[0] : Math.sin(h) / (Math.PI * frequency[0]);
      integral += 2 * coefficient * Math.cos(angle + h) * time;
      value += 2 * coefficient * Math.cos(angle + 2 * h);
    }
    return [integral - this.#offset, value];
  }
}
