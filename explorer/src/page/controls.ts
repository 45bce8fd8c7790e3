/** The data of the problem, by slider and by exact text, with the refusals of the server. */
import { element, subscript } from "../views/view.ts";
import { type Entry, entry } from "./entry.ts";
import type { Fault } from "./service.ts";
import { ANY_DIMENSION, entriesOf, type Field, isEditable, isProblem, keepHorizontal } from "./systems.ts";
import { numberOf, type Problem, rangeOf, SYSTEMS, tidy, withDimension, withEntry } from "./systems.ts";

export class Controls {
  readonly #host: HTMLElement;
  readonly #editable: boolean;
  readonly #change: (problem: Problem) => void;
  #problem: Problem = { system: "veselova" };
  #shape = "";
  /** The entries that are shown, and what is said of their fields. */
  #entries: [Field, number, Entry][] = [];
  #abouts: [Field, HTMLElement][] = [];
  /** What an edit has changed besides, in a sentence. */
  #follows = "";

  constructor(host: HTMLElement, editable: boolean, change: (problem: Problem) => void) {
    this.#host = host;
    this.#editable = editable;
    this.#change = change;
  }

  /** Show a problem; inputs that stay keep the focus. */
  show(problem: Problem): void {
    this.#problem = problem;
    const fields = (SYSTEMS[problem.system]?.fields ?? []).filter((field) => isEditable(problem, field));
    const counts = fields.map((field) => `${field.name}${entriesOf(problem, field).length}`);
    const shape = `${problem.system} ${counts.join()}`;
    if (shape !== this.#shape) {
      this.#shape = shape;
      this.#build(fields);
    }
    for (const [field, i, { show }] of this.#entries) {
      const text = entriesOf(problem, field)[i];
      show(numberOf(text), text, rangeOf(problem, field, i));
    }
    for (const [field, about] of this.#abouts) about.textContent = this.#aboutOf(field);
    this.#follows = "";
    const area = this.#host.querySelector("textarea");
    if (area && document.activeElement !== area) area.value = JSON.stringify(problem, null, 1);
  }

  #build(fields: Field[]): void {
    const open = this.#host.querySelector("details")?.open ?? false;
    [this.#entries, this.#abouts] = [[], []];
    this.#host.replaceChildren(...fields.map((field) => this.#fieldset(field)));
    if (ANY_DIMENSION.has(this.#problem.system)) this.#host.append(this.#dimension());
    this.#host.append(this.#source(open));
    if (this.#editable) return;
    const texts = this.#host.querySelectorAll<HTMLInputElement>("input, textarea");
    for (const text of texts) text.readOnly = true;
  }

  #fieldset(field: Field): HTMLElement {
    const about = element("p", { class: "about", "aria-live": "polite" });
    this.#abouts.push([field, about]);
    const rows = entriesOf(this.#problem, field).map((_, i) => {
      const letter = field.scalar ? field.symbol : `${field.symbol}${subscript(i + 1)}`;
      const made = entry({ id: `${field.name}-${i}`, letter, spoken: letter, step: "0.01" }, (input) => {
        this.#edit(field, i, input.type === "range" ? String(Number(input.value)) : tidy(input.value));
      });
      this.#entries.push([field, i, made]);
      return made.row;
    });
    const legend = element("legend", { title: field.text }, field.symbol);
    const fault = element("p", { class: "fault", id: `fault-${field.name}` });
    return element("fieldset", {}, legend, about, ...rows, fault);
  }

  /** Return what is said of a field: what it is, or what became of it. */
  #aboutOf(field: Field): string {
    const sizes = field.moments ? entriesOf(this.#problem, field).map(numberOf).sort((a, b) => a - b) : [];
    if (sizes.length === 3 && sizes[2] > (sizes[0] + sizes[1]) * (1 + 1e-12)) {
      return "No real body has these moments: one exceeds the sum of the other two.";
    }
    return (field.name === "Omega" && this.#follows) || field.text;
  }

  #edit(field: Field, i: number, text: string): void {
    const edited = withEntry(this.#problem, field, i, text);
    const kept = keepHorizontal(this.#problem, edited, field.name === "Omega" ? i : -1);
    const [was, is] = [edited, kept].map((one) => [one.Omega].flat().map(numberOf));
    const k = is.findIndex((x, j) => x !== was[j] && Number.isFinite(x));
    if (k >= 0) this.#follows = `Ω${subscript(k + 1)} follows, so that the body does not spin about γ`;
    this.#change(kept);
  }

  #dimension(): HTMLElement {
    const make = (text: string, label: string, change: 1 | -1) => {
      const button = element("button", { type: "button", "aria-label": label }, text);
      button.addEventListener("click", () => {
        const system = SYSTEMS[this.#problem.system];
        const n = entriesOf(this.#problem, system.fields[0]).length + change;
        if (n >= 2 && n <= 8) this.#change(withDimension(this.#problem, system, change));
      });
      return button;
    };
    const buttons = [make("−", "one dimension fewer", -1), make("+", "one dimension more", 1)];
    return element("div", { class: "row" }, element("span", { class: "dim" }, "dimension"), ...buttons);
  }

  /** The problem as JSON, for data without sliders. */
  #source(open: boolean): HTMLElement {
    const spoken = { "aria-label": "the problem as JSON", "aria-describedby": "fault-json" };
    const area = element("textarea", { rows: "9", spellcheck: "false", ...spoken });
    const fault = element("p", { class: "fault", id: "fault-json" });
    area.addEventListener("change", () => {
      fault.textContent = "";
      try {
        const problem: unknown = JSON.parse(area.value);
        if (!isProblem(problem)) throw new Error("required an object with the field system");
        this.#change(problem);
      } catch (error) {
        const { message } = error as Error;
        fault.textContent = `problem: ${error instanceof SyntaxError ? breakOf(message, area.value) : message}.`;
      }
    });
    return element("details", open ? { open: "" } : {}, element("summary", {}, "Problem as JSON"), area, fault);
  }

  /** Show the faults at their fields; return the sentences that have none. */
  mark(faults: Fault[]): string[] {
    for (const one of this.#host.querySelectorAll(".fault")) one.textContent = "";
    for (const one of this.#host.querySelectorAll("[aria-invalid]")) one.removeAttribute("aria-invalid");
    return faults.flatMap(({ pointer, detail }) => {
      const [, name, place] = /^\/problem\/([^/]+)(?:\/(\d+))?/.exec(pointer) ?? [];
      const id = `${name}-${place ?? 0}`;
      const fault = document.getElementById(`fault-${place ? id : name}`);
      if (!fault) return [detail.replace(/^problem\./, "")];
      const field = SYSTEMS[this.#problem.system]?.fields.find((one) => one.name === name);
      const index = place ? subscript(Number(place) + 1) : "";
      fault.textContent = faultOf(`${field?.symbol ?? name}${index}`, detail);
      fault.title = detail;
      document.getElementById(`text-${id}`)?.setAttribute("aria-invalid", "true");
      return [];
    });
  }
}

/** Requirements of the service in fewer words. */
const SHORTER: [RegExp, string][] = [
  [/ \([^)]*\)/g, ""],
  [/finite (?:real )?number(?: within the range of a float)?/, "number"],
  [/moments of a body.*/, "no moment above the sum of the others"],
];

/** Return where a text is no JSON; browsers say the place, or the character alone. */
function breakOf(message: string, text: string): string {
  const [, line, column] = /line (\d+) column (\d+)/.exec(message)?.map(Number) ?? [];
  const [, token] = /token '?(.)/.exec(message) ?? [];
  const found = text.split("\n")[line - 1]?.[column - 1] ?? token;
  if (!found) return "the JSON ends too early";
  return `no JSON at the character ${found}${line ? `, number ${column} of line ${line}` : ""}`;
}

const MOST_WORDS = 10;

/** Return a fault at a field in at most ten words: what is given goes first, then the end. */
function faultOf(name: string, detail: string): string {
  if (detail.endsWith("given the zero vector.")) return `${name}: required entries that are not all zero.`;
  const [, required, given] = /required (.*); given (.*)\.$/s.exec(detail) ?? ["", detail, "''"];
  const text = SHORTER.reduce((shorter, [long, short]) => shorter.replace(long, short), required);
  const shown = given.replace(/^'(.*)'$/s, "$1") || "nothing";
  const words = `${name}: required ${text}`.split(" ");
  if (words.length > MOST_WORDS) return `${words.slice(0, MOST_WORDS).join(" ")} …`;
  const whole = `${words.join(" ")}; given ${shown}`;
  return `${whole.split(" ").length > MOST_WORDS ? words.join(" ") : whole}.`;
}
