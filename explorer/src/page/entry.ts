/** A number by slider and by text. */
import { element } from "../views/view.ts";

export interface Entry {
  /** What follows "slider-" and "text-" in the ids. */
  id: string;
  letter: string;
  /** What the two are called aloud. */
  slider: string;
  text: string;
  step: string;
  /** Ends of the slider that stay. */
  ends?: { min: string; max: string };
}

/** Return a row with slider and text; `change` hears of either. */
export function entryRow(entry: Entry, change: (input: HTMLInputElement) => void): HTMLElement {
  const { id, letter, step, ends = {} } = entry;
  const row = element("div", { class: "entry" });
  const slider = element("input", { type: "range", id: `slider-${id}`, step, ...ends, "aria-label": entry.slider });
  const text = element("input", {
    type: "text",
    id: `text-${id}`,
    inputmode: "decimal",
    autocomplete: "off",
    spellcheck: "false",
    "aria-label": entry.text,
  });
  slider.addEventListener("input", () => change(slider));
  text.addEventListener("change", () => change(text));
  row.append(element("label", { for: text.id }, letter), slider, text);
  return row;
}
