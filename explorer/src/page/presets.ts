/** The examples: starts that the page lists, and that a site without a server has. */
import presets from "../presets.json";
import type { Problem } from "./systems.ts";

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

/** Return the preset of a problem, if it is one. */
export function presetOf(problem: Problem): Preset | undefined {
  const text = JSON.stringify(problem);
  return PRESETS.find((one) => JSON.stringify(one.problem) === text);
}

/** Return the problem of a preset. */
export const problemOf = (name: string): Problem => PRESETS.find((one) => one.name === name)!.problem;
