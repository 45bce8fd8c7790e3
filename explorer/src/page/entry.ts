/** A number by slider and by text. */
import { element } from "../views/view.ts";

export interface Entry {
  row: HTMLElement;
  /** Show a number and its text, between ends that it may exceed. */
  show: (value: number, written: string, ends: [number, number]) => void;
}

/** Return a row of slider, text and a place for its fault; `change` hears of either. */
export function entry(
  { id, letter, spoken, step }: { id: string; letter: string; spoken: string; step: string },
  change: (input: HTMLInputElement) => void,
): Entry {
  const slider = element("input", { type: "range", id: `slider-${id}`, step, "aria-label": `${spoken}, slider` });
  const text = element("input", {
    type: "text",
    id: `text-${id}`,
    inputmode: "decimal",
    autocomplete: "off",
    spellcheck: "false",
    "aria-label": `${spoken}, exact`,
    "aria-describedby": `fault-${id}`,
  });
  slider.addEventListener("input", () => change(slider));
  text.addEventListener("change", () => change(text));
  const label = element("label", { for: text.id }, letter);
  const fault = element("p", { class: "fault", id: `fault-${id}` });
  return {
    row: element("div", { class: "entry" }, label, slider, text, fault),
    show: (value, written, [low, high]) => {
      if (document.activeElement !== text) text.value = written;
      if (!Number.isFinite(value)) return;
      slider.min = String(Math.min(low, value));
      slider.max = String(Math.max(high, value));
      slider.value = String(value);
      slider.setAttribute("aria-valuetext", written);
    },
  };
}
