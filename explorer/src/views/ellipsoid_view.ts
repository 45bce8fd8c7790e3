/**
 * The geodesic on Σ X_i²/A_i = 1 with X = Aq/√(q,Aq), (Gauss): its tangent lines touch the confocal
 * quadric of μ = 1/c_2 (Chasles).
 */
import type { Line, Mesh } from "three";
import type { Sample } from "../evaluator/motion.ts";
import { confocalQuadric } from "./conics.ts";
import { ball, ellipsoid, line, type Point, stretch } from "./shapes.ts";
import { View3D } from "./stage.ts";
import { ORANGE, PINK, theme, VERMILION } from "./theme.ts";
import { TrailLine } from "./trail_line.ts";
import { isGeodesic, list, type Loaded, short } from "./view.ts";

export class EllipsoidView extends View3D {
  #A: number[] = [];
  #scale = 1;
  #mu: number | null = null;
  #touch: Mesh | null = null;
  #tangent: Line | null = null;

  constructor() {
    super("ellipsoid", "Ellipsoid", [2.5, -3.0, 1.7]);
  }

  refusal(loaded: Loaded): string | null {
    const { torusA: A, motion } = loaded;
    if (!isGeodesic(loaded)) {
      return "A geodesic needs a body or ball with (Ω,γ) = 0 and no potential, or Neumann's system with F₀ = 0.";
    }
    if (A.length !== motion.n || !motion.moments.length) return "Only an A along the axes has its ellipsoid drawn.";
    return motion.n >= 3 ? null : "In two dimensions the ellipsoid is an ellipse.";
  }

  build({ torusA: A, torus, problem }: Loaded): void {
    this.clear();
    const colours = theme();
    this.#A = A;
    const umbilic = umbilics(A);
    this.#scale = Math.sqrt(Math.max(...A));
    const half = A.map((entry) => Math.sqrt(entry) / this.#scale);
    const c2 = torus && A.length === 3 ? torus.constants.at(-1) : undefined;
    this.#mu = c2 ? 1 / c2 : null;
    this.world.add(ellipsoid(half, colours.skin, { opacity: 0.6 }));
    if (this.#mu !== null) {
      const quadric = confocalQuadric(A, this.#mu, this.#scale, ORANGE);
      this.world.add(quadric);
      // In a plane of symmetry the quadric is flat, and nothing is drawn of it.
      if (!quadric.children.length) this.#mu = null;
    }
    const shadow = A.length > 3 ? "Three of its components are drawn. " : "";
    const touch = this.#mu === null ? "" : ", which touches one orange surface for ever (Chasles)";
    const pink = umbilic.length ? " Pink: umbilics." : "";
    const what = problem.system === "ellipsoid-geodesic" ? "A point X" : "The same motion, as a point X";
    this.say(
      `${what} that follows the straightest path, a geodesic, on an ellipsoid.`,
      `${shadow}Orange line: its tangent${touch}.${pink} Large dot: this moment.`,
    );
    for (const place of umbilic) {
      this.world.add(ball(PINK, 0.022, place.map((x) => x / this.#scale) as Point));
    }
    this.#touch = ball(ORANGE, 0.03);
    this.#tangent = line([[0, -1, 0], [0, 1, 0]], ORANGE);
    this.world.add(this.#touch, this.#tangent);
    this.follow({
      trail: new TrailLine(colours.trail),
      place: ({ q }, row) => {
        const [x, y, z] = this.#position(q.subarray(row * A.length, (row + 1) * A.length));
        return [1.004 * x, 1.004 * y, 1.004 * z];
      },
      dot: ball(VERMILION, 0.035),
      name: "X",
    });
  }

  /** Return X/scale. */
  #position(q: ArrayLike<number>): number[] {
    const size = Math.sqrt(this.#A.reduce((sum, a, i) => sum + a * q[i] * q[i], 0));
    return this.#A.map((a, i) => (a * q[i]) / (size * this.#scale));
  }

  override show(sample: Sample): void {
    super.show(sample);
    const { q, velocity } = sample;
    const X = this.#position(q);
    // dX/dt ∝ A q̇ (q,Aq) − A q (q,Aq̇).
    const size = this.#A.reduce((sum, a, i) => sum + a * q[i] * q[i], 0);
    const mixed = this.#A.reduce((sum, a, i) => sum + a * q[i] * velocity[i], 0);
    const D = this.#A.map((a, i) => a * (velocity[i] * size - q[i] * mixed));
    const length = Math.hypot(...D) || 1;
    const unit = D.map((x) => x / length);
    const at = (s: number): Point => [X[0] + s * unit[0], X[1] + s * unit[1], X[2] + s * unit[2]];
    const touch = this.#touchAt(X, unit);
    const reach = Math.max(1.2, Math.min(2.6, Math.abs(touch ?? 0) + 0.3));
    if (this.#tangent) {
      this.#tangent.visible = D.some(Boolean);
      // In four dimensions the shadow of the tangent, which is shorter.
      const [x, y, z] = unit;
      const part = Math.hypot(x, y, z) || 1;
      stretch(this.#tangent, at(0), [x / part, y / part, z / part], part * reach);
    }
    if (this.#touch) {
      this.#touch.visible = touch !== null && Math.abs(touch) < 2.6;
      this.#touch.position.set(...at(touch ?? 0));
    }
  }

  /** Return where along the tangent it touches the quadric. */
  #touchAt(X: number[], D: number[]): number | null {
    if (this.#mu === null) return null;
    const mu = this.#mu;
    let [a, b] = [0, 0];
    this.#A.forEach((entry, i) => {
      const weight = this.#scale ** 2 / (entry - mu);
      a += weight * D[i] * D[i];
      b += weight * X[i] * D[i];
    });
    return Number.isFinite(b / a) ? -b / a : null;
  }

  describe({ q }: Sample): string {
    const X = this.#position(q).map((x) => x * this.#scale);
    const quadric =
      this.#mu === null ? "" : ` The tangents touch the quadric of μ = 1/c₂ = ${short(this.#mu)}.`;
    return `X is (${list(X)}).${quadric}`;
  }
}

/** Return the four umbilics of an ellipsoid with three different axes. */
function umbilics(A: number[]): number[][] {
  if (A.length !== 3) return [];
  const order = [0, 1, 2].sort((i, j) => A[j] - A[i]);
  const [a, b, c] = order.map((i) => A[i]);
  if (a === b || b === c) return [];
  const [x, z] = [Math.sqrt((a * (a - b)) / (a - c)), Math.sqrt((c * (b - c)) / (a - c))];
  return [1, -1].flatMap((s) =>
    [1, -1].map((t) => {
      const point = [0, 0, 0];
      point[order[0]] = s * x;
      point[order[2]] = t * z;
      return point;
    }),
  );
}
