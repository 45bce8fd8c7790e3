/**
 * The map t ↦ τ₁ of a document, and the phases of any time.
 *
 * t(τ₁) = F₀τ₁ + P(z⁰ + fτ₁) − P(z⁰) with P(z) = Σ F_m/(π m·f) sin 2πm·z. With τ₁ = t/F₀ + δ the
 * mean phases z⁰ + f t/F₀ are reduced in two doubles, and δ, which is bounded, solves
 * F₀δ + P(z̄ + fδ) = P(z⁰) by Newton's method in doubles. With an area constant the rate has an odd
 * part too, whose modes are M/2 with a constant turn: all modes are doubled here, M = 2m.
 */
import * as dd from "./double_double.ts";
import type { DoubleDouble } from "./double_double.ts";
import type { ClosedFormDocument } from "./document.ts";
import { powersOfWaves } from "./theta.ts";

/** Modes below this part of F₀ change no double. */
const SMALLEST_COEFFICIENT = 1e-17;

/** Modes with a larger quotient F_m/(π m·f F₀) are nearly resonant: P itself would lose digits. */
const LARGEST_AMPLITUDE = 3;

interface ResonantMode {
  coefficient: number;
  frequency: DoubleDouble; // M·f/2
  turn: number; // its angle at z⁰
}

export interface Phases {
  tau: number;
  /** z modulo 2, of which every entry of the frame is a function. */
  z: Float64Array;
}

export class TimeMap {
  readonly #mean: DoubleDouble;
  readonly #f: DoubleDouble[];
  readonly #z0: DoubleDouble[];
  readonly #start: number[];
  readonly #speed: number[];
  readonly #orders: Int32Array;
  readonly #coefficients: Float64Array;
  readonly #amplitudes: Float64Array;
  /** cos and sin of the constant turn of each mode. */
  readonly #turns: [Float64Array, Float64Array];
  readonly #resonant: ResonantMode[] = [];
  readonly #most: number;
  readonly #real: Float64Array[];
  readonly #imaginary: Float64Array[];
  readonly #offset: number;

  constructor(document: ClosedFormDocument) {
    this.#mean = dd.parse(document.mean_rate);
    this.#f = document.frequencies.map(dd.parse);
    this.#z0 = document.phases.map(dd.parse);
    this.#start = this.#z0.map(([high]) => high);
    this.#speed = this.#f.map(([high]) => high);
    const orders: number[] = [];
    const coefficients: number[] = [];
    const amplitudes: number[] = [];
    const turns: number[] = [];
    const add = (order: number[], coefficient: number, turn: number) => {
      if (Math.abs(coefficient) < SMALLEST_COEFFICIENT * this.#mean[0]) return;
      const frequency = order.reduce(
        (sum, entry, s) => dd.add(sum, dd.multiply(this.#f[s], [entry / 2, 0])),
        [0, 0] as DoubleDouble,
      );
      const amplitude = coefficient / (Math.PI * frequency[0]);
      if (!(Math.abs(amplitude) < LARGEST_AMPLITUDE * this.#mean[0])) {
        const cycles = order.reduce((sum, entry, s) => sum + (entry / 2) * this.#start[s], turn);
        this.#resonant.push({ coefficient, frequency, turn: 2 * Math.PI * cycles });
        return;
      }
      orders.push(...order);
      coefficients.push(coefficient);
      amplitudes.push(amplitude);
      turns.push(2 * Math.PI * turn);
    };
    document.modes.forEach((order, k) => {
      add(order.map((entry) => 2 * entry), document.coefficients[k], 0);
    });
    const odd = document.area?.odd;
    odd?.modes.forEach((order, k) => add(order, odd.coefficients[k], odd.turn));
    this.#turns = [Float64Array.from(turns, Math.cos), Float64Array.from(turns, Math.sin)];
    this.#orders = Int32Array.from(orders);
    this.#coefficients = Float64Array.from(coefficients);
    this.#amplitudes = Float64Array.from(amplitudes);
    this.#most = orders.reduce((most, entry) => Math.max(most, Math.abs(entry)), 1);
    this.#real = this.#f.map(() => new Float64Array(2 * this.#most + 1));
    this.#imaginary = this.#f.map(() => new Float64Array(2 * this.#most + 1));
    this.#offset = this.#periodicPart(this.#start)[0];
  }

  /** Return τ₁ and the phases at a time. */
  phases(t: DoubleDouble): Phases {
    const tau0 = dd.divide(t, this.#mean);
    const mean = this.#f.map((f, s) =>
      dd.remainder(dd.add(this.#z0[s], dd.multiply(f, tau0)), 2),
    );
    const delta = this.#solve(mean, tau0);
    const z = Float64Array.from(mean, (entry, s) => entry + this.#speed[s] * delta);
    return { tau: tau0[0] + delta, z };
  }

  /** Return the root δ of the increasing function above: Newton's steps, held in a bracket. */
  #solve(mean: number[], tau0: DoubleDouble): number {
    let low = -Infinity;
    let high = Infinity;
    let delta = 0;
    for (let step = 0; step < 80; step++) {
      const z = mean.map((entry, s) => entry + this.#speed[s] * delta);
      const [periodic, slope] = this.#periodicPart(z);
      const [resonant, further] = this.#resonantPart(tau0, delta);
      const value = this.#mean[0] * delta + periodic - this.#offset + resonant;
      if (value > 0) high = Math.min(high, delta);
      else low = Math.max(low, delta);
      let next = delta - value / (this.#mean[0] + slope + further);
      if (!(next > low && next < high) && Number.isFinite(low + high)) next = (low + high) / 2;
      if (!Number.isFinite(next)) next = delta - value / this.#mean[0];
      // 2^−50: rounding of t itself moves δ by more.
      if (Math.abs(next - delta) <= 2 ** -50 * (1 + Math.abs(delta))) return next;
      delta = next;
    }
    return delta;
  }

  /** Return P(z) and its slope Σ 2F cos 2π(M·z/2 + turn). */
  #periodicPart(z: ArrayLike<number>): [number, number] {
    const g = this.#speed.length;
    const most = this.#most;
    const [cosines, sines] = this.#turns;
    powersOfWaves(z, most, Math.PI, this.#real, this.#imaginary);
    let value = 0;
    let slope = 0;
    for (let k = 0; k < this.#coefficients.length; k++) {
      let x = cosines[k];
      let y = sines[k];
      for (let s = 0; s < g; s++) {
        const c = this.#real[s][most + this.#orders[k * g + s]];
        const i = this.#imaginary[s][most + this.#orders[k * g + s]];
        const turned = x * c - y * i;
        y = x * i + y * c;
        x = turned;
      }
      value += this.#amplitudes[k] * y;
      slope += 2 * this.#coefficients[k] * x;
    }
    return [value, slope];
  }

  /** Return what nearly resonant modes add: 2F cos(turn + h) sin(h)/(π m·f), h = π m·f τ₁. */
  #resonantPart(tau0: DoubleDouble, delta: number): [number, number] {
    let value = 0;
    let slope = 0;
    for (const { coefficient, frequency, turn } of this.#resonant) {
      const tau = dd.add(tau0, [delta, 0]);
      const cycles = dd.multiply(frequency, tau);
      const h = Math.PI * (Math.abs(cycles[0]) < 1 ? cycles[0] : dd.remainder(cycles, 2));
      const integral =
        Math.abs(cycles[0]) < 1e-9 ? tau[0] : Math.sin(h) / (Math.PI * frequency[0]);
      value += 2 * coefficient * Math.cos(turn + h) * integral;
      slope += 2 * coefficient * Math.cos(turn + 2 * h);
    }
    return [value, slope];
  }
}
