/** The state of the page, and the address that holds it. */
import presets from "../presets.json";
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
}

/** What a page shows that has one motion only, and the time at which it opens. */
export type Only = Pick<State, "problem" | "t">;

export interface Preset {
  name: string;
  title: string;
  text: string;
  speed?: number;
  /** The views of a lecture. */
  views: string[];
  problem: Problem;
}

export const PRESETS = presets as unknown as Preset[];

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

/** Return the state of a fragment; what it does not say, or says wrongly, is as at first. */
export function stateOf(fragment: string, t = FIRST.t): State {
  const fields = new URLSearchParams(fragment.replace(/^#/, ""));
  const state = { ...FIRST };
  const preset = PRESETS.find(({ name }) => name === fields.get("preset"));
  if (preset) {
    state.problem = preset.problem;
    state.speed = preset.speed ?? state.speed;
  }
  try {
    const problem: unknown = JSON.parse(fields.get("problem") ?? "null");
    if (problem && typeof problem === "object" && "system" in problem) {
      state.problem = problem as Problem;
    }
  } catch {
    // No JSON: the first problem is shown.
  }
  const speed = Number(fields.get("speed") ?? NaN);
  if (speed > 0 && speed <= 1e9) state.speed = speed;
  state.t = fields.get("t") ?? t;
  state.playing = fields.get("play") !== "0";
  state.large = fields.get("view") ?? "";
  state.lecture = fields.get("lecture") === "1";
  return state;
}
