/** Samples of many times: from the worker for a closed form, at once for series. */
import { ClosedFormMotion } from "../evaluator/motion.ts";
import type { Motion } from "../evaluator/motion.ts";
import { samplesOf } from "../evaluator/samples.ts";
import type { Samples } from "../evaluator/samples.ts";
import { startWorker } from "./worker_thread.ts";

export class Sampler {
  readonly #motion: Motion;
  #worker: Worker | null;
  readonly #waiting = new Map<number, { times: Float64Array; take: (samples: Samples) => void }>();
  #next = 0;

  constructor(motion: Motion) {
    this.#motion = motion;
    this.#worker = motion instanceof ClosedFormMotion ? startWorker() : null;
    if (this.#worker && motion instanceof ClosedFormMotion) {
      this.#worker.postMessage({ kind: "document", document: motion.document });
      this.#worker.onmessage = ({ data }) => {
        this.#waiting.get(data.id)?.take(data.samples);
        this.#waiting.delete(data.id);
      };
      // Where the thread does not start, the page computes by itself.
      this.#worker.onerror = () => {
        this.#worker = null;
        for (const { times, take } of this.#waiting.values()) take(samplesOf(motion, times));
        this.#waiting.clear();
      };
    }
  }

  samples(times: Float64Array): Promise<Samples> {
    const worker = this.#worker;
    if (!worker) return Promise.resolve(samplesOf(this.#motion, times));
    const id = this.#next++;
    worker.postMessage({ kind: "samples", id, times });
    return new Promise((take) => this.#waiting.set(id, { times, take }));
  }

  close(): void {
    this.#worker?.terminate();
    this.#waiting.clear();
  }
}
