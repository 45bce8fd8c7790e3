/** Curves and surfaces of spheroconic and elliptic coordinates in three dimensions. */
import { Group } from "three";
import { surface } from "./shapes.ts";
import type { Point } from "./shapes.ts";

/** Return both branches of Σ q_i²/(λ − I_i) = 0 on the unit sphere; I in any order. */
export function spheroconicLine(I: ArrayLike<number>, lambda: number): Point[][] {
  const weights = Array.from(I, (entry) => 1 / (lambda - entry));
  const lone = weights.findIndex(
    (x) => weights.filter((y) => Math.sign(y) === Math.sign(x)).length === 1,
  );
  if (lone < 0 || weights.some((x) => !Number.isFinite(x))) return [];
  const [j, k] = [0, 1, 2].filter((i) => i !== lone);
  return [1, -1].map((sign) =>
    Array.from({ length: 201 }, (_, step): Point => {
      const angle = (2 * Math.PI * step) / 200;
      const point: Point = [0, 0, 0];
      point[j] = Math.cos(angle) / Math.sqrt(Math.abs(weights[j]));
      point[k] = Math.sin(angle) / Math.sqrt(Math.abs(weights[k]));
      point[lone] = sign / Math.sqrt(Math.abs(weights[lone]));
      const size = Math.hypot(...point) / 1.002;
      return point.map((x) => x / size) as Point;
    }),
  );
}

/** Return values of λ between the I, for a net of lines. */
export function netValues(I: ArrayLike<number>, each = 5): number[] {
  const sorted = Array.from(I).sort((a, b) => a - b);
  return [0, 1].flatMap((gap) =>
    Array.from({ length: each }, (_, k) => {
      // Closer to the ends, as the lines of a net are.
      const part = (1 - Math.cos((Math.PI * (k + 1)) / (each + 1))) / 2;
      return sorted[gap] + (sorted[gap + 1] - sorted[gap]) * part;
    }),
  );
}

/** Return the quadric Σ X_i²/(A_i − μ) = 1, with coordinates divided by `scale`. */
export function confocalQuadric(A: number[], mu: number, scale: number, colour: string): Group {
  const group = new Group();
  const d = A.map((entry) => entry - mu);
  const positive = [0, 1, 2].filter((i) => d[i] > 0);
  const negative = [0, 1, 2].filter((i) => d[i] < 0);
  const size = (i: number) => Math.sqrt(Math.abs(d[i])) / scale;
  const options = { opacity: 0.26, across: 72, along: 36 };
  const put = (entries: [number, number][]): Point => {
    const point: Point = [0, 0, 0];
    for (const [i, value] of entries) point[i] = size(i) * value;
    return point;
  };
  if (positive.length === 2 && negative.length === 1) {
    const one = surface((u, v) => {
      const h = 1.1 * (2 * v - 1);
      const angle = 2 * Math.PI * u;
      return put([
        [positive[0], Math.cosh(h) * Math.cos(angle)],
        [positive[1], Math.cosh(h) * Math.sin(angle)],
        [negative[0], Math.sinh(h)],
      ]);
    }, colour, options);
    group.add(one);
  }
  if (positive.length === 1 && negative.length === 2) {
    for (const sign of [1, -1]) {
      const sheet = surface((u, v) => {
        const h = 1.1 * v;
        const angle = 2 * Math.PI * u;
        return put([
          [positive[0], sign * Math.cosh(h)],
          [negative[0], Math.sinh(h) * Math.cos(angle)],
          [negative[1], Math.sinh(h) * Math.sin(angle)],
        ]);
      }, colour, options);
      group.add(sheet);
    }
  }
  return group;
}
