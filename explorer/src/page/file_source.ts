/** A page that is a file: the motion that it carries, played without a server. */
import { type ClosedFormDocument, requireDocument } from "../evaluator/document.ts";
import { SeriesMotion, type Stretch } from "../evaluator/series_motion.ts";
import type { Differences } from "../views/engines_view.ts";
import type { Loaded, Torus } from "../views/view.ts";
import { type Grid, tableOf } from "./exports.ts";
import { inertiaOf, ofDocument, ofMotion, type Source } from "./loader.ts";
import { presetOf } from "./presets.ts";
import type { Only } from "./state.ts";
import type { Problem } from "./systems.ts";
import { Unreachable } from "./service.ts";

/** The version of what such a file carries (src/veselova/motion_page.py writes it). */
const FORMAT = "veselova.motion/1";

/** What a file carries: the closed form with its torus, or one series over all its times. */
export interface Carried extends Only {
  format: string;
  document: ClosedFormDocument | null;
  torus: Torus | null;
  series: Stretch | null;
  engines: Differences;
}

export class FileSource implements Source {
  readonly only: Carried;

  constructor(carried: Carried) {
    if (carried?.format !== FORMAT) {
      const given = String(carried?.format);
      throw new Error(`The motion must have the format ${FORMAT}; this file carries ${given}.`);
    }
    this.only = carried;
  }

  async load(): Promise<Loaded> {
    const { problem, document, torus, series } = this.only;
    if (document && torus) {
      requireDocument(document);
      return ofDocument(problem, document, torus);
    }
    if (!series) throw new Error("This file carries no motion.");
    const motion = new SeriesMotion(series, inertiaOf(problem), async () => null);
    const range: [number, number] = [series.times[0], series.times[series.times.length - 1]];
    return { ...ofMotion(problem, motion, range[1] - range[0]), range };
  }

  loadTable = async (loaded: Loaded, times: Grid): Promise<string> => tableOf(loaded, times);
  loadEngines = async (): Promise<Differences> => this.only.engines;
}

const NO_SERVER =
  "This site has no server, which motions other than those under “start” need; `veselova explore` has one.";

/** A site without a server, which has the files of the examples. */
export class SiteSource implements Source {
  readonly only = null;
  #file: FileSource | null = null;

  async load(problem: Problem, signal: AbortSignal): Promise<Loaded> {
    const preset = presetOf(problem);
    if (!preset) throw new Error(NO_SERVER);
    const answer = await fetch(`motions/${preset.name}.json`, { signal }).catch(() => null);
    if (!answer) throw new Unreachable("The site does not answer.");
    if (!answer.ok) throw new Error(`The site has no file motions/${preset.name}.json.`);
    this.#file = new FileSource(await answer.json());
    return { ...(await this.#file.load()), problem };
  }

  loadEngines = (): Promise<Differences> => this.#file!.loadEngines();
  loadTable = (loaded: Loaded, times: Grid): Promise<string> => this.#file!.loadTable(loaded, times);
}
