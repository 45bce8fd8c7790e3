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

export function timeMap(document: ClosedFormDocument) {
  const { mean_rate: mean, frequencies: f, phases: z0, coefficients, area } = document;
  const modes = document.modes.map((order) => order.map((entry) => 2 * entry));
  const even = { modes, coefficients, turn: 0 };
  const series = new OrbitSeries([even, ...(area ? [area.odd] : [])], f, z0, mean);
  const moved = (z: number[], delta: number) => z.map((entry, s) => entry + f[s] * delta);
  /** Return the root δ of the increasing function above: Newton's steps, held in a bracket. */
  const solve = (z: number[], tau0: DoubleDouble): number => {
    let [low, high, delta] = [-Infinity, Infinity, 0];
    for (let step = 0; step < 80; step++) {
      const [integral, slope] = series.at(moved(z, delta), dd.add(tau0, [delta, 0]));
      const value = mean * delta + integral;
      if (value > 0) high = Math.min(high, delta);
      else low = Math.max(low, delta);
      let next = delta - value / (mean + slope);
      if (!(next > low && next < high) && Number.isFinite(low + high)) next = (low + high) / 2;
      if (!Number.isFinite(next)) next = delta - value / mean;
      // 2^−50: rounding of t itself moves δ by more.
      if (Math.abs(next - delta) <= 2 ** -50 * (1 + Math.abs(delta))) return next;
      delta = next;
    }
    return delta;
  };
  return {
    /** The mean of dt/dτ₁ over all times, with that of modes that stand still. */
    meanRate: mean + series.mean,

    /** Return τ₁ at a time, and z modulo 2, of which every entry of the frame is a function. */
    phases(t: DoubleDouble): { tau: DoubleDouble; z: Float64Array } {
      const tau0 = dd.divide(t, [mean, 0]);
      const z = f.map((one, s) => dd.remainder(dd.add([z0[s], 0], dd.multiply([one, 0], tau0)), 2));
      const delta = solve(z, tau0);
      return { tau: dd.add(tau0, [delta, 0]), z: Float64Array.from(moved(z, delta)) };
    },
  };
}
