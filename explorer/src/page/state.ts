/** The state of the page, and the address that holds it. */
import { Player } from "./player.ts";
import { PRESETS } from "./presets.ts";
import type { Problem } from "./systems.ts";

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
  broken?: string;
}

/** What a page shows that has one motion only: the time at which it opens, and what is said of it. */
export interface Only extends Pick<State, "problem" | "t"> {
  title: string;
  story: string;
}

export const FIRST: State = {
  problem: PRESETS[0].problem,
  t: "0",
  speed: 1,
  playing: true,
  large: "",
  lecture: false,
};

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
const VIEWS = ["body", "sphere", "torus", "ball", "ellipsoid", "curve", "constants", "engines"];

/** Return the state of a fragment; what it says wrongly is named, and is as what it leaves out. */
export function stateOf(fragment: string, t = FIRST.t): State {
  const fields = new URLSearchParams(fragment.replace(/^#/, ""));
  const state = { ...FIRST };
  const broken: string[] = [];
  const require = (name: string, holds: boolean, required: string) => {
    const given = fields.get(name);
    if (given === null || holds) return;
    broken.push(`The link's ${name} is broken: required ${required}; given ${given.slice(0, 40)}.`);
  };
  const preset = PRESETS.find(({ name }) => name === fields.get("preset"));
  if (preset) {
    state.problem = preset.problem;
    state.speed = preset.speed ?? state.speed;
  }
  require("preset", !!preset, "the name of an example");
  let stated = false;
  try {
    const problem: unknown = JSON.parse(fields.get("problem") ?? "null");
    if (problem && typeof problem === "object" && "system" in problem) {
      state.problem = problem as Problem;
      stated = true;
    }
  } catch {
    // No JSON.
  }
  require("problem", stated, "JSON with a system");
  const speed = Number(fields.get("speed") ?? NaN);
  if (speed > 0 && speed <= 1e9) state.speed = speed;
  require("speed", state.speed === speed, "a number from 0 to 10⁹");
  state.t = fields.get("t") ?? t;
  state.playing = fields.get("play") !== "0";
  state.lecture = fields.get("lecture") === "1";
  const view = fields.get("view") ?? "";
  if (VIEWS.includes(view)) state.large = view;
  require("view", !view || state.large === view, "the name of a view");
  require("play", ["0", "1"].includes(fields.get("play") ?? ""), "0 or 1");
  const fault = new Player().go(state.t);
  require("t", !fault, "a time up to 10¹²");
  if (fault) state.t = t;
  state.broken = broken.join(" ");
  return state;
}
