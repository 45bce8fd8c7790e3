/** The ball on its plane: contact path, horizontal momentum, mean velocity and its line. */
import { GridHelper, Group, Mesh, MeshStandardMaterial, PlaneGeometry, SphereGeometry } from "three";
import { apply, dot } from "../evaluator/linear_algebra.ts";
import { STRETCH_LENGTH } from "../evaluator/series_motion.ts";
import { numberOf } from "../page/systems.ts";
import { arrow, line, place, type Point } from "./shapes.ts";
import { type Scenery, View3D } from "./stage.ts";
import { BLUE, GREEN, ORANGE, theme, VERMILION } from "./theme.ts";
import { TrailLine } from "./trail_line.ts";
import { type Loaded, overSphere, short } from "./view.ts";

/** Components along e_2 and e_3. */
type Plane = [number, number];

export class BallView extends View3D {
  constructor() {
    super("ball", "Rolling ball", [6.0, -10.4, 6.8]);
  }

  override refusal({ motion, problem }: Loaded): string | null {
    if (!motion.at(0).position.length || overSphere(problem)) return "";
    return motion.n === 3 ? null : "A ball in more than three dimensions is not drawn.";
  }

  build(loaded: Loaded): Scenery {
    const { dark } = theme();
    const a = numberOf(loaded.problem.radius) || 1;
    const rolling = painted(a, dark);
    const floor = grid(a);
    this.world.add(floor, rolling);
    const known = loaded.motion.meanVelocity;
    const mean: Plane = known ? [known[0], known[1]] : meanOfStretch(loaded);
    const momentum = horizontalMomentum(loaded);
    // Of a mean over all times alone.
    const course = known ? courseOf(mean, momentum) : "";
    const span = known ? "" : " in the times known here";
    this.say(
      "The ball rolls on a plane; the blue line is where it has touched.",
      `Green: its mean velocity${span}. Orange: its momentum K, fixed in space. Caps: body axis E₃. ${course}`,
    );
    const ground = new Group();
    this.world.add(ground);
    const vectors: [string, string, Plane][] = [["mean velocity", GREEN, mean], ["momentum K", ORANGE, momentum]];
    const named = vectors.flatMap(([text, colour, along]) => {
      const at = direction(along, a);
      if (!at) return [];
      const made = arrow(colour, 1.6 * a, at(1), 0.25 * a);
      // From where the ball ends.
      made.position.set(...at(1.1, 0.06));
      ground.add(made);
      if (colour === GREEN) ground.add(line([at(-20, 0.03), at(10, 0.03)], GREEN));
      return [{ text, at: at(2.95) }];
    });
    // Places are kept relative to the newest point of the trail, so that single precision is enough.
    let origin: Plane = [0, 0];
    const touching = (position: ArrayLike<number>, row = 0): Point => {
      const [u, v] = origin;
      return [position[2 * row] - u, position[2 * row + 1] - v, 0.012 * a];
    };
    this.follow({ trail: new TrailLine(BLUE), place: ({ position }, row) => touching(position, row) });
    const { camera, controls } = this;
    camera.position.normalize().multiplyScalar(this.distance * a).add(controls.target);
    return {
      extend: ({ position }, anew) => {
        if (anew) origin = [position[position.length - 2], position[position.length - 1]];
      },
      show: ({ frame, position }) => {
        const [x, y] = touching(position);
        place(rolling, frame, 3, [x, y, a]);
        ground.position.set(x, y, 0);
        // The floor goes on by whole meshes.
        floor.position.set(Math.round(x / a) * a, Math.round(y / a) * a, 0);
        const moved = camera.position.clone().sub(controls.target);
        controls.target.set(x, y, 0.5 * a);
        camera.position.copy(moved.add(controls.target));
        camera.lookAt(controls.target);
      },
      labels: () =>
        named.map(({ text, at: [u, v] }) => ({ text, at: [u + ground.position.x, v + ground.position.y, 0] })),
      describe: ({ position, q }) =>
        [
          `The contact point is (${short(position[0], 6)}, ${short(position[1], 6)}).`,
          `Its mean velocity is ${textOf(mean)}.`,
          ...(Math.hypot(...momentum) > 1e-9 ? [`The horizontal momentum K is ${textOf(momentum)}.`] : []),
          course,
          `The vertical in the body is ${textOf(q)}.`,
        ].join(" "),
    };
  }
}

/** Return the points on the ground along a vector, at multiples of a and a height; null of zero. */
function direction([u, v]: Plane, a: number): ((s: number, up?: number) => Point) | null {
  const size = Math.hypot(u, v);
  return size > 1e-9 ? (s, up = 0) => [(s * a * u) / size, (s * a * v) / size, up * a] : null;
}

/** Return a vector as text; an entry that is next to nothing is 0. */
const textOf = (values: ArrayLike<number>): string =>
  `(${Array.from(values, (entry) => short(Math.abs(entry) < 1e-12 ? 0 : entry)).join(", ")})`;

/** Return how a ball goes on with a mean velocity and a horizontal momentum, in a sentence. */
function courseOf([u, v]: Plane, [k, l]: Plane): string {
  const size = Math.hypot(k, l);
  if (!(size > 1e-9)) return "";
  const along = (u * k + v * l) / size;
  return Math.abs(along) > 1e-9 * Math.hypot(u, v)
    ? `By a resonance it drifts along K, by ${short(along)} a unit of time.`
    : "It goes on across K and keeps to a strip.";
}

/**
 * Return the horizontal momentum about the contact point, along e_2 and e_3, in which it is fixed:
 * that of JΩ with J = I + ma², since K − JΩ is vertical.
 */
function horizontalMomentum({ motion, problem }: Loaded): Plane {
  if (motion.body) return motion.body.horizontalMomentum;
  const { frame, Omega } = motion.at(0);
  const added = numberOf(problem.mass) * numberOf(problem.radius) ** 2;
  const moments = Array.isArray(problem.inertia) ? (problem.inertia as unknown[]) : [];
  const inertia = moments.map((row, i) =>
    Array.isArray(row) ? row.map(numberOf) : moments.map((_, j) => (i === j ? numberOf(row) : 0)),
  );
  const momentum = apply(inertia, Omega).map((entry, i) => entry + added * Omega[i]);
  if (momentum.length !== 3 || !momentum.every(Number.isFinite)) return [0, 0];
  const along = (j: number) => dot(momentum, [0, 1, 2].map((i) => frame[3 * i + j]));
  return [along(1), along(2)];
}

/** Return the mean velocity of the contact point over the times that series have. */
function meanOfStretch({ motion, range }: Loaded): Plane {
  const [first, last] = range ?? [0, STRETCH_LENGTH];
  const [far, near] = [motion.at(last - 1e-9).position, motion.at(first).position];
  if (!far.length) return [0, 0];
  return [(far[0] - near[0]) / (last - first), (far[1] - near[1]) / (last - first)];
}

/** Return a ball whose octants have two colours in turn, and a cap at both ends of E_3. */
export function painted(radius: number, dark: boolean, opacity = 1): Group {
  const group = new Group();
  const add = (geometry: SphereGeometry, color: string) => {
    const look = { roughness: 0.4, opacity, transparent: opacity < 1, depthWrite: opacity === 1 };
    group.add(new Mesh(geometry, new MeshStandardMaterial({ color, ...look })));
  };
  const quarter = Math.PI / 2;
  for (let k = 0; k < 8; k++) {
    const [across, down] = [(k % 4) * quarter, k < 4 ? 0 : quarter];
    const colour = (k + (k >> 2)) % 2 ? BLUE : dark ? "#e8eef5" : "#f4f7fa";
    add(new SphereGeometry(radius, 24, 32, across, quarter, down, quarter), colour);
  }
  for (const turn of [1, -1]) {
    const cap = new SphereGeometry(1.003 * radius, 48, 8, 0, 2 * Math.PI, 0, 0.27);
    add(cap.rotateX(turn * quarter), VERMILION);
  }
  return group;
}

/** Return a floor with lines at distances of one radius. */
function grid(radius: number): Group {
  const { dark, line: rule } = theme();
  const size = 28 * radius;
  const ground = new MeshStandardMaterial({ color: dark ? "#1b232e" : "#e3e8ee", roughness: 1 });
  const plane = new Mesh(new PlaneGeometry(size, size), ground);
  plane.position.z = -0.02 * radius;
  const lines = new GridHelper(size, 28, rule, rule);
  lines.rotateX(Math.PI / 2);
  Object.assign(lines.material, { opacity: 0.7, transparent: true, depthWrite: false });
  lines.renderOrder = 2;
  return new Group().add(plane, lines);
}
