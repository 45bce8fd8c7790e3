/** What every view has: a card with a canvas, a twin of it in text, and what it shows. */
import type { ClosedFormDocument } from "../evaluator/document.ts";
import { dot } from "../evaluator/linear_algebra.ts";
import type { Motion, Sample } from "../evaluator/motion.ts";
import type { Samples } from "../evaluator/samples.ts";
import type { Problem } from "../page/systems.ts";
import { explain } from "./terms.ts";

/** The answer of /v1/tori. */
export interface Torus {
  n: number;
  /** Null beyond the range of doubles, and where the Jacobi integral stands for it. */
  energy: number | null;
  jacobi_integral?: number;
  constants: number[];
  branch_points: number[];
  origins: string[];
  actions: number[];
  rotation_numbers: number[];
  frequencies_t: number[];
  frequencies_tau1: number[];
  phases: number[];
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

/** Return the constants as text; c_1 is among them for Neumann's system alone. */
export const namedConstants = ({ n, constants }: Torus): string =>
  constants.map((value, k) => `c${subscript(n - constants.length + k)} = ${short(value, 7)}`).join(", ");

/** Return what ½(JΩ,Ω) − (Ω,γ)(JΩ,γ) is called, or the energy: the same where (Ω,γ) = 0. */
export const energyName = ({ system }: Problem, { body }: Motion): string =>
  body && system !== "chaplygin-ball" ? "Jacobi integral" : "energy";

/** Systems in which (Ω,γ) = 0, and systems of three dimensions in which it changes. */
const HORIZONTAL = new Set(["veselova", "neumann", "ellipsoid-geodesic", "separable"]);
const TWISTING = new Set(["chaplygin-ball", "euler-poisson"]);

/** Systems whose q is a geodesic on an ellipsoid, where (Ω,γ) = 0 and no potential acts. */
const GEODESIC = new Set(["veselova", "veselova-so3", "rubber-ball", "ellipsoid-geodesic"]);

/** Return whether X = Aq/√(q,Aq) is a geodesic. Neumann's system needs F_0 = 0, so that c_1 = 0. */
export function isGeodesic(loaded: Loaded): boolean {
  const { motion, problem, torus } = loaded;
  if (problem.system === "neumann") {
    return torus !== null && Math.abs(torus.constants[0]) < 1e-12 * torus.branch_points.at(-1)!;
  }
  const pulled = torus === null && Object.keys(problem.potential ?? {}).length > 0;
  return GEODESIC.has(problem.system) && !pulled && (motion.n !== 3 || keepsHorizontal(loaded));
}

/** Return whether a ball rolls over a sphere: γ, its normal there, is no vector fixed in space. */
export const overSphere = ({ sphere }: Problem): boolean => (sphere ?? null) !== null;

/** Return whether ω keeps to the horizontal plane, (Ω,γ) = 0, at the start and so for ever. */
export function keepsHorizontal({ motion, problem }: Pick<Loaded, "motion" | "problem">): boolean {
  const { Omega, q } = motion.at(0);
  if (motion.body || TWISTING.has(problem.system) || overSphere(problem)) return false;
  // Ω of series is a slope, with four digits.
  return HORIZONTAL.has(problem.system) || Math.abs(dot(Omega, q)) < 1e-4 * (1 + Math.hypot(...Omega));
}

/** What is said where a motion has no torus, and no cause is known. */
export const WITHOUT_TORUS = "The page has series of this motion alone.";

/** The height in units of length beyond which a view is large. */
const LARGE = 420;

/** One motion in a view. */
export interface Picture {
  /** Take the samples of the trail; those before are forgotten where `anew`. */
  extend?: (samples: Samples, anew: boolean) => void;
  /** Show a time. */
  show?: (sample: Sample) => void;
  /** Return what is seen, in a sentence or two. */
  describe: (sample: Sample) => string;
}

export abstract class View<P extends Picture = Picture, T = Loaded> {
  readonly name: string;
  readonly title: string;
  readonly card: HTMLElement;
  readonly canvas: HTMLCanvasElement;
  readonly twin: HTMLElement;
  /** One plain sentence above the picture, and the details under it. */
  readonly lead = element("p", { class: "lead" });
  readonly caption = element("p", { class: "caption" });
  /** Whether something changed since the view was drawn. */
  stale = true;
  picture: P | null = null;

  constructor(name: string, title: string) {
    this.name = name;
    this.title = title;
    const twin = `twin-${name}`;
    this.card = element("section", { class: "card", "aria-labelledby": `title-${name}` });
    this.card.dataset.view = name;
    const spoken = { role: "img", "aria-label": title, "aria-describedby": twin };
    this.canvas = element("canvas", { tabindex: "0", ...spoken });
    this.twin = element("p", { class: "twin", id: twin });
    this.card.append(element("h2", { id: `title-${name}` }, title), this.lead, this.canvas, this.caption, this.twin);
    for (const event of ["keydown", "focus", "blur"]) {
      this.canvas.addEventListener(event, () => (this.stale = true));
    }
    new ResizeObserver(() => (this.stale = true)).observe(this.card);
  }

  /** Say what is seen, and the details. */
  protected say(lead: string, details = ""): void {
    explain(lead, this.lead);
    explain(details, this.caption);
  }

  /** Return null where a motion can be shown, else why it cannot. */
  refusal(_: T): string | null {
    return null;
  }

  /** Return the picture of a motion, in the colours of the page. */
  protected abstract build(shown: T): P;
  /** Draw what is shown. */
  abstract draw(): void;

  /** Begin with another motion, or with other colours. */
  begin(shown: T): void {
    this.picture = this.build(shown);
  }

  extend(samples: Samples, anew: boolean): void {
    this.picture?.extend?.(samples, anew);
    this.stale = true;
  }

  show(sample: Sample): void {
    this.picture?.show?.(sample);
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

/** Return a new element with attributes and content. */
export function element<K extends keyof HTMLElementTagNameMap>(
  kind: K,
  attributes: Record<string, string> = {},
  ...content: (Node | string)[]
): HTMLElementTagNameMap[K] {
  const made = document.createElement(kind);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...content);
  return made;
}

/** Write a text into an element, unless it is there already. */
export function write(into: HTMLElement, text: string): void {
  if (into.textContent !== text) into.textContent = text;
}

/** Return a number in as few letters as four digits take. */
export function short(x: number, digits = 4): string {
  if (x === 0) return "0";
  const size = Math.abs(x);
  if (size >= 1e5 || size < 1e-3) return x.toExponential(digits - 2).replaceAll("-", "−");
  return x.toPrecision(digits).replace("-", "−");
}

/** Return the name of a branch point. */
export const originName = (origin: string): string => `${origin[0]}${subscript(Number(origin.slice(1)))}`;

export const subscript = (k: number): string =>
  String(k).replace(/\d/g, (digit) => "₀₁₂₃₄₅₆₇₈₉"[Number(digit)]);

/** Return numbers as text; beside the largest, those below what documents tell are 0. */
export function list(values: ArrayLike<number>, digits = 4): string {
  const least = 1e-13 * Math.max(...Array.from(values, Math.abs));
  return Array.from(values, (value) => short(Math.abs(value) < least ? 0 : value, digits)).join(", ");
}
