/** Curves and surfaces of spheroconic and elliptic coordinates in three dimensions. */
import { LatheGeometry, Matrix4, type Mesh, Vector2, Vector3 } from "three";
import { curve, type Point, surface } from "./shapes.ts";

/** Return which of three numbers has a sign of its own, and the others; null where none has. */
function loneOf(values: number[]): [number, number, number] | null {
  if (values.some((x) => !Number.isFinite(x) || x === 0)) return null;
  const lone = values.findIndex((x) => values.filter((y) => x * y > 0).length === 1);
  return lone < 0 ? null : [lone, (lone + 1) % 3, (lone + 2) % 3];
}

/** Return both branches of Σ q_i²/(λ − I_i) = 0 on the unit sphere; I in any order. */
export function spheroconicLine(I: number[], lambda: number): Point[][] {
  const weights = I.map((entry) => 1 / (lambda - entry));
  const places = loneOf(weights);
  if (!places) return [];
  const sizes = weights.map((x) => 1 / Math.sqrt(Math.abs(x)));
  return [1, -1].map((sign) =>
    curve(200, (turns) => {
      const angle = 2 * Math.PI * turns;
      const point: Point = [0, 0, 0];
      [sign, Math.cos(angle), Math.sin(angle)].forEach((x, k) => (point[places[k]] = x * sizes[places[k]]));
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

/** Return the sheets of Σ X_i²/(A_i − μ) = 1, with coordinates divided by `scale`. */
export function confocalQuadric(A: number[], mu: number, scale: number, colour: string): Mesh[] {
  const d = A.map((entry) => entry - mu);
  const places = loneOf(d);
  if (!places) return [];
  // Around the lone axis: one sheet where that has no points, else a sheet on each side.
  const two = d[places[0]] > 0;
  const [axis, second, third] = places.map(
    (i) => new Vector3(...[0, 0, 0].with(i, Math.sqrt(Math.abs(d[i])) / scale)),
  );
  return (two ? [1, -1] : [1]).map((side) => {
    const profile = Array.from({ length: 37 }, (_, k) => {
      const h = two ? (1.1 * k) / 36 : 1.1 * (k / 18 - 1);
      return two ? new Vector2(Math.sinh(h), side * Math.cosh(h)) : new Vector2(Math.cosh(h), Math.sinh(h));
    });
    const geometry = new LatheGeometry(profile, 72);
    geometry.applyMatrix4(new Matrix4().makeBasis(second, axis, third));
    return surface(geometry, colour, { opacity: 0.26 });
  });
}
