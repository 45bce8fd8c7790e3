/** The ball on its plane: contact path, horizontal momentum, mean velocity and its line. */
import { type ArrowHelper, BufferAttribute, Color, Group, type Line, Mesh } from "three";
import { MeshStandardMaterial, PlaneGeometry, SphereGeometry } from "three";
import { apply, dot } from "../evaluator/linear_algebra.ts";
import type { Sample } from "../evaluator/motion.ts";
import type { Samples } from "../evaluator/samples.ts";
import { STRETCH_LENGTH } from "../evaluator/series_motion.ts";
import { numberOf } from "../page/systems.ts";
import { aim, arrow, line, type Point } from "./shapes.ts";
import { type Label, View3D } from "./stage.ts";
import { BLUE, GREEN, ORANGE, theme, VERMILION } from "./theme.ts";
import { TrailLine } from "./trail_line.ts";
import { type Loaded, overSphere, short } from "./view.ts";

/** Components along e_2 and e_3. */
type Plane = [number, number];

/** The distance between lines of the plane, in radii. */
const MESH = 1;

export class BallView extends View3D {
  #radius = 1;
  #ball = new Group();
  #plane = new Group();
  /** The arrows of momentum and mean velocity, with their unit vectors. */
  #arrows: { name: string; made: ArrowHelper; unit: Plane }[] = [];
  #drift: Line | null = null;
  #mean: Plane = [0, 0];
  #momentum: Plane = [0, 0];
  /** How the ball goes on, in a sentence; empty where its mean over all times is not known. */
  #course = "";
  #origin: Plane = [0, 0];

  constructor() {
    super("ball", "Rolling ball", [6.0, -10.4, 6.8]);
  }

  refusal({ motion, problem }: Loaded): string | null {
    if (!motion.at(0).position.length || overSphere(problem)) return "";
    return motion.n === 3 ? null : "A ball in more than three dimensions is not drawn.";
  }

  build(loaded: Loaded): void {
    this.clear();
    const colours = theme();
    this.#radius = Number(loaded.problem.radius) || 1;
    this.#ball = new Group();
    this.#ball.matrixAutoUpdate = false;
    this.#ball.add(painted(this.#radius, colours.dark));
    // The plane goes on by whole meshes.
    this.#plane = grid(this.#radius, colours.line, colours.dark ? "#1b232e" : "#e3e8ee");
    this.world.add(this.#plane, this.#ball);
    this.follow({ trail: new TrailLine(BLUE), place: ({ position }, row) => this.#touching(position, row) });
    const mean = loaded.motion.meanVelocity;
    this.#mean = mean ? [mean[0], mean[1]] : meanOfStretch(loaded);
    this.#momentum = horizontalMomentum(loaded);
    this.#course = loaded.motion.meanVelocity ? courseOf(this.#mean, this.#momentum) : "";
    const span = mean ? "" : " in the times known here";
    this.say(
      "The ball rolls on a plane; the blue line is where it has touched.",
      `Green: its mean velocity${span}. Orange: its momentum K, fixed in space. Caps: body axis E₃. ${this.#course}`,
    );
    this.#drift = null;
    this.#arrows = [];
    this.#point("mean velocity", GREEN, this.#mean);
    this.#point("momentum K", ORANGE, this.#momentum);
    if (this.#arrows[0]?.name === "mean velocity") {
      const [u, v] = this.#arrows[0].unit.map((x) => x * this.#radius);
      this.#drift = line([-20, 10].map((s): Point => [s * u, s * v, 0.03 * this.#radius]), GREEN);
      this.world.add(this.#drift);
    }
    this.camera.position.normalize().multiplyScalar(this.distance * this.#radius);
    this.camera.position.add(this.controls.target);
  }

  /** Add an arrow on the ground along a vector, unless that is zero. */
  #point(name: string, colour: string, [u, v]: Plane): void {
    const size = Math.hypot(u, v);
    if (!(size > 1e-9)) return;
    const made = arrow(colour, 1.6 * this.#radius, 0.25 * this.#radius);
    aim(made, u, v, 0, 1.6 * this.#radius);
    this.#arrows.push({ name, made, unit: [u / size, v / size] });
    this.world.add(made);
  }

  override extend(samples: Samples, anew: boolean): void {
    if (!samples.position.length) return;
    if (anew) {
      // Places are kept relative to the newest point, so that single precision is enough.
      const last = samples.times.length - 1;
      this.#origin = [samples.position[2 * last], samples.position[2 * last + 1]];
    }
    super.extend(samples, anew);
  }

  /** Return the contact point of a row, a little above the plane. */
  #touching(position: ArrayLike<number>, row = 0): Point {
    const [u, v] = this.#origin;
    return [position[2 * row] - u, position[2 * row + 1] - v, 0.012 * this.#radius];
  }

  override show(sample: Sample): void {
    super.show(sample);
    const { frame, position } = sample;
    const a = this.#radius;
    const [x, y] = this.#touching(position);
    const E = (i: number, j: number) => frame[3 * i + j];
    this.#ball.matrix.set(
      ...([E(0, 1), E(1, 1), E(2, 1), x] as const),
      ...([E(0, 2), E(1, 2), E(2, 2), y] as const),
      ...([E(0, 0), E(1, 0), E(2, 0), a] as const),
      ...([0, 0, 0, 1] as const),
    );
    this.#ball.matrixWorldNeedsUpdate = true;
    const step = MESH * a;
    this.#plane.position.set(Math.round(x / step) * step, Math.round(y / step) * step, 0);
    const moved = this.camera.position.clone().sub(this.controls.target);
    this.controls.target.set(x, y, 0.5 * a);
    this.camera.position.copy(moved.add(this.controls.target));
    this.camera.lookAt(this.controls.target);
    // On the ground, from where the ball ends.
    for (const { made, unit } of this.#arrows) {
      made.position.set(x + 1.1 * a * unit[0], y + 1.1 * a * unit[1], 0.06 * a);
    }
    this.#drift?.position.set(x, y, 0);
  }

  protected override labels(): Label[] {
    return this.#arrows.map(({ name, made, unit }) => {
      const reach = 1.85 * this.#radius;
      const { x, y } = made.position;
      return { text: name, at: [x + reach * unit[0], y + reach * unit[1], 0] };
    });
  }

  describe({ position, q }: Sample): string {
    const vector = (values: ArrayLike<number>) =>
      `(${Array.from(values, (entry) => short(Math.abs(entry) < 1e-12 ? 0 : entry)).join(", ")})`;
    const momentum = Math.hypot(...this.#momentum) > 1e-9;
    return [
      `The contact point is (${short(position[0], 6)}, ${short(position[1], 6)}).`,
      `Its mean velocity is ${vector(this.#mean)}.`,
      ...(momentum ? [`The horizontal momentum K is ${vector(this.#momentum)}.`] : []),
      this.#course,
      `The vertical in the body is ${vector(q)}.`,
    ].join(" ");
  }
}

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
  const value = (entry: unknown) => numberOf(String(entry));
  const added = value(problem.mass) * value(problem.radius) ** 2;
  const moments = Array.isArray(problem.inertia) ? (problem.inertia as unknown[]) : [];
  const inertia = moments.map((row, i) =>
    Array.isArray(row) ? row.map(value) : moments.map((_, j) => (i === j ? value(row) : 0)),
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
export function painted(radius: number, dark: boolean, opacity = 1): Mesh {
  const look = { roughness: 0.4, opacity, transparent: opacity < 1, depthWrite: opacity === 1 };
  const geometry = new SphereGeometry(radius, 96, 64).toNonIndexed();
  const position = geometry.getAttribute("position");
  const shades = new Float32Array(3 * position.count);
  const [even, odd] = [new Color(BLUE), new Color(dark ? "#e8eef5" : "#f4f7fa")];
  for (let corner = 0; corner < position.count; corner += 3) {
    const centre = [0, 1, 2].map((axis) => {
      const array = [position.getX, position.getY, position.getZ][axis];
      return [0, 1, 2].reduce((sum, k) => sum + array.call(position, corner + k), 0);
    });
    const shade = centre.filter((x) => x > 0).length % 2 ? even : odd;
    for (let k = 0; k < 3; k++) shade.toArray(shades, 3 * (corner + k));
  }
  geometry.setAttribute("color", new BufferAttribute(shades, 3));
  const ball = new Mesh(geometry, new MeshStandardMaterial({ vertexColors: true, ...look }));
  for (const turn of [1, -1]) {
    const cap = new SphereGeometry(1.003 * radius, 48, 8, 0, 2 * Math.PI, 0, 0.27);
    cap.rotateX((turn * Math.PI) / 2);
    ball.add(new Mesh(cap, new MeshStandardMaterial({ color: VERMILION, ...look })));
  }
  return ball;
}

function grid(radius: number, rule: string, ground: string): Group {
  const group = new Group();
  const half = 14 * radius;
  const floor = new MeshStandardMaterial({ color: ground, roughness: 1 });
  const plane = new Mesh(new PlaneGeometry(2 * half, 2 * half), floor);
  plane.position.z = -0.02 * radius;
  group.add(plane);
  for (let k = -14; k <= 14; k++) {
    const at = k * MESH * radius;
    group.add(line([[at, -half, 0], [at, half, 0]], rule, 0.7));
    group.add(line([[-half, at, 0], [half, at, 0]], rule, 0.7));
  }
  return group;
}
