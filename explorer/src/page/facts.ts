/** The table of numbers; each has a sentence and its formula, on hover or focus. */
import type { Sample } from "../evaluator/motion.ts";
import { fractionText } from "../views/torus_view.ts";
import { TERMS } from "../views/terms.ts";
import { element, energyName, list, type Loaded, namedConstants, overSphere, short } from "../views/view.ts";
import { FORMULAS, formulasOf, typeset } from "./formulas.ts";

export class Facts {
  readonly #table: HTMLElement;
  /** The cells that change with time, and their texts. */
  #live: [HTMLElement, (sample: Sample) => string][] = [];
  #formulas = FORMULAS;

  constructor(table: HTMLElement) {
    this.#table = table;
  }

  /** Begin with another motion. */
  build(loaded: Loaded): void {
    const { torus, document, motion, problem } = loaded;
    this.#table.replaceChildren();
    this.#live = [];
    this.#formulas = formulasOf(loaded);
    const vector = "gamma" in problem ? "γ" : "q";
    this.#row("q", overSphere(problem) ? vector : `${vector} = e₁`, ({ q }) => list(q));
    if (motion.n === 3) this.#row("omega", "|Ω|", ({ Omega }) => short(Math.hypot(...Omega), 5));
    if (motion.moments.length > 1) this.#row("lambda", "λ", ({ lambda }) => list(lambda, 5));
    if (!document) return;
    if (torus) {
      const part = (entry: number) => (entry - Math.floor(entry)).toFixed(4);
      this.#row("phases", "phases z", ({ z }) => Array.from(z, part).join(", "));
      this.#row("regime", "regime", torus.regime);
      const h = torus.jacobi_integral ?? torus.energy;
      if (h !== null) this.#row("energy", `${energyName(problem, motion)} h`, short(h, 7));
      if (torus.constants.length) this.#row("constants", "constants c", namedConstants(torus));
      this.#row("frequencies", "frequencies", list(torus.frequencies_t, 6));
      const ratios = torus.rotation_numbers.slice(1).map(fractionText).join(" ");
      const text = ratios.replaceAll("Rotation number ", "").replace(/\.$/, "");
      if (text) this.#row("rotation", "rotation number", text);
      this.#row("actions", "actions J", list(torus.actions, 6));
    }
    const { at_start: start, per_unit_time: rate } = document.error;
    this.#row("error", "error at t", ({ t }) => `≤ ${short(start + rate * Math.abs(t), 2)}`);
    const size = JSON.stringify(document).length / 1000;
    this.#row("tau", "document", `${document.modes.length} modes, ${size.toFixed(0)} kB`);
  }

  #row(name: string, title: string, value: string | ((sample: Sample) => string)): void {
    const row = element("tr");
    const head = element("th", { scope: "row" });
    const button = element("button", { class: "fact", type: "button" }, title);
    const note = element("span", { class: "note", role: "tooltip", id: `note-${name}` });
    button.setAttribute("aria-describedby", note.id);
    const formula = this.#formulas[name] ?? { tex: "", text: "" };
    const term = TERMS[{ lambda: "λ", constants: "c", phases: "z", regime: "regime" }[name] ?? ""];
    let written = false;
    const write = () => {
      // A note is at most 220 pixels high.
      const at = Math.min(button.getBoundingClientRect().top, window.innerHeight - 110);
      note.style.top = `${Math.max(at, 110)}px`;
      if (written) return;
      written = true;
      const body = element("span");
      note.append(element("p", {}, `${term ?? ""} ${formula.text}`.trim()), body);
      void typeset(formula.tex, body);
    };
    button.addEventListener("pointerenter", write);
    button.addEventListener("focus", write);
    head.append(button, note);
    const cell = element("td", {}, typeof value === "string" ? value : "");
    row.append(head, cell);
    this.#table.append(row);
    if (typeof value !== "string") this.#live.push([cell, value]);
  }

  /** Show a time. */
  show(sample: Sample): void {
    for (const [cell, textOf] of this.#live) {
      const text = textOf(sample);
      if (cell.textContent !== text) cell.textContent = text;
    }
  }
}
