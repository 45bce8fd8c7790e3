/** The real part of the curve w² = R(λ), (calR): cuts, gaps, ovals, and the points (λ_s, w_s). */
import type { Sample } from "../evaluator/motion.ts";
import { type Pen, type Place, View2D } from "./plane.ts";
import { SERIES, theme } from "./theme.ts";
import { list, type Loaded, originName, short, subscript, type Torus, WITHOUT_TORUS } from "./view.ts";

/** Points of half an oval. */
const STEPS = 90;

export class CurveView extends View2D {
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

  protected paint(pen: Pen): void {
    if (!this.#torus) return;
    const { width, height } = this.canvas;
    const { ratio, names } = pen;
    const colours = theme();
    const { branch_points: b } = this.#torus;
    const [first, end] = [Math.min(0, b[0]), b[b.length - 1]];
    const x = (value: number) => (0.06 + (0.88 * (value - first)) / (end - first)) * width;
    const middle = 0.46 * height;
    const tall = 0.37 * height;
    pen.stroke([[0, middle], [width, middle]], colours.line);
    for (let s = 0; 2 * s + 1 < b.length; s++) {
      pen.stroke([[x(b[2 * s]), middle], [x(b[2 * s + 1]), middle]], colours.dim, 5);
    }
    for (let s = 1; 2 * s < b.length; s++) {
      const [left, right, most] = this.#cut(s);
      const colour = SERIES[(s - 1) % SERIES.length];
      const points = Array.from({ length: 2 * STEPS + 1 }, (_, k): Place => {
        const value = left + ((right - left) * (1 - Math.cos((Math.PI * k) / STEPS))) / 2;
        const up = k <= STEPS ? 1 : -1;
        return [x(value), middle - (up * tall * Math.sqrt(Math.abs(this.#R(value)))) / most];
      });
      pen.stroke(points, colour, 2.2);
      const value = Math.min(right, Math.max(left, this.#lambda[s - 1]));
      const at: Place = [x(value), middle - (tall * this.#w[s - 1]) / most];
      pen.mark(at, colour);
      names.keepFree(...at, 7 * ratio);
      // A narrow cut has its name beside it.
      const narrow = x(right) - x(left) < 22 * ratio;
      const across = narrow ? x(right) + 11 * ratio : x((left + right) / 2);
      names.write(`λ${subscript(s)}`, across, middle - (narrow ? 13 * ratio : 0));
    }
    // Branch points that coincide share a name.
    for (const value of new Set(b)) {
      pen.stroke([[x(value), middle - 6 * ratio], [x(value), height - 50 * ratio]], colours.dim);
      names.write(this.#nameOf(value), x(value), height - 38 * ratio);
    }
  }

  #nameOf(value: number): string {
    const { branch_points: b, origins } = this.#torus!;
    return [...new Set(origins.filter((_, k) => b[k] === value).map(originName))].join(" = ");
  }

  describe(): string {
    if (!this.#torus) return "";
    const { branch_points: b, origins } = this.#torus;
    const names = origins.map((name, k) => `${originName(name)} = ${short(b[k])}`).join(", ");
    return `λ is ${list(this.#lambda, 5)}. Branch points: ${names}.`;
  }
}
