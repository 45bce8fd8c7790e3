/** The shortest geodesic between two points that are dragged, its conjugate point, the cut locus. */
import { Raycaster, Vector2, Vector3 } from "three";
import { type Degrees, toGeodetic, toPoint } from "../evaluator/geodetic.ts";
import { ball, ellipsoid, line, type Point } from "./shapes.ts";
import { type Scenery, View3D } from "./stage.ts";
import { BLUE, GREEN, ORANGE, PINK, theme, VERMILION } from "./theme.ts";

/** What is drawn; points as they lie in space, in the unit of the semiaxes. */
export interface Drawn {
  semiaxes: Point;
  P: Degrees;
  Q: Degrees;
  /** From P to Q, and from Q to the conjugate point; empty before the answer. */
  way: Point[];
  beyond: Point[];
  conjugate: Point | null;
  cut: Point[];
}

/** Units of length around a point in which it is taken. */
const NEAR = 26;

export class GeodesicView extends View3D<Drawn> {
  #drawn: Drawn | null = null;
  #held: "P" | "Q" | null = null;
  readonly #moved: (name: "P" | "Q", to: Degrees) => void;

  constructor(moved: (name: "P" | "Q", to: Degrees) => void) {
    super("geodesic", "Ellipsoid", [2.6, 2.6, 1.9]);
    this.#moved = moved;
    this.say(
      "Orange: the shortest way from P to Q. Ways from P are the shortest until they meet the pink line, the cut locus.",
      "Green: the way on, to the conjugate point, where neighbours from P cross it. Drag P and Q, or beside them to turn.",
    );
    // Before the controls, which turn the scene, hear of it.
    this.canvas.addEventListener("pointerdown", (event) => this.#take(event), { capture: true });
    this.canvas.addEventListener("pointermove", (event) => this.#drag(event));
    for (const end of ["pointerup", "pointercancel"]) {
      this.canvas.addEventListener(end, () => {
        this.#held = null;
        this.controls.enabled = true;
      });
    }
  }

  build(drawn: Drawn): Scenery {
    this.#drawn = drawn;
    const { semiaxes, P, Q, way, beyond, conjugate, cut } = drawn;
    const scaled = semiaxes.map((x) => x / this.#scale);
    this.world.add(ellipsoid(scaled, theme().skin, { opacity: 0.6 }));
    for (const [points, colour] of [[way, ORANGE], [beyond, GREEN], [cut, PINK]] as const) {
      if (points.length > 1) this.world.add(line(points.map((X) => this.#outside(X)), colour));
    }
    const dots: [Point | null | undefined, string, number][] = [
      [toPoint(P, semiaxes), VERMILION, 0.035],
      [toPoint(Q, semiaxes), BLUE, 0.035],
      [conjugate, GREEN, 0.025],
      [cut.at(0), PINK, 0.015],
      [cut.at(-1), PINK, 0.015],
    ];
    for (const [at, colour, radius] of dots) {
      if (at) this.world.add(ball(colour, radius, this.#outside(at)));
    }
    this.stale = true;
    const names = Object.entries({ P, Q });
    const labels = names.map(([text, at]) => ({ text, at: this.#outside(toPoint(at, semiaxes), 1.12) }));
    return { labels: () => labels, describe: () => "" };
  }

  get #scale(): number {
    return Math.max(...this.#drawn!.semiaxes);
  }

  /** Return a point in the scene, slightly above the surface, which would cut lines. */
  #outside(X: Point, factor = 1.004): Point {
    return X.map((x) => (factor * x) / this.#scale) as Point;
  }

  /** Take the point under the pointer, if there is one on this side. */
  #take(event: PointerEvent): void {
    if (!this.#drawn) return;
    const { P, Q, semiaxes } = this.#drawn;
    const { width, height } = this.canvas.getBoundingClientRect();
    const away = (place: Degrees) => {
      const X = toPoint(place, semiaxes);
      const normal = new Vector3(...X.map((x, i) => x / semiaxes[i] ** 2));
      const at = new Vector3(...this.#outside(X, 1));
      if (normal.dot(this.camera.position.clone().sub(at)) < 0) return Infinity;
      const { x, y } = at.project(this.camera).sub(new Vector3(...this.#pointer(event), 0));
      return Math.hypot((x * width) / 2, (y * height) / 2);
    };
    const held = away(Q) <= away(P) ? "Q" : "P";
    if (away(held === "Q" ? Q : P) > NEAR) return;
    this.#held = held;
    this.controls.enabled = false;
    this.canvas.setPointerCapture(event.pointerId);
  }

  #drag(event: PointerEvent): void {
    if (!this.#held || !this.#drawn) return;
    const { semiaxes } = this.#drawn;
    const caster = new Raycaster();
    caster.setFromCamera(new Vector2(...this.#pointer(event)), this.camera);
    // In units of the semiaxes the ellipsoid is the unit sphere.
    const unit = new Vector3(...semiaxes).divideScalar(this.#scale);
    const origin = caster.ray.origin.clone().divide(unit);
    const along = caster.ray.direction.clone().divide(unit).normalize();
    const middle = -origin.dot(along);
    const left = 1 - (origin.lengthSq() - middle * middle);
    // Beside the ellipsoid it is the point of the rim.
    const at = origin.addScaledVector(along, middle - Math.sqrt(Math.max(left, 0))).normalize();
    this.#moved(this.#held, toGeodetic(at.multiply(unit).toArray(), semiaxes));
  }

  /** Return where a pointer is, from −1 to 1. */
  #pointer(event: PointerEvent): [number, number] {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    return [(2 * (event.clientX - left)) / width - 1, 1 - (2 * (event.clientY - top)) / height];
  }
}
