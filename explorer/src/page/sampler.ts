/** Samples of many times: from the worker for a closed form, at once for series. */
import { ClosedFormMotion } from "../evaluator/motion.ts";
import type { Motion } from "../evaluator/motion.ts";
import { samplesOf } from "../evaluator/samples.ts";
import type { Samples } from "../evaluator/samples.ts";

export class Sampler {
  readonly #motion: Motion;
  readonly #worker: Worker | null;
  readonly #waiting = new Map<number, (samples: Samples) => void>();
  #next = 0;

  constructor(motion: Motion) {
    this.#motion = motion;
    this.#worker = motion instanceof ClosedFormMotion ? startWorker() : null;
    if (this.#worker && motion instanceof ClosedFormMotion) {
      this.#worker.postMessage({ kind: "document", document: motion.document });
      this.#worker.onmessage = ({ data }) => {
        this.#waiting.get(data.id)?.(data.samples);
        this.#waiting.delete(data.id);
      };
    }
  }

  samples(times: Float64Array): Promise<Samples> {
    const worker = this.#worker;
    if (!worker) return Promise.resolve(samplesOf(this.#motion, times));
    const id = this.#next++;
    worker.postMessage({ kind: "samples", id, times });
    return new Promise((resolve) => this.#waiting.set(id, resolve));
  }

  close(): void {
    this.#worker?.terminate();
    this.#waiting.clear();
  }
}

/** Return the worker, null where a page may have none (one read from a file, for instance). */
function startWorker(): Worker | null {
  try {
    return new Worker(new URL("../worker.ts", import.meta.url), { type: "module" });
  } catch {
    return null;
  }
}
