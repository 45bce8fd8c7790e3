/** The elements of index.html that change. */
import { find } from "./common.ts";

export const elements = {
  preset: find<HTMLSelectElement>("preset"),
  system: find<HTMLSelectElement>("system"),
  story: find("story"),
  banner: find("banner"),
  play: find("play"),
  time: find<HTMLInputElement>("time"),
  timeFault: find("time-fault"),
  letter: find("letter"),
  speed: find<HTMLInputElement>("speed"),
  speedText: find("speed-text"),
  message: find("message"),
  data: find<HTMLDetailsElement>("data"),
  status: find("status"),
  formulas: find("formulas"),
  lecture: find("lecture"),
  jumps: document.querySelectorAll<HTMLElement>("[data-time]"),
};
