/** The real part of the curve w² = R(λ), (calR): cuts, gaps, ovals, and the points (λ_s, w_s). */
import type { Sample } from "../evaluator/motion.ts";
import { Names } from "./names.ts";
import { SERIES, theme } from "./theme.ts";
import { list, originName, short, subscript, View, WITHOUT_TORUS } from "./view.ts";
import type { Loaded, Torus } from "./view.ts";

/** Points of half an oval. */
const STEPS = 90;

export class CurveView extends View {
  #torus: Torus | null = null;
  #lambda: number[] = [];
  #w: number[] = [];

  constructor() {
    super("curve", "Curve");
  }

  refusal({ torus, motion, cause }: Loaded): string | null {
    return torus && motion.genus ? null : (cause ?? WITHOUT_TORUS);
  }

  build({ torus }: Loaded): void {
    this.#torus = torus;
    const b = torus?.branch_points ?? [];
    const still = b.flatMap((value, k) => (k % 2 && value === b[k + 1] ? [`λ${subscript((k + 1) / 2)}`] : []));
    this.say(
      "Each coordinate λ swings between two ends: forth along one half of its oval, back along the other.",
      `Ovals of the curve w² = R(λ), over the cuts. The ends are numbers I of the body and constants c₂, …; grey: the gaps.${
        still.length ? ` ${still.join(", ")} stands still: its ends coincide.` : ""
      }`,
    );
  }

  show({ lambda, directions }: Sample): void {
    const torus = this.#torus;
    if (!torus) return;
    const g = torus.branch_points.length >> 1;
    this.#lambda = Array.from(lambda).slice(0, g);
    // λ_s increases where (−1)^{g−s} w_s > 0.
    this.#w = this.#lambda.map((value, k) => {
      const sign = directions[k] * ((g - k - 1) % 2 ? -1 : 1);
      return sign * Math.sqrt(Math.abs(this.#R(value)));
    });
  }

  #R(lambda: number): number {
    return this.#torus!.branch_points.reduce((product, b) => product * (lambda - b), -1);
  }

  /** Return cut s as [left, right, largest w]. */
  #cut(s: number): [number, number, number] {
    const [left, right] = this.#torus!.branch_points.slice(2 * s - 1, 2 * s + 1);
    let most = 1e-300;
    for (let k = 1; k < 40; k++) {
      most = Math.max(most, Math.abs(this.#R(left + ((right - left) * k) / 40)));
    }
    return [left, right, Math.sqrt(most)];
  }

  draw(): void {
    const ratio = this.fit();
    const context = this.canvas.getContext("2d");
    if (!context || !this.#torus) return;
    const { width, height } = this.canvas;
    const colours = theme();
    const { branch_points: b, origins } = this.#torus;
    const [first, end] = [Math.min(0, b[0]), b[b.length - 1]];
    const x = (value: number) => (0.06 + (0.88 * (value - first)) / (end - first)) * width;
    const middle = 0.46 * height;
    const tall = 0.37 * height;
    context.fillStyle = colours.background;
    context.fillRect(0, 0, width, height);
    context.lineWidth = ratio;
    context.strokeStyle = colours.line;
    stroke(context, [[0, middle], [width, middle]]);
    context.lineWidth = 5 * ratio;
    context.strokeStyle = colours.dim;
    for (let s = 0; 2 * s + 1 < b.length; s++) {
      stroke(context, [[x(b[2 * s]), middle], [x(b[2 * s + 1]), middle]]);
    }
    const names = new Names(context, ratio, 12);
    for (let s = 1; 2 * s < b.length; s++) {
      const [left, right, most] = this.#cut(s);
      const colour = SERIES[(s - 1) % SERIES.length];
      context.lineWidth = 2.2 * ratio;
      context.strokeStyle = colour;
      const points = Array.from({ length: 2 * STEPS + 1 }, (_, k): [number, number] => {
        const value = left + ((right - left) * (1 - Math.cos((Math.PI * k) / STEPS))) / 2;
        const up = k <= STEPS ? 1 : -1;
        return [x(value), middle - (up * tall * Math.sqrt(Math.abs(this.#R(value)))) / most];
      });
      stroke(context, points);
      const value = Math.min(right, Math.max(left, this.#lambda[s - 1]));
      const y = middle - (tall * this.#w[s - 1]) / most;
      context.fillStyle = colours.text;
      disc(context, x(value), y, 6.5 * ratio);
      context.fillStyle = colour;
      disc(context, x(value), y, 4.5 * ratio);
      names.keepFree(x(value), y, 7 * ratio);
      // A narrow cut has its name beside it.
      const narrow = x(right) - x(left) < 22 * ratio;
      const across = narrow ? x(right) + 11 * ratio : x((left + right) / 2);
      names.write(`λ${subscript(s)}`, across, middle - (narrow ? 13 * ratio : 0));
    }
    this.#label(context, names, ratio, x, origins);
  }

  /** Write the names of the branch points. */
  #label(
    context: CanvasRenderingContext2D,
    names: Names,
    ratio: number,
    x: (value: number) => number,
    origins: string[],
  ): void {
    const { height } = context.canvas;
    const { branch_points: b } = this.#torus!;
    const name = (k: number) => originName(origins[k]);
    b.forEach((value, k) => {
      // Branch points that coincide share a name.
      if (k && value === b[k - 1]) return;
      const same = b.flatMap((other, j) => (other === value ? [name(j)] : []));
      const text = [...new Set(same)].join(" = ");
      const at = x(value);
      context.strokeStyle = theme().dim;
      context.lineWidth = ratio;
      stroke(context, [[at, 0.46 * height - 6 * ratio], [at, height - 50 * ratio]]);
      names.write(text, at, height - 38 * ratio);
    });
  }

  describe(): string {
    if (!this.#torus) return "";
    const { branch_points: b, origins } = this.#torus;
    const names = origins.map((name, k) => `${originName(name)} = ${short(b[k])}`).join(", ");
    return `λ is ${list(this.#lambda, 5)}. Branch points: ${names}.`;
  }
}

export function stroke(context: CanvasRenderingContext2D, points: [number, number][]): void {
  context.beginPath();
  points.forEach(([x, y], k) => (k ? context.lineTo(x, y) : context.moveTo(x, y)));
  context.stroke();
}

export function disc(context: CanvasRenderingContext2D, x: number, y: number, r: number): void {
  context.beginPath();
  context.arc(x, y, r, 0, 2 * Math.PI);
  context.fill();
}

