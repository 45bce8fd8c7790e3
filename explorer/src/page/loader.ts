/** From a problem to what the views show: a closed form, or series of the service. */
import { type ClosedFormDocument, requireDocument } from "../evaluator/document.ts";
import { motionOf } from "../evaluator/motion.ts";
import { SeriesMotion, type Stretch, STRETCH_COUNT, STRETCH_LENGTH } from "../evaluator/series_motion.ts";
import type { Differences, EngineSeries } from "../views/engines_view.ts";
import { type Loaded, overSphere, type Torus } from "../views/view.ts";
import type { Grid } from "./exports.ts";
import { post, Refusal } from "./service.ts";
import type { Only } from "./state.ts";
import { entriesOf, numberOf, type Problem, SYSTEMS } from "./systems.ts";

/** Cycles of the slowest phase that trails reach back. */
const CYCLES = 26;

/** The time beyond which the phases of a document lose digits that a picture shows. */
export const FAR = 1e6;

/** The answers of a server that has too much to do, and when it is asked again, how often. */
export const BUSY = [503, 504];
const AGAIN_MS = 2000;
const MOST_TRIES = 4;

const LETTERS: Record<string, string> = { t: "t", s: "s", tau1: "τ₁" };

/** Where the motions of a page come from. */
export interface Source {
  /** The one motion that it has; null where it gives those of other problems too. */
  readonly only: Only | null;
  /** Return what the views show of a problem; throws Refusal, Unreachable or Error. */
  load(problem: Problem, signal: AbortSignal): Promise<Loaded>;
  /** Return series of the engines, for the plot of differences. */
  loadEngines(loaded: Loaded, signal: AbortSignal): Promise<Differences>;
  /** Return a table of the motion at some times, as CSV. */
  loadTable(loaded: Loaded, times: Grid): Promise<string>;
}

/** The service that served the page. */
export const SERVICE: Source = { only: null, load, loadEngines, loadTable };

async function load(problem: Problem, signal: AbortSignal): Promise<Loaded> {
  const system = SYSTEMS[problem.system];
  let cause = "no closed form of this system is known.";
  if (!system?.integrated) {
    const found =
      dimensionOf(problem) <= 4
        ? await loadDocument(problem, signal)
        : "the page has theta functions of at most three phases.";
    if (typeof found !== "string") return found;
    cause = found;
  }
  return { ...(await ofSeries(problem, signal)), cause };
}

/** Return the closed form, or in a sentence why the service has series of the motion alone. */
async function loadDocument(problem: Problem, signal: AbortSignal): Promise<Loaded | string> {
  try {
    // The torus first: it is quick, and says whether there is a closed form.
    const torus = await post<Torus>("v1/tori", { problem }, signal);
    if (torus.regime === "separatrix") return "the motion is on a separatrix.";
    const document = await post<ClosedFormDocument>("v1/closed-forms", { problem }, signal);
    requireDocument(document);
    return ofDocument(problem, document, torus);
  } catch (error) {
    if (servedBySeries(error)) return `${reasonOf(error)}.`;
    throw error;
  }
}

/** Return why something is refused, without the outcome and the full stop. */
const reasonOf = ({ message }: Refusal): string => message.replace(/^[a-z-]+: /, "").replace(/\.$/, "");

/** Return whether a refusal of the closed form leaves the motion itself to be asked for. */
function servedBySeries(reason: unknown): reason is Refusal {
  if (!(reason instanceof Refusal)) return false;
  return reason.outcome !== "" || /required a system with a torus/.test(reason.message);
}

function dimensionOf(problem: Problem): number {
  const A = problem.A ?? problem.inertia;
  return Array.isArray(A) ? A.length : 3;
}

/** Return what the views show of a closed form. */
export function ofDocument(
  problem: Problem,
  document: ClosedFormDocument,
  torus: Torus,
): Loaded {
  const motion = motionOf(document);
  const axes = document.axes ? [] : [...document.A];
  const slowest = Math.min(...torus.frequencies_t.map(Math.abs).filter((f) => f > 0));
  return {
    problem,
    motion,
    document,
    torus,
    A: motion.body ? inertiaOf(problem) : axes,
    torusA: axes,
    time: LETTERS[document.time] ?? "t",
    reach: Number.isFinite(slowest) ? CYCLES / slowest : 60,
    range: null,
  };
}

/** The series of the service, in stretches of time that are asked for as they are needed. */
async function ofSeries(problem: Problem, signal: AbortSignal): Promise<Loaded> {
  const first = await stretchOf(problem, 0, signal);
  const motion = new SeriesMotion(first, inertiaOf(problem), async (index) => {
    try {
      return await patiently(() => stretchOf(problem, index, signal));
    } catch (error) {
      // A server that is busy or gone is asked again; what it cannot do it will not do later.
      if (!(error instanceof Refusal) || error.status === 503) return null;
      return error.outcome === "too-far" ? "too far to integrate this motion" : reasonOf(error);
    }
  });
  return ofMotion(problem, motion, 2 * STRETCH_LENGTH);
}

/** Return what the views show of a motion that is known by its series. */
export function ofMotion(problem: Problem, motion: SeriesMotion, reach: number): Loaded {
  const letter = problem.system === "ellipsoid-geodesic" ? "s" : "t";
  const time = problem.system === "neumann" ? LETTERS.tau1 : letter;
  const A = inertiaOf(problem);
  return { problem, motion, document: null, torus: null, A, torusA: A, time, reach, range: null };
}

function stretchOf(problem: Problem, index: number, signal: AbortSignal): Promise<Stretch> {
  const start = index * STRETCH_LENGTH;
  const times = { start, stop: start + STRETCH_LENGTH, count: STRETCH_COUNT };
  return post<Stretch>("v1/trajectories", { problem, times }, signal);
}

/** Return A of a problem along its axes; empty where it has none. */
export function inertiaOf(problem: Problem): number[] {
  const field = SYSTEMS[problem.system]?.fields[0];
  if (!field || overSphere(problem)) return [];
  const values = entriesOf(problem, field).map(numberOf);
  if (!values.length || !values.every((value) => value > 0)) return [];
  if (field.name === "A") return values;
  const ball = numberOf(problem.mass ?? 0) * numberOf(problem.radius ?? 0) ** 2;
  return values.map((value) => 1 / (value + ball));
}

function loadTable({ problem }: Loaded, times: Grid): Promise<string> {
  return patiently(() => post<string>("v1/trajectories", { problem, times }, undefined, "text/csv"));
}

interface EngineAnswer {
  times: number[];
  series: { frame: number[][][] };
  error: number[];
}

/** Return what is asked for; a server that has too much to do is asked again, some times. */
async function patiently<T>(ask: () => Promise<T>): Promise<T> {
  for (let tries = 0; ; tries++) {
    try {
      return await ask();
    } catch (error) {
      const busy = error instanceof Refusal && BUSY.includes(error.status);
      if (!busy || tries === MOST_TRIES) throw error;
      await new Promise((resolve) => setTimeout(resolve, AGAIN_MS));
    }
  }
}

async function loadEngines(loaded: Loaded, signal: AbortSignal): Promise<Differences> {
  const count = 241;
  const stop = Math.min(60, Math.max(1, loaded.reach / 4));
  const ask = async (engine: string): Promise<EngineSeries> => {
    const times = { start: 0, stop, count };
    const body = { problem: loaded.problem, times, engine, outputs: ["frame"] };
    const answer = await patiently(() => post<EngineAnswer>("v1/trajectories", body, signal));
    return { times: answer.times, frame: answer.series.frame, error: answer.error };
  };
  const [analytic, numeric] = await Promise.allSettled([ask("analytic"), ask("numeric")]);
  if (analytic.status === "rejected" && numeric.status === "rejected") throw analytic.reason;
  const value = (one: PromiseSettledResult<EngineSeries>) =>
    one.status === "fulfilled" ? one.value : null;
  return { analytic: value(analytic), numeric: value(numeric) };
}
