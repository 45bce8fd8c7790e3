/**
 * The trail behind the present: samples at multiples of one step, of which only new ones are
 * computed. A jump of time makes it anew, and so do series that come late.
 */
import type { Samples } from "../evaluator/samples.ts";
import type { Sampler } from "./sampler.ts";

/** Points of a trail. */
const POINTS = 10000;

/** The same in four dimensions, where a point takes five times as long. */
const FEWER_POINTS = 5000;

export class Trail {
  readonly #sampler: Sampler;
  readonly #step: number;
  readonly #points: number;
  readonly #series: boolean;
  readonly #take: (samples: Samples, anew: boolean) => void;
  readonly #revision: () => number;
  #last: number | null = null;
  #seen = 0;
  #waiting = false;
  #closed = false;

  constructor(
    sampler: Sampler,
    reach: number,
    genus: number,
    take: (samples: Samples, anew: boolean) => void,
    revision = () => 0,
  ) {
    this.#revision = revision;
    this.#sampler = sampler;
    this.#points = genus >= 3 ? FEWER_POINTS : genus === 0 ? 1200 : POINTS;
    this.#series = genus === 0;
    this.#step = reach / this.#points;
    this.#take = take;
  }

  /** Bring the trail up to a time. */
  async follow(t: number): Promise<void> {
    if (this.#waiting || this.#closed) return;
    const now = Math.floor(t / this.#step);
    const before = this.#last;
    // Series that have come in the meantime were not in the trail.
    const revision = this.#revision();
    const come = revision !== this.#seen;
    const anew = before === null || come || now < before || now - before > this.#points;
    if (!anew && now === before) return;
    // Series of the service begin at 0: nothing before it is asked for unseen.
    const earliest = this.#series && now >= 0 ? 0 : -Infinity;
    const first = anew ? Math.max(earliest, now - this.#points + 1) : before + 1;
    const times = Float64Array.from({ length: now - first + 1 }, (_, k) => (first + k) * this.#step);
    this.#waiting = true;
    this.#seen = revision;
    try {
      const samples = await this.#sampler.samples(times);
      if (this.#closed) return;
      this.#last = now;
      this.#take(samples, anew);
    } finally {
      this.#waiting = false;
    }
  }

  close(): void {
    this.#closed = true;
  }
}
