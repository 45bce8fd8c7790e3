/** A page that is a file: the motion that it carries, played without a server. */
import { requireDocument } from "../evaluator/document.ts";
import type { ClosedFormDocument } from "../evaluator/document.ts";
import { SeriesMotion } from "../evaluator/series_motion.ts";
import type { Stretch } from "../evaluator/series_motion.ts";
import type { Differences } from "../views/engines_view.ts";
import type { Loaded, Torus } from "../views/view.ts";
import { inertiaOf, ofDocument, ofMotion } from "./loader.ts";
import type { Source } from "./loader.ts";
import type { Only } from "./state.ts";
import type { Problem } from "./systems.ts";

/** The version of what such a file carries (src/veselova/page.py writes it). */
const FORMAT = "veselova.motion/1";

/** What a file carries: the closed form with its torus, or one series over all its times. */
export interface Carried {
  format: string;
  title: string;
  story: string;
  problem: Problem;
  /** The time at which the page opens. */
  t: string;
  document: ClosedFormDocument | null;
  torus: Torus | null;
  series: Stretch | null;
  engines: Differences;
}

export class FileSource implements Source {
  readonly editable = false;
  readonly story: string;
  readonly title: string;
  readonly #carried: Carried;

  constructor(carried: Carried) {
    if (carried?.format !== FORMAT) {
      const given = String(carried?.format);
      throw new Error(`The motion must have the format ${FORMAT}; this file carries ${given}.`);
    }
    this.#carried = carried;
    this.story = carried.story;
    this.title = carried.title;
  }

  /** The state in which the page opens. */
  get state(): Only {
    const { problem, t } = this.#carried;
    return { problem, t };
  }

  load(): Promise<Loaded> {
    return Promise.resolve(this.#loaded());
  }

  #loaded(): Loaded {
    const { problem, document, torus, series } = this.#carried;
    if (document && torus) {
      requireDocument(document);
      return ofDocument(problem, document, torus);
    }
    if (!series) throw new Error("This file carries no motion.");
    const motion = new SeriesMotion(series, inertiaOf(problem), () => undefined);
    const range: [number, number] = [series.times[0], series.times[series.times.length - 1]];
    return { ...ofMotion(problem, motion, range[1] - range[0]), range };
  }

  loadEngines(): Promise<Differences> {
    return Promise.resolve(this.#carried.engines);
  }
}
