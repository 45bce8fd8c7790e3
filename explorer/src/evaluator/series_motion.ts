/**
 * A motion of which the service gives series: a system without theta functions, or n ≥ 5.
 *
 * Time is divided into stretches of equal length. A stretch that is missing is asked for, and the
 * nearest known time is shown until it comes.
 */
import type { DoubleDouble } from "./double_double.ts";
import { cross } from "./linear_algebra.ts";
import type { Motion, Sample } from "./motion.ts";
import { spheroconic } from "./spheroconic.ts";

/** The series of one stretch, as an answer of /v1/trajectories has them. */
export interface Stretch {
  times: number[];
  series: Record<string, number[] | number[][] | number[][][]>;
}

export const STRETCH_LENGTH = 20;
export const STRETCH_COUNT = 401;

/** Stretches that are kept. */
const MOST_STRETCHES = 24;

/** Milliseconds after which a stretch that did not come is asked for again. */
const AGAIN_MS = 2000;

/** Asks for a stretch: gives it, or why it never comes, or null where it may come later. */
type Ask = (index: number) => Promise<Stretch | string | null>;

export class SeriesMotion implements Motion {
  readonly n: number;
  readonly genus = 0;
  readonly body = null;
  readonly meanVelocity = null;
  readonly moments: number[];
  readonly #coordinates: ReturnType<typeof spheroconic>;
  /** How many stretches have come. */
  revision = 0;
  readonly #stretches = new Map<number, Stretch>();
  /** Why stretches never come, in a sentence; empty of those that are on their way. */
  readonly #asked = new Map<number, string>();
  readonly #ask: Ask;
  /** The times of a stretch: its first, less index·length, its length and its samples. */
  readonly #first: number;
  readonly #length: number;
  readonly #count: number;
  readonly #step: number;

  /** All stretches have as many samples as the first. `A` are the inertia data whose spheroconic coordinates are shown; empty where there are none. */
  constructor(first: Stretch, A: number[], ask: Ask) {
    this.#ask = ask;
    this.#count = first.times.length;
    this.#first = first.times[0];
    this.#length = first.times[this.#count - 1] - this.#first;
    this.#step = this.#length / (this.#count - 1);
    this.#coordinates = spheroconic(A.map((entry) => 1 / entry));
    this.moments = this.#coordinates.moments;
    this.#stretches.set(0, first);
    this.n = rowOf(first, 0).q.length;
  }

  /** Return the known stretches, the nearest to one first. */
  #byDistance(index: number): number[] {
    return [...this.#stretches.keys()].sort((a, b) => Math.abs(a - index) - Math.abs(b - index));
  }

  /** Return what is said of a time whose series have not come; empty where they have. */
  lack(t: number): string {
    return this.#stretches.has(this.#indexOf(t)) ? "" : "The series of this time are on their way.";
  }

  /** Return why the series of a time do not come, and the nearest time that is known. */
  endBefore(t: number): { reason: string; time: number } | null {
    const index = this.#indexOf(t);
    const reason = this.#asked.get(index);
    if (!reason) return null;
    const nearest = this.#byDistance(index)[0];
    // Of the stretch itself, whose end is the beginning of the next one.
    const place = nearest < index ? this.#count - 2 : 0;
    return { reason, time: Number((this.#first + nearest * this.#length + place * this.#step).toPrecision(12)) };
  }

  /** Have the stretch that begins index lengths after the first, unless it was asked for. */
  async #want(index: number): Promise<void> {
    if (this.#asked.has(index)) return;
    this.#asked.set(index, "");
    const answer = await this.#ask(index);
    if (typeof answer === "string") {
      this.#asked.set(index, answer);
      return;
    }
    setTimeout(() => this.#asked.delete(index), AGAIN_MS);
    if (!answer) return;
    this.#stretches.set(index, answer);
    this.revision++;
    const known = this.#byDistance(index);
    if (known.length > MOST_STRETCHES) this.#stretches.delete(known[known.length - 1]);
  }

  #indexOf(t: number): number {
    return Math.floor((t - this.#first) / this.#length);
  }

  at(time: DoubleDouble | number): Sample {
    const t = typeof time === "number" ? time : time[0];
    let index = this.#indexOf(t);
    let place = (t - this.#first - index * this.#length) / this.#step;
    if (!this.#stretches.has(index)) {
      void this.#want(index);
      const nearest = this.#byDistance(index)[0];
      place = nearest < index ? this.#count - 1 : 0;
      index = nearest;
    } else if (place > 0.6 * this.#count && !this.#stretches.has(index + 1)) {
      void this.#want(index + 1);
    }
    return this.#sample(this.#stretches.get(index)!, place, t);
  }

  /** Return the sample at a place of a stretch, by cubic interpolation. */
  #sample(stretch: Stretch, place: number, t: number): Sample {
    const base = Math.min(Math.max(Math.floor(place) - 1, 0), this.#count - 4);
    const weights = lagrange(place - base);
    const slopes = lagrange(place - base + 1e-4).map((w, i) => (w - weights[i]) / (1e-4 * this.#step));
    const rows = [0, 1, 2, 3].map((k) => rowOf(stretch, base + k));
    const mix = (name: keyof Row, w: number[]) =>
      // By differences from the first row, which are zero of a body at rest.
      Float64Array.from(rows[0][name], (from, i) =>
        w.reduce((sum, weight, k) => sum + weight * (rows[k][name][i] - from), w === weights ? from : 0),
      );
    const q = mix("q", weights);
    const velocity = mix("q", slopes);
    const Omega = mix("Omega", weights);
    const frame = mix("frame", weights);
    return {
      t,
      frame,
      q,
      velocity,
      prime: new Float64Array(0),
      Omega: Omega.length || this.n !== 3 ? Omega : turning(frame, mix("frame", slopes), q, velocity),
      z: new Float64Array(0),
      ...this.#coordinates.of(q, velocity),
      position: mix("position", weights),
    };
  }
}

/** Return Ω in the body from Ė = −Ω×E; without a frame that of ω = q∧q̇. */
function turning(E: Float64Array, rate: Float64Array, q: Float64Array, velocity: Float64Array) {
  if (!E.length) return cross(velocity, q);
  return Float64Array.from([0, 1, 2], (i) => {
    const [j, k] = [3 * ((i + 1) % 3), 3 * ((i + 2) % 3)];
    return [0, 1, 2].reduce((sum, e) => sum + (rate[j + e] * E[k + e] - rate[k + e] * E[j + e]) / 2, 0);
  });
}

interface Row {
  frame: number[];
  q: number[];
  position: number[];
  Omega: number[];
}

/** Return the vectors of one time; e_1 is q where the system has a frame and no other γ. */
function rowOf({ series }: Stretch, k: number): Row {
  const row = (name: string): number[] => [series[name]?.[k] ?? []].flat(2) as number[];
  const frame = row("frame");
  const n = Math.round(Math.sqrt(frame.length));
  const first = frame.filter((_, i) => i % n === 0);
  // The first column of a matrix X.
  const X = [series.X?.[k] ?? []].flat().map((entry) => [entry].flat()[0]) as number[];
  const q = [row("gamma"), first, row("q"), X].find((values) => values.length) ?? [];
  return { frame, q, position: row("position"), Omega: row("Omega") };
}

/** Return the weights of the cubic through places 0 … 3 at x. */
function lagrange(x: number): number[] {
  return [0, 1, 2, 3].map((i) =>
    [0, 1, 2, 3].reduce((value, j) => (j === i ? value : (value * (x - j)) / (i - j)), 1),
  );
}
