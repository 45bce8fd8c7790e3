/**
 * The geodesic on Σ X_i²/A_i = 1 with X = Aq/√(q,Aq), (Gauss): its tangent lines touch the confocal
 * quadric of μ = 1/c_2 (Chasles).
 */
import { Vector3 } from "three";
import { dot } from "../evaluator/linear_algebra.ts";
import { confocalQuadric } from "./conics.ts";
import { ball, ellipsoid, line, type Point } from "./shapes.ts";
import { type Scenery, View3D } from "./stage.ts";
import { ORANGE, PINK, theme, VERMILION } from "./theme.ts";
import { TrailLine } from "./trail_line.ts";
import { isGeodesic, list, type Loaded, short } from "./view.ts";

export class EllipsoidView extends View3D {
  constructor() {
    super("ellipsoid", "Ellipsoid", [2.5, -3.0, 1.7]);
  }

  override refusal(loaded: Loaded): string | null {
    const { torusA: A, motion } = loaded;
    if (!isGeodesic(loaded)) {
      return "A geodesic needs a body or ball with (Ω,γ) = 0 and no potential, or Neumann's system with F₀ = 0.";
    }
    if (A.length !== motion.n || !motion.moments.length) return "Only an A along the axes has its ellipsoid drawn.";
    return motion.n >= 3 ? null : "In two dimensions the ellipsoid is an ellipse.";
  }

  build({ torusA: A, torus, problem }: Loaded): Scenery {
    const { skin, trail } = theme();
    const scale = Math.sqrt(Math.max(...A));
    const c2 = torus && A.length === 3 ? torus.constants.at(-1) : undefined;
    // In a plane of symmetry the quadric is flat, and nothing is drawn of it.
    const quadric = c2 ? confocalQuadric(A, 1 / c2, scale, ORANGE) : [];
    const mu = quadric.length ? 1 / c2! : null;
    const pink = umbilics(A).map((place) => ball(PINK, 0.022, place.map((x) => x / scale) as Point));
    const half = A.map((entry) => Math.sqrt(entry) / scale);
    const touch = ball(ORANGE, 0.03);
    const tangent = line([[0, 0, 0], [0, 0, 0]], ORANGE);
    this.world.add(ellipsoid(half, skin, { opacity: 0.6 }), ...quadric, ...pink, touch, tangent);
    const shadow = A.length > 3 ? "Three of its components are drawn. " : "";
    const touches = mu === null ? "" : ", which touches one orange surface for ever (Chasles)";
    const what = problem.system === "ellipsoid-geodesic" ? "A point X" : "The same motion, as a point X";
    this.say(
      `${what} that follows the straightest path, a geodesic, on an ellipsoid.`,
      `${shadow}Orange line: its tangent${touches}.${pink.length ? " Pink: umbilics." : ""} Large dot: this moment.`,
    );
    /** Return X. */
    const pointOf = (q: ArrayLike<number>) => {
      const size = Math.sqrt(A.reduce((sum, a, i) => sum + a * q[i] * q[i], 0));
      return A.map((a, i) => (a * q[i]) / size);
    };
    this.follow({
      trail: new TrailLine(trail),
      place: ({ q }, row) => {
        const X = pointOf(q.subarray(row * A.length, (row + 1) * A.length));
        return X.slice(0, 3).map((x) => (1.004 * x) / scale) as Point;
      },
      dot: ball(VERMILION, 0.035),
      name: "X",
    });
    return {
      show: ({ q, velocity }) => {
        const X = pointOf(q).map((x) => x / scale);
        const unit = directionOf(A, q, velocity);
        const at = (s: number) => new Vector3(...X.map((x, i) => x + s * unit[i]).slice(0, 3));
        const weights = A.map((a) => 1 / (a - (mu ?? 0)));
        // Where along the tangent it touches the quadric.
        const [a, b] = [unit, X].map((one) => dot(weights, one.map((x, i) => x * unit[i])));
        const found = mu === null || !Number.isFinite(b / a) ? null : -b / a;
        const reach = Math.max(1.2, Math.min(2.6, Math.abs(found ?? 0) + 0.3));
        tangent.geometry.setFromPoints([at(-reach), at(reach)]);
        touch.visible = found !== null && Math.abs(found) < 2.6;
        touch.position.copy(at(found ?? 0));
      },
      describe: ({ q }) => {
        const touched = mu === null ? "" : ` The tangents touch the quadric of μ = 1/c₂ = ${short(mu)}.`;
        return `X is (${list(pointOf(q))}).${touched}`;
      },
    };
  }
}

/** Return the unit vector along dX/dt ∝ A q̇ (q,Aq) − A q (q,Aq̇), zero at rest. */
function directionOf(A: number[], q: ArrayLike<number>, velocity: ArrayLike<number>): number[] {
  const Aq = A.map((a, i) => a * q[i]);
  const [size, mixed] = [dot(Aq, q), dot(Aq, velocity)];
  const along = A.map((a, i) => a * (velocity[i] * size - q[i] * mixed));
  const length = Math.hypot(...along) || 1;
  return along.map((x) => x / length);
}

/** Return the four umbilics of an ellipsoid with three different axes. */
function umbilics(A: number[]): number[][] {
  if (A.length !== 3) return [];
  const order = [0, 1, 2].sort((i, j) => A[j] - A[i]);
  const [a, b, c] = order.map((i) => A[i]);
  if (a === b || b === c) return [];
  const [x, z] = [Math.sqrt((a * (a - b)) / (a - c)), Math.sqrt((c * (b - c)) / (a - c))];
  return [1, -1].flatMap((s) => [1, -1].map((t) => [0, 0, 0].with(order[0], s * x).with(order[2], t * z)));
}
