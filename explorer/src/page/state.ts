/** The state of the page, and the address that holds it. */
import { Player } from "./player.ts";
import { PRESETS } from "./presets.ts";
import { isProblem, type Problem } from "./systems.ts";

export interface State {
  problem: Problem;
  /** The time as text, so that any digits can be asked for. */
  t: string;
  /** Units of time in a second. */
  speed: number;
  playing: boolean;
  /** The view that fills the page, or none. */
  large: string;
  /** Whether one or two views are shown alone. */
  lecture: boolean;
  /** Which parts of a link are broken, in sentences. */
  broken: string;
}

/** What a page shows that has one motion only: the time at which it opens, and what is said of it. */
export interface Only extends Pick<State, "problem" | "t"> {
  title: string;
  story: string;
}

/** Return the fragment of an address for a state, with its problem or without. */
export function fragmentOf(state: State, withProblem: boolean): string {
  const fields = new URLSearchParams();
  if (withProblem) fields.set("problem", JSON.stringify(state.problem));
  fields.set("t", state.t);
  fields.set("speed", String(state.speed));
  if (!state.playing) fields.set("play", "0");
  if (state.large) fields.set("view", state.large);
  if (state.lecture) fields.set("lecture", "1");
  return `#${fields}`;
}

/** The names of the views. */
const VIEWS = ["body", "sphere", "torus", "ball", "shell", "ellipsoid", "curve", "constants", "engines"];

/** Return the problem that a text states as JSON; undefined where it states none. */
function problemIn(text: string): Problem | undefined {
  try {
    const problem: unknown = JSON.parse(text);
    return isProblem(problem) ? problem : undefined;
  } catch {
    return undefined;
  }
}

/** Return the state of a fragment; what it says wrongly is named, and is as what it leaves out. */
export function stateOf(fragment: string, t = "0"): State {
  const fields = new URLSearchParams(fragment.replace(/^#/, ""));
  const broken: string[] = [];
  const take = <T>(name: string, otherwise: T, required: string, read: (text: string) => T | undefined): T => {
    const given = fields.get(name);
    const found = given === null ? otherwise : read(given);
    if (found !== undefined) return found;
    broken.push(`The link's ${name} is broken: required ${required}; given ${given?.slice(0, 40)}.`);
    return otherwise;
  };
  const named = (text: string) => PRESETS.find(({ name }) => name === text);
  const preset = take("preset", PRESETS[0], "the name of an example", named);
  const state = {
    problem: take("problem", preset.problem, "JSON with a system", problemIn),
    speed: take("speed", preset.speed ?? 1, "a number from 0 to 10⁹", (text) =>
      Number(text) > 0 && Number(text) <= 1e9 ? Number(text) : undefined,
    ),
    large: take("view", "", "the name of a view", (text) => ["", ...VIEWS].find((name) => name === text)),
    playing: take("play", true, "0 or 1", (text) => ({ 0: false, 1: true })[text]),
    t: take("t", t, "a time up to 10¹²", (text) => (new Player().go(text) ? undefined : text)),
    lecture: fields.get("lecture") === "1",
  };
  return { ...state, broken: broken.join(" ") };
}
