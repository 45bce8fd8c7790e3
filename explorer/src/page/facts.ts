/** The table of numbers; each has a sentence and its formula, on hover or focus. */
import type { Sample } from "../evaluator/motion.ts";
import { fractionText } from "../views/torus_view.ts";
import { TERMS } from "../views/terms.ts";
import { element, energyName, list, type Loaded, namedConstants, overSphere, short, write } from "../views/view.ts";
import { type Formula, formulasOf, typeset } from "./formulas.ts";

/** Write the numbers of a motion into a table; return what shows those that change, at a time. */
export function facts(table: HTMLElement, loaded: Loaded): (sample: Sample) => void {
  const { torus, document, motion, problem } = loaded;
  const live: [HTMLElement, (sample: Sample) => string][] = [];
  const formulas = formulasOf(loaded);
  table.replaceChildren();
  const add = (name: string, title: string, value: string | ((sample: Sample) => string)) => {
    const cell = element("td", {}, ...(typeof value === "string" ? [value] : []));
    table.append(element("tr", {}, headOf(name, title, formulas[name]), cell));
    if (typeof value !== "string") live.push([cell, value]);
  };
  const vector = "gamma" in problem ? "γ" : "q";
  add("q", overSphere(problem) ? vector : `${vector} = e₁`, ({ q }) => list(q));
  if (motion.n === 3) add("omega", "|Ω|", ({ Omega }) => short(Math.hypot(...Omega), 5));
  if (motion.moments.length > 1) add("lambda", "λ", ({ lambda }) => list(lambda, 5));
  if (torus && document) {
    const part = (entry: number) => (entry - Math.floor(entry)).toFixed(4);
    add("phases", "phases z", ({ z }) => Array.from(z, part).join(", "));
    add("regime", "regime", torus.regime);
    const h = torus.jacobi_integral ?? torus.energy;
    if (h !== null) add("energy", `${energyName(problem, motion)} h`, short(h, 7));
    if (torus.constants.length) add("constants", "constants c", namedConstants(torus));
    add("frequencies", "frequencies", list(torus.frequencies_t, 6));
    const ratios = torus.rotation_numbers.slice(1).map(fractionText).join(" ");
    const text = ratios.replaceAll("Rotation number ", "").replace(/\.$/, "");
    if (text) add("rotation", "rotation number", text);
    add("actions", "actions J", list(torus.actions, 6));
  }
  if (document) {
    const { at_start: start, per_unit_time: rate } = document.error;
    add("error", "error at t", ({ t }) => `≤ ${short(start + rate * Math.abs(t), 2)}`);
    const size = JSON.stringify(document).length / 1000;
    add("tau", "document", `${document.modes.length} modes, ${size.toFixed(0)} kB`);
  }
  return (sample) => live.forEach(([cell, textOf]) => write(cell, textOf(sample)));
}

/** Return the head of a row; under the pointer or with the focus it has a sentence and a formula. */
function headOf(name: string, title: string, { tex, text }: Formula = { tex: "", text: "" }): HTMLElement {
  const button = element("button", { class: "fact", type: "button", "aria-describedby": `note-${name}` }, title);
  const note = element("span", { class: "note", role: "tooltip", id: `note-${name}` });
  const term = TERMS[{ lambda: "λ", constants: "c", phases: "z", regime: "regime" }[name] ?? ""] ?? "";
  const explain = () => {
    // A note is at most 220 pixels high.
    const at = Math.min(button.getBoundingClientRect().top, window.innerHeight - 110);
    note.style.top = `${Math.max(at, 110)}px`;
    if (!note.hasChildNodes()) note.append(element("p", {}, `${term} ${text}`.trim()), typeset(tex));
  };
  for (const event of ["pointerenter", "focus"]) button.addEventListener(event, explain);
  return element("th", { scope: "row" }, button, note);
}
