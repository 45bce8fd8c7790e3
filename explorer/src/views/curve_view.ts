/** The real part of the curve w² = R(λ), (calR): cuts, gaps, ovals, and the points (λ_s, w_s). */
import { type Drawing, type Place, View2D } from "./plane.ts";
import { SERIES, theme } from "./theme.ts";
import { list, type Loaded, originName, short, subscript, WITHOUT_TORUS } from "./view.ts";

/** Points of half an oval. */
const STEPS = 90;

export class CurveView extends View2D {
  constructor() {
    super("curve", "Curve");
  }

  override refusal({ torus, motion, cause }: Loaded): string | null {
    return torus && motion.genus ? null : (cause ?? WITHOUT_TORUS);
  }

  build({ torus, motion }: Loaded): Drawing {
    const { branch_points: b, origins } = torus!;
    const names = origins.map(originName);
    const points = names.map((name, k) => `${name} = ${short(b[k])}`);
    const still = b.flatMap((value, k) => (k % 2 && value === b[k + 1] ? [`λ${subscript((k + 1) / 2)}`] : []));
    const coincide = still.length ? ` ${still.join(", ")} stands still: its ends coincide.` : "";
    this.say(
      "Each coordinate λ swings between two ends: forth along one half of its oval, back along the other.",
      `Ovals of the curve w² = R(λ), over the cuts. The ends are numbers I of the body and constants c₂, …; grey: the gaps.${coincide}`,
    );
    const g = b.length >> 1;
    const sizeOf = (lambda: number) => Math.sqrt(Math.abs(b.reduce((product, x) => product * (lambda - x), 1)));
    const cuts = Array.from({ length: g }, (_, s) => cutOf(b[2 * s + 1], b[2 * s + 2], sizeOf));
    let { lambda, directions } = motion.at(0);
    return {
      show: (sample) => ({ lambda, directions } = sample),
      paint: (pen) => {
        const { ratio } = pen;
        const { width, height } = this.canvas;
        const { dim, line } = theme();
        const [first, end] = [Math.min(0, b[0]), b[b.length - 1]];
        const x = (value: number) => (0.06 + (0.88 * (value - first)) / (end - first)) * width;
        const [middle, tall] = [0.46 * height, 0.37 * height];
        pen.stroke([[0, middle], [width, middle]], line);
        for (let s = 0; 2 * s + 1 < b.length; s++) {
          pen.stroke([[x(b[2 * s]), middle], [x(b[2 * s + 1]), middle]], dim, 5);
        }
        cuts.forEach(({ left, right, tallest }, s) => {
          const colour = SERIES[s % SERIES.length];
          const place = (value: number, up: number): Place => [
            x(value),
            middle - (up * tall * sizeOf(value)) / tallest,
          ];
          const oval = Array.from({ length: 2 * STEPS + 1 }, (_, k) =>
            place(left + ((right - left) * (1 - Math.cos((Math.PI * k) / STEPS))) / 2, k <= STEPS ? 1 : -1),
          );
          pen.stroke(oval, colour, 2.2);
          // λ_s increases where (−1)^{g−s} w_s > 0.
          const up = directions[s] * ((g - s - 1) % 2 ? -1 : 1);
          const at = place(Math.min(right, Math.max(left, lambda[s])), up);
          pen.mark(at, colour);
          pen.keepFree(...at, 7 * ratio);
          // A narrow cut has its name beside it.
          const narrow = x(right) - x(left) < 22 * ratio;
          const across = narrow ? x(right) + 11 * ratio : x((left + right) / 2);
          pen.write(`λ${subscript(s + 1)}`, across, middle - (narrow ? 13 * ratio : 0));
        });
        // Branch points that coincide share a name.
        for (const value of new Set(b)) {
          pen.stroke([[x(value), middle - 6 * ratio], [x(value), height - 50 * ratio]], dim);
          const shared = new Set(names.filter((_, k) => b[k] === value));
          pen.write([...shared].join(" = "), x(value), height - 38 * ratio);
        }
      },
      describe: (sample) => `λ is ${list(sample.lambda.slice(0, g), 5)}. Branch points: ${points.join(", ")}.`,
    };
  }
}

/** Return a cut with its largest |w|. */
function cutOf(left: number, right: number, sizeOf: (lambda: number) => number) {
  const inside = Array.from({ length: 39 }, (_, k) => sizeOf(left + ((right - left) * (k + 1)) / 40));
  return { left, right, tallest: Math.max(1e-150, ...inside) };
}
