/** The table of numbers; each has a sentence and its formula, on hover or focus. */
import type { Sample } from "../evaluator/motion.ts";
import { fractionText } from "../views/torus_view.ts";
import { TERMS } from "../views/terms.ts";
import { element, energyName, list, namedConstants, overSphere, short } from "../views/view.ts";
import type { Loaded } from "../views/view.ts";
import { FORMULAS, formulasOf, typeset } from "./formulas.ts";

export class Facts {
  readonly #table: HTMLElement;
  readonly #live = new Map<string, HTMLElement>();
  #formulas = FORMULAS;

  constructor(table: HTMLElement) {
    this.#table = table;
  }

  /** Begin with another motion. */
  build(loaded: Loaded): void {
    const { torus, document, motion, problem } = loaded;
    this.#table.replaceChildren();
    this.#live.clear();
    this.#formulas = formulasOf(loaded);
    const vector = "gamma" in problem ? "γ" : "q";
    this.#row("q", overSphere(problem) ? vector : `${vector} = e₁`, "");
    this.#row("omega", "|Ω|", "", motion.n === 3);
    this.#row("lambda", "λ", "", motion.moments.length > 1);
    if (torus && document) {
      this.#row("phases", "phases z", "");
      this.#row("regime", "regime", torus.regime);
      const h = torus.jacobi_integral ?? torus.energy;
      this.#row("energy", `${energyName(problem, motion)} h`, short(h ?? NaN, 7), h !== null);
      this.#row("constants", "constants c", namedConstants(torus), torus.constants.length > 0);
      this.#row("frequencies", "frequencies", list(torus.frequencies_t, 6));
      const ratios = torus.rotation_numbers.slice(1).map(fractionText).join(" ");
      const text = ratios.replaceAll("Rotation number ", "").replace(/\.$/, "");
      this.#row("rotation", "rotation number", text, ratios !== "");
      this.#row("actions", "actions J", list(torus.actions, 6));
    }
    this.#row("error", "error at t", "", document !== null);
    if (document) {
      const size = JSON.stringify(document).length / 1000;
      this.#row("tau", "document", `${document.modes.length} modes, ${size.toFixed(0)} kB`);
    }
  }

  #row(name: string, title: string, value: string, wanted = true): void {
    if (!wanted) return;
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
    const cell = element("td", {}, value);
    row.append(head, cell);
    this.#table.append(row);
    this.#live.set(name, cell);
  }

  /** Show a time. */
  show({ q, z, lambda, Omega, t }: Sample, { document }: Loaded): void {
    this.#write("q", list(q));
    this.#write("omega", short(Math.hypot(...Omega), 5));
    this.#write("lambda", list(lambda, 5));
    const phases = Array.from(z, (entry) => (entry - Math.floor(entry)).toFixed(4));
    this.#write("phases", phases.join(", "));
    if (document) {
      const { at_start: start, per_unit_time: rate } = document.error;
      this.#write("error", `≤ ${short(Number(start) + Number(rate) * Math.abs(t), 2)}`);
    }
  }

  #write(name: string, text: string): void {
    const cell = this.#live.get(name);
    if (cell && cell.textContent !== text) cell.textContent = text;
  }
}
