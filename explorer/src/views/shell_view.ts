/** A ball over a fixed sphere: both surfaces, with the path of the contact point on each. */
import { numberOf } from "../page/systems.ts";
import { painted } from "./ball_view.ts";
import { ball, ellipsoid, place, type Point } from "./shapes.ts";
import { type Label, type Scenery, View3D } from "./stage.ts";
import { ORANGE, theme, VERMILION } from "./theme.ts";
import { TrailLine } from "./trail_line.ts";
import { list, type Loaded, overSphere } from "./view.ts";

export class ShellView extends View3D {
  constructor() {
    super("shell", "Two spheres", [3.3, -4.4, 2.6]);
  }

  override refusal({ motion, problem }: Loaded): string | null {
    if (!overSphere(problem)) return "";
    return motion.n === 3 ? null : "A ball in more than three dimensions is not drawn.";
  }

  build({ problem }: Loaded): Scenery {
    const { dark } = theme();
    const [sigma, a] = [problem.sphere, problem.radius].map(numberOf);
    const where = String(problem.side ?? "outside");
    // The contact point is at −side·aγ from the centre of the ball.
    const side = where === "outside" ? 1 : -1;
    // The unit of the scene, and the radii of sphere and ball in it.
    const unit = where === "outside" ? sigma + a : Math.max(sigma, a);
    const [sphere, radius] = [sigma / unit, a / unit];
    // What is around the other is drawn as glass.
    const rolling = painted(radius, dark, where === "around" ? 0.3 : 1);
    const opacity = where === "inside" ? 0.25 : 1;
    this.world.add(ellipsoid([sphere, sphere, sphere], dark ? "#46586e" : "#b9c6d3", { opacity }), rolling);
    /** Return a multiple of a contact point, along e_2, e_3, e_1. */
    const inScene = (position: ArrayLike<number>, factor: number, from = 0) =>
      [1, 2, 0].map((j) => (factor / unit) * position[from + j]) as Point;
    this.follow({
      trail: new TrailLine(ORANGE),
      // A little off the sphere.
      place: ({ position }, row) => inScene(position, 1 + 0.006 * side, 3 * row),
      dot: ball(VERMILION, 0.03),
    });
    const onBall = new TrailLine(VERMILION);
    const reach = -1.006 * side * radius;
    this.follow({ trail: onBall, place: ({ q }, row) => [0, 1, 2].map((i) => reach * q[3 * row + i]) as Point });
    rolling.add(onBall.object);
    const who = where === "around" ? "A shell rolls around a fixed sphere" : `A ball rolls ${where} a fixed sphere`;
    this.say(
      `${who}, without slipping or twisting.`,
      "Orange: where it has touched the sphere. Red: where on the ball. Dot: the contact point now.",
    );
    const end = 1.18 * sphere;
    const labels: Label[] = [
      { text: "e₁", at: [0, 0, end] },
      { text: "e₂", at: [end, 0, 0] },
      { text: "e₃", at: [0, end, 0] },
    ];
    return {
      labels: () => labels,
      // The centre is at σ ± a along the normal of the sphere.
      show: ({ frame, position }) => place(rolling, frame, 3, inScene(position, 1 + (side * a) / sigma)),
      describe: ({ position, q }) =>
        `The contact point is (${list(position)}) on the sphere. Its normal is (${list(q)}) in the body.`,
    };
  }
}
