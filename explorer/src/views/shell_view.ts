/** A ball over a fixed sphere: both surfaces, with the path of the contact point on each. */
import { Group } from "three";
import type { Sample } from "../evaluator/motion.ts";
import { numberOf } from "../page/systems.ts";
import { painted } from "./ball_view.ts";
import { ball, ellipsoid, type Point } from "./shapes.ts";
import { type Label, View3D } from "./stage.ts";
import { ORANGE, theme, VERMILION } from "./theme.ts";
import { TrailLine } from "./trail_line.ts";
import { list, overSphere } from "./view.ts";
import type { Loaded } from "./view.ts";

export class ShellView extends View3D {
  /** The radii of sphere and ball, in units of the scene. */
  #sphere = 1;
  #radius = 1;
  /** 1 for a ball outside of the sphere, else −1: the contact point is at −side·aγ from its centre. */
  #side = 1;
  /** The unit of the scene. */
  #unit = 1;
  #ball = new Group();

  constructor() {
    super("shell", "Ball over a sphere", [3.3, -4.4, 2.6]);
  }

  refusal({ motion, problem }: Loaded): string | null {
    if (!overSphere(problem)) return "";
    return motion.n === 3 ? null : "A ball in more than three dimensions is not drawn.";
  }

  build({ problem }: Loaded): void {
    this.clear();
    const dark = theme().dark;
    const [sigma, a] = [problem.sphere, problem.radius].map((given) => numberOf(String(given)));
    const side = String(problem.side ?? "outside");
    this.#side = side === "outside" ? 1 : -1;
    this.#unit = side === "outside" ? sigma + a : Math.max(sigma, a);
    [this.#sphere, this.#radius] = [sigma / this.#unit, a / this.#unit];
    // What is around the other is drawn as glass.
    const globe = Array<number>(3).fill(this.#sphere);
    const glass = side === "inside" ? 0.25 : 1;
    this.#ball = new Group();
    this.#ball.matrixAutoUpdate = false;
    this.#ball.add(painted(this.#radius, dark, side === "around" ? 0.3 : 1));
    this.world.add(ellipsoid(globe, dark ? "#46586e" : "#b9c6d3", { opacity: glass }), this.#ball);
    this.follow({
      trail: new TrailLine(ORANGE),
      place: ({ position }, row) => this.#inSpace(position, 3 * row),
      dot: ball(VERMILION, 0.03),
    });
    const onBall = new TrailLine(VERMILION);
    this.follow({ trail: onBall, place: ({ q }, row) => this.#inBody(q, 3 * row) });
    this.#ball.add(onBall.object);
    const where = side === "around" ? "A shell rolls around a fixed sphere" : `A ball rolls ${side} a fixed sphere`;
    this.say(
      `${where}, without slipping or twisting.`,
      "Orange: where it has touched the sphere. Red: where on the ball. Dot: the contact point now.",
    );
  }

  /** Return a contact point along e_2, e_3, e_1, a little off the sphere. */
  #inSpace(position: ArrayLike<number>, from = 0): Point {
    const scale = (1 + 0.006 * this.#side) / this.#unit;
    return [1, 2, 0].map((j) => scale * position[from + j]) as Point;
  }

  /** Return the contact point along the axes of the ball, from its centre. */
  #inBody(gamma: ArrayLike<number>, from = 0): Point {
    const reach = -1.006 * this.#side * this.#radius;
    return [0, 1, 2].map((i) => reach * gamma[from + i]) as Point;
  }

  override show(sample: Sample): void {
    super.show(sample);
    const { frame, position } = sample;
    // The centre is at σ ± a along the normal of the sphere.
    const away = (this.#sphere + this.#side * this.#radius) / this.#sphere / this.#unit;
    const row = (j: number) => [0, 1, 2].map((i) => frame[3 * i + j]).concat(away * position[j]);
    this.#ball.matrix.set(
      ...(row(1) as [number, number, number, number]),
      ...(row(2) as [number, number, number, number]),
      ...(row(0) as [number, number, number, number]),
      ...([0, 0, 0, 1] as const),
    );
    this.#ball.matrixWorldNeedsUpdate = true;
  }

  protected override labels(): Label[] {
    const end = 1.18 * this.#sphere;
    return [{ text: "e₁", at: [0, 0, end] }, { text: "e₂", at: [end, 0, 0] }, { text: "e₃", at: [0, end, 0] }];
  }

  describe({ position, q }: Sample): string {
    return `The contact point is (${list(position)}) on the sphere. Its normal is (${list(q)}) in the body.`;
  }
}
