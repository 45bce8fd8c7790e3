/**
 * The trail behind the present: samples at multiples of one step, of which only new ones are
 * computed, in a thread where there is a closed form. A jump of time makes it anew, and so do
 * series that come late.
 */
import type { Motion } from "../evaluator/motion.ts";
import { type Samples, samplesOf } from "../evaluator/samples.ts";
import type { Loaded } from "../views/view.ts";
import type { Question } from "../worker.ts";
import EvaluatorWorker from "../worker.ts?worker";

/** Points of a trail: of series; of a torus; of one with three phases, which take five times as long. */
const [OF_SERIES, POINTS, FEWER_POINTS] = [1200, 10000, 5000];

/** What has been asked for: times up to so many steps. */
interface Request {
  times: Float64Array;
  now: number;
  anew: boolean;
}

export class Trail {
  readonly #motion: Motion;
  readonly #step: number;
  readonly #points: number;
  readonly #take: (samples: Samples, anew: boolean) => void;
  #worker: Worker | null = null;
  #waiting: Request | null = null;
  #last: number | null = null;
  #seen = 0;

  constructor({ motion, document, reach }: Loaded, take: (samples: Samples, anew: boolean) => void) {
    this.#motion = motion;
    const { genus } = motion;
    this.#points = genus >= 3 ? FEWER_POINTS : genus === 0 ? OF_SERIES : POINTS;
    this.#step = reach / this.#points;
    this.#take = take;
    if (!document) return;
    const worker = startWorker();
    if (!worker) return;
    this.#worker = worker;
    this.#ask(document);
    worker.onmessage = ({ data }: MessageEvent<Samples>) => this.#accept(data);
    // Where the thread does not start, the page computes by itself.
    worker.onerror = () => {
      this.#worker = null;
      if (this.#waiting) this.#accept(samplesOf(motion, this.#waiting.times));
    };
  }

  #ask(question: Question): void {
    this.#worker?.postMessage(question);
  }

  /** Bring the trail up to a time. */
  follow(t: number): void {
    if (this.#waiting) return;
    const now = Math.floor(t / this.#step);
    const before = this.#last;
    // Series that have come in the meantime were not in the trail.
    const come = this.#motion.revision !== this.#seen;
    const anew = before === null || come || now < before || now - before > this.#points;
    if (!anew && now === before) return;
    // Series of the service begin at 0: nothing before it is asked for unseen.
    const earliest = this.#motion.genus === 0 && now >= 0 ? 0 : -Infinity;
    const first = anew ? Math.max(earliest, now - this.#points + 1) : before + 1;
    const times = Float64Array.from({ length: now - first + 1 }, (_, k) => (first + k) * this.#step);
    this.#seen = this.#motion.revision;
    this.#waiting = { times, now, anew };
    if (this.#worker) this.#ask(times);
    else this.#accept(samplesOf(this.#motion, times));
  }

  #accept(samples: Samples): void {
    if (!this.#waiting) return;
    const { now, anew } = this.#waiting;
    this.#waiting = null;
    this.#last = now;
    this.#take(samples, anew);
  }

  close(): void {
    this.#worker?.terminate();
    this.#waiting = null;
  }
}

/** Return the thread of the evaluator, null where a page may have none. */
function startWorker(): Worker | null {
  try {
    return new EvaluatorWorker();
  } catch {
    return null;
  }
}
