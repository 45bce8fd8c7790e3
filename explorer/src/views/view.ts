/** What every view has: a card with a canvas, a twin of it in text, and what it shows. */
import type { ClosedFormDocument } from "../evaluator/document.ts";
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

/** Return the constants of a torus by their index; c_1 is among them for Neumann's system alone. */
export const constantsOf = ({ n, constants }: Torus): [number, number][] =>
  constants.map((value, k) => [n - constants.length + k, value]);

/** Return the constants as text. */
export const namedConstants = (torus: Torus): string =>
  constantsOf(torus).map(([k, value]) => `c${subscript(k)} = ${short(value, 7)}`).join(", ");

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
  const along = Omega.reduce((sum, entry, i) => sum + entry * q[i], 0);
  if (motion.body || TWISTING.has(problem.system) || overSphere(problem)) return false;
  // Ω of series is a slope, with four digits.
  return HORIZONTAL.has(problem.system) || Math.abs(along) < 1e-4 * (1 + Math.hypot(...Omega));
}

/** What is said where a motion has no torus, and no cause is known. */
export const WITHOUT_TORUS = "The page has series of this motion alone.";

/** The height in units of length beyond which a view is large. */
const LARGE = 420;

export abstract class View {
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

  constructor(name: string, title: string) {
    this.name = name;
    this.title = title;
    const twin = `twin-${name}`;
    this.card = element("section", { class: "card", "aria-labelledby": `title-${name}` });
    this.card.dataset.view = name;
    this.canvas = element("canvas", { tabindex: "0", role: "img", "aria-describedby": twin });
    this.canvas.setAttribute("aria-label", title);
    this.twin = element("p", { class: "twin", id: twin });
    const heading = element("h2", { id: `title-${name}` }, title);
    this.card.append(heading, this.lead, this.canvas, this.caption, this.twin);
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
