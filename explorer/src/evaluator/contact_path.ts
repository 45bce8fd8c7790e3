/**
 * The contact point of a rolling ball: x(t) = x(0) − a ℜᵀ (y_2, …, y_g, speed·t) with
 * y_k = Σ 2c/(π M·f) [sin 2π(M·z/2 + turn) − sin 2π(M·z⁰/2 + turn)]  (docs/balls.md).
 *
 * With an area constant `plane` stands in the place of ℜ, and to y_γ = speed·t comes `odd` times the
 * integral of the odd part of dt/dτ₁, which is a series like the others.
 *
 * Where M·f is next to nothing the ball drifts across its strip; that mode is written as
 * 2c cos(2π(M·z⁰/2 + turn) + h) sin(h)·2/(π M·f), h = π M·f τ₁/2.
 */
import { matrix, vector } from "./document.ts";
import type { ClosedFormDocument, PathSeries } from "./document.ts";
import type { DoubleDouble } from "./double_double.ts";
import { dot } from "./linear_algebra.ts";

/** Modes with |M·f| below this part of the largest frequency count as resonant. */
const RESONANCE = 1e-9;

/** Modes with |M·f| below so many roundings of Σ|M_s f_s| stand still: the ball drifts by them. */
const STANDING = 64 * Number.EPSILON;

interface Series {
  modes: number[][];
  amplitudes: number[];
  turn: number;
  resonant: { coefficient: number; frequency: number; angle: number }[];
}

export class ContactPath {
  readonly #radius: number;
  readonly #start: number[];
  readonly #speed: number;
  readonly #plane: number[][];
  /** The factor of the last series in y_γ; 0 without an area constant. */
  readonly #odd: number;
  readonly #series: Series[];
  readonly #offsets: number[];
  /** The mean velocity of the contact point over all times. */
  readonly meanVelocity: number[];

  constructor(document: ClosedFormDocument) {
    const path = document.path;
    if (!path) throw new Error("The document has no contact path.");
    const f = vector(document.frequencies);
    this.#radius = path.radius;
    this.#start = vector(path.position);
    this.#speed = path.speed;
    this.#plane = matrix(path.plane ?? document.rotation);
    this.#odd = path.odd ?? 0;
    const z0 = vector(document.phases);
    const least = RESONANCE * Math.max(...f.map(Math.abs));
    const odd = document.area?.odd ?? { modes: [], coefficients: [], turn: 0 };
    this.#series = [...path.transverse, odd].map(({ modes, coefficients, turn }: PathSeries) => {
      const series: Series = { modes: [], amplitudes: [], turn, resonant: [] };
      modes.forEach((m, k) => {
        const frequency = dot(m, f);
        const coefficient = 2 * coefficients[k];
        if (Math.abs(frequency) < least) {
          const angle = 2 * Math.PI * (dot(m, z0) / 2 + turn);
          series.resonant.push({ coefficient, frequency, angle });
        } else {
          series.modes.push(m);
          series.amplitudes.push(coefficient / (Math.PI * frequency));
        }
      });
      return series;
    });
    this.#offsets = this.#integrals(z0);
    const even: PathSeries = {
      modes: document.modes.map((m) => m.map((entry) => 2 * entry)),
      coefficients: document.coefficients,
      turn: 0,
    };
    const means = [even, ...path.transverse, odd].map((series) => meanOf(series, f, z0));
    this.meanVelocity = this.#mean(means, document.mean_rate);
  }

  /** Return the mean of dx/dt, from the means of even part, transverse series and odd part. */
  #mean([even, ...means]: number[], meanRate: number): number[] {
    const odd = means.pop() ?? 0;
    const rate = meanRate + even + odd;
    const rates = means.map((mean) => mean / rate);
    rates.push(this.#speed + (this.#odd * odd) / rate);
    return this.#start.map((_, j) =>
      rates.reduce((sum, rate, k) => sum - this.#radius * rate * this.#plane[k][j], 0),
    );
  }

  /** Return the contact point at phases z (modulo 2) and a time. */
  at(z: ArrayLike<number>, tau: number, time: DoubleDouble): number[] {
    const y = this.#integrals(z).map(
      (value, k) => value - this.#offsets[k] + drift(this.#series[k], tau),
    );
    const odd = y.pop() ?? 0;
    y.push(this.#odd * odd + this.#speed * time[0]);
    return this.#start.map((entry, j) => {
      const turned = y.reduce((sum, value, k) => sum + this.#plane[k][j] * value, 0);
      return entry - this.#radius * turned;
    });
  }

  #integrals(z: ArrayLike<number>): number[] {
    return this.#series.map(({ modes, amplitudes, turn }) =>
      modes.reduce((sum, m, k) => {
        const angle = 2 * Math.PI * (dot(m, z) / 2 + turn);
        return sum + amplitudes[k] * Math.sin(angle);
      }, 0),
    );
  }
}

/** Return the mean of a series along the orbit, over τ₁: that of the modes that stand still. */
function meanOf({ modes, coefficients, turn }: PathSeries, f: number[], z0: number[]): number {
  return modes.reduce((sum, m, k) => {
    const size = m.reduce((total, entry, s) => total + Math.abs(entry * f[s]), 0);
    if (Math.abs(dot(m, f)) > STANDING * size) return sum;
    return sum + 2 * coefficients[k] * Math.cos(2 * Math.PI * (dot(m, z0) / 2 + turn));
  }, 0);
}

/** Return what the resonant modes of a series add until τ₁. */
function drift({ resonant }: Series, tau: number): number {
  return resonant.reduce((sum, { coefficient, frequency, angle }) => {
    const h = (Math.PI * frequency * tau) / 2;
    const integral = Math.abs(h) < 1e-8 ? tau : Math.sin(h) / ((Math.PI * frequency) / 2);
    return sum + coefficient * Math.cos(angle + h) * integral;
  }, 0);
}
