/** What every view has: a card with a canvas, a twin of it in text, and what it shows. */
import type { ClosedFormDocument } from "../evaluator/document.ts";
import type { Motion, Sample } from "../evaluator/motion.ts";
import type { Samples } from "../evaluator/samples.ts";
import type { Problem } from "../page/systems.ts";

/** The answer of /v1/tori. */
export interface Torus {
  n: number;
  energy: number;
  constants: number[];
  branch_points: number[];
  origins: string[];
  actions: number[];
  rotation_numbers: number[];
  frequencies_t: number[];
  frequencies_tau1: number[];
  phases: number[];
  signs: number[];
  regime: string;
}

export interface Loaded {
  problem: Problem;
  motion: Motion;
  document: ClosedFormDocument | null;
  torus: Torus | null;
  /** A of the directions along the axes; empty where the system has none. */
  A: number[];
  /** A of the problem on the torus, which is another with an area constant; empty as before. */
  torusA: number[];
  /** The letter of the independent variable. */
  time: string;
  /** The time that trails and plots reach back. */
  reach: number;
  /** Why there is no document, in a sentence; empty where there is one. */
  cause?: string;
  /** The first and last time that are known; null where any is. */
  range: [number, number] | null;
}

/** Systems of three dimensions in which (Ω,γ) changes. */
const TWISTING = new Set(["chaplygin-ball", "euler-poisson"]);

/** Return whether ω keeps to the horizontal plane, (Ω,γ) = 0, at the start and so for ever. */
export function keepsHorizontal({ motion, problem }: Pick<Loaded, "motion" | "problem">): boolean {
  const { Omega, q } = motion.at(0);
  const along = Omega.reduce((sum, entry, i) => sum + entry * q[i], 0);
  return !TWISTING.has(problem.system) && Math.abs(along) < 1e-6 * (1 + Math.hypot(...Omega));
}

/** One plot as numbers, for export as a picture of lines. */
export interface Curves {
  title: string;
  x: string;
  y: string;
  logarithmic: boolean;
  lines: { name: string; colour: string; dashed?: boolean; points: [number, number][] }[];
}

/** The height in units of length beyond which a view is large. */
const LARGE = 420;

export abstract class View {
  readonly name: string;
  readonly title: string;
  readonly card: HTMLElement;
  readonly canvas: HTMLCanvasElement;
  readonly twin: HTMLElement;
  readonly caption: HTMLElement;
  /** Whether something changed since the view was drawn. */
  stale = true;

  constructor(name: string, title: string, caption: string) {
    this.name = name;
    this.title = title;
    const twin = `twin-${name}`;
    this.card = element("section", { class: "card", "aria-labelledby": `title-${name}` });
    this.card.dataset.view = name;
    this.canvas = element("canvas", { tabindex: "0", role: "img", "aria-describedby": twin });
    this.canvas.setAttribute("aria-label", title);
    this.twin = element("p", { class: "twin", id: twin });
    this.caption = element("p", { class: "caption" }, caption);
    const heading = element("h2", { id: `title-${name}` }, title);
    this.card.append(heading, this.canvas, this.caption, this.twin);
    for (const event of ["keydown", "focus", "blur"]) {
      this.canvas.addEventListener(event, () => (this.stale = true));
    }
    new ResizeObserver(() => (this.stale = true)).observe(this.card);
  }

  /** Return null where a motion can be shown, else why it cannot. */
  abstract refusal(loaded: Loaded): string | null;
  /** Begin with another motion, or with other colours. */
  abstract build(loaded: Loaded): void;
  /** Take the samples of the trail; those before are forgotten where `anew`. */
  extend(_samples: Samples, _anew: boolean): void {}
  /** Show a time. */
  abstract show(sample: Sample): void;
  /** Return what is seen, in a sentence or two. */
  abstract describe(sample: Sample): string;
  /** Draw what is shown. */
  abstract draw(): void;
  /** Return the lines that are drawn, for a view of plots. */
  curves(): Curves[] {
    return [];
  }

  /**
   * Give the canvas as many pixels as its place has; return the pixels of one unit of length, which
   * grows with a large view: its names are read from afar.
   */
  protected fit(): number {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.round(this.canvas.clientWidth * ratio);
    const height = Math.round(this.canvas.clientHeight * ratio);
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
    }
    return ratio * Math.min(1.6, Math.max(1, this.canvas.clientHeight / LARGE));
  }
}

/** Return a new element with attributes and text. */
export function element<K extends keyof HTMLElementTagNameMap>(
  kind: K,
  attributes: Record<string, string> = {},
  text = "",
): HTMLElementTagNameMap[K] {
  const made = document.createElement(kind);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  if (text) made.textContent = text;
  return made;
}

/** Return a number in as few letters as four digits take. */
export function short(x: number, digits = 4): string {
  if (x === 0) return "0";
  const size = Math.abs(x);
  if (size >= 1e5 || size < 1e-3) return x.toExponential(digits - 2).replace("-", "−");
  return x.toPrecision(digits).replace("-", "−");
}

export const list = (values: ArrayLike<number>, digits = 4): string =>
  Array.from(values, (value) => short(value, digits)).join(", ");
