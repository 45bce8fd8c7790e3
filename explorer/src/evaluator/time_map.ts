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
import { OrbitSeries } from "./orbit_series.ts";

export interface Phases {
  tau: DoubleDouble;
  /** z modulo 2, of which every entry of the frame is a function. */
  z: Float64Array;
}

export class TimeMap {
  readonly #mean: number;
  readonly #f: number[];
  readonly #z0: number[];
  readonly #series: OrbitSeries;

  constructor(document: ClosedFormDocument) {
    this.#mean = document.mean_rate;
    this.#f = document.frequencies;
    this.#z0 = document.phases;
    const modes = document.modes.map((order) => order.map((entry) => 2 * entry));
    const even = { modes, coefficients: document.coefficients, turn: 0 };
    const odd = document.area ? [document.area.odd] : [];
    this.#series = new OrbitSeries([even, ...odd], this.#f, this.#z0, this.#mean);
  }

  /** The mean of dt/dτ₁ over all times, with that of modes that stand still. */
  get meanRate(): number {
    return this.#mean + this.#series.mean;
  }

  /** Return τ₁ and the phases at a time. */
  phases(t: DoubleDouble): Phases {
    const tau0 = dd.divide(t, [this.#mean, 0]);
    const mean = this.#f.map((f, s) =>
      dd.remainder(dd.add([this.#z0[s], 0], dd.multiply([f, 0], tau0)), 2),
    );
    const delta = this.#solve(mean, tau0);
    return { tau: dd.add(tau0, [delta, 0]), z: Float64Array.from(this.#moved(mean, delta)) };
  }

  #moved(mean: number[], delta: number): number[] {
    return mean.map((entry, s) => entry + this.#f[s] * delta);
  }

  /** Return the root δ of the increasing function above: Newton's steps, held in a bracket. */
  #solve(mean: number[], tau0: DoubleDouble): number {
    let low = -Infinity;
    let high = Infinity;
    let delta = 0;
    for (let step = 0; step < 80; step++) {
      const [integral, slope] = this.#series.at(this.#moved(mean, delta), dd.add(tau0, [delta, 0]));
      const value = this.#mean * delta + integral;
      if (value > 0) high = Math.min(high, delta);
      else low = Math.max(low, delta);
      let next = delta - value / (this.#mean + slope);
      if (!(next > low && next < high) && Number.isFinite(low + high)) next = (low + high) / 2;
      if (!Number.isFinite(next)) next = delta - value / this.#mean;
      // 2^−50: rounding of t itself moves δ by more.
      if (Math.abs(next - delta) <= 2 ** -50 * (1 + Math.abs(delta))) return next;
      delta = next;
    }
    return delta;
  }
}
