/** The ball on its plane: contact path, horizontal momentum, and the line of its mean drift. */
import { Group, Mesh, MeshStandardMaterial, PlaneGeometry, SphereGeometry } from "three";
import { BufferAttribute, Color } from "three";
import type { ArrowHelper, Line, Object3D } from "three";
import type { Sample } from "../evaluator/motion.ts";
import type { Samples } from "../evaluator/samples.ts";
import { STRETCH_LENGTH } from "../evaluator/series_motion.ts";
import { aim, arrow, line, moveLine } from "./shapes.ts";
import type { Point } from "./shapes.ts";
import { View3D } from "./stage.ts";
import type { Label } from "./stage.ts";
import { BLUE, GREEN, ORANGE, theme, VERMILION } from "./theme.ts";
import { TrailLine } from "./trail_line.ts";
import { short } from "./view.ts";
import type { Loaded } from "./view.ts";

/** The distance between lines of the plane, in radii. */
const MESH = 1;

export class BallView extends View3D {
  #radius = 1;
  #ball = new Group();
  #plane = new Group();
  #trail: TrailLine | null = null;
  #momentum: ArrowHelper | null = null;
  #drift: Line | null = null;
  #mean: [number, number] = [0, 0];
  #origin: [number, number] = [0, 0];

  constructor() {
    super(
      "ball",
      "Rolling ball",
      "The contact point draws its path (blue). Green: the line of its mean velocity (arrow).",
      [4.4, -7.6, 5.0],
    );
  }

  refusal({ motion }: Loaded): string | null {
    return motion.at(0).position ? null : "This system does not roll: choose a ball.";
  }

  build(loaded: Loaded): void {
    this.clear();
    const colours = theme();
    this.#radius = Number(loaded.problem.radius) || 1;
    this.#ball = new Group();
    this.#ball.matrixAutoUpdate = false;
    this.#ball.add(painted(this.#radius, colours.dark));
    this.#plane = grid(this.#radius, colours.line, colours.dark ? "#1b232e" : "#e3e8ee");
    this.#trail = new TrailLine(10000, BLUE);
    this.#momentum = arrow(ORANGE, 1.6 * this.#radius, 0.25 * this.#radius);
    this.#drift = line(alongDrift(0, 0, 1, 0, 1), GREEN);
    this.world.add(this.#plane, this.#ball, this.#trail.object, this.#momentum, this.#drift);
    this.#mean = meanVelocity(loaded);
    this.camera.position.normalize().multiplyScalar(this.distance * this.#radius);
    this.camera.position.add(this.controls.target);
  }

  override extend(samples: Samples, anew: boolean): void {
    if (!samples.position.length) return;
    if (anew) {
      // Places are kept relative to the newest point, so that single precision is enough.
      const last = samples.times.length - 1;
      this.#origin = [samples.position[2 * last], samples.position[2 * last + 1]];
    }
    this.#trail?.extend(samples, anew, ({ position }, k) => [
      position[2 * k] - this.#origin[0],
      position[2 * k + 1] - this.#origin[1],
      0.012 * this.#radius,
    ]);
  }

  show({ frame, position }: Sample): void {
    if (!position) return;
    const a = this.#radius;
    const x = position[0] - this.#origin[0];
    const y = position[1] - this.#origin[1];
    const E = (i: number, j: number) => frame[3 * i + j];
    this.#ball.matrix.set(
      ...([E(0, 1), E(1, 1), E(2, 1), x] as const),
      ...([E(0, 2), E(1, 2), E(2, 2), y] as const),
      ...([E(0, 0), E(1, 0), E(2, 0), a] as const),
      ...([0, 0, 0, 1] as const),
    );
    this.#ball.matrixWorldNeedsUpdate = true;
    this.#trail?.lead([x, y, 0.012 * a]);
    const step = MESH * a;
    this.#plane.position.set(Math.round(x / step) * step, Math.round(y / step) * step, 0);
    const moved = this.camera.position.clone().sub(this.controls.target);
    this.controls.target.set(x, y, 0.5 * a);
    this.camera.position.copy(moved.add(this.controls.target));
    this.camera.lookAt(this.controls.target);
    const [u, v] = this.#mean;
    const size = Math.hypot(u, v);
    if (this.#momentum && this.#drift) {
      aim(this.#momentum, u, v, 0, 1.6 * a);
      // On the ground, from where the ball ends.
      const ahead = size > 0 ? (1.1 * a) / size : 0;
      this.#momentum.position.set(x + ahead * u, y + ahead * v, 0.06 * a);
      this.#drift.visible = size > 0;
      if (size > 0) moveLine(this.#drift, alongDrift(x, y, u / size, v / size, a));
    }
  }

  protected override labels(): Label[] {
    if (!this.#momentum?.visible) return [];
    const [u, v] = this.#mean;
    const reach = (1.85 * this.#radius) / Math.hypot(u, v);
    const { x, y } = this.#momentum.position;
    return [{ text: "mean velocity", at: [x + reach * u, y + reach * v, 0] }];
  }

  override actors(): Object3D[] {
    return [this.#ball];
  }

  override pen({ position }: Sample): Point | null {
    if (!position) return null;
    const [x, y] = this.#origin;
    return [position[0] - x, position[1] - y, 0.012 * this.#radius];
  }

  describe({ position, q }: Sample): string {
    if (!position) return "";
    const [u, v] = this.#mean;
    return (
      `The contact point is (${short(position[0], 6)}, ${short(position[1], 6)}). ` +
      `Its mean velocity is (${short(u)}, ${short(v)}). The vertical in the body is ` +
      `(${Array.from(q, (entry) => short(entry)).join(", ")}).`
    );
  }
}

/** Return points of the line through the contact point along a unit vector, one each radius. */
function alongDrift(x: number, y: number, u: number, v: number, a: number): Point[] {
  return Array.from({ length: 31 }, (_, k): Point => {
    const s = (k - 20) * a;
    return [x + s * u, y + s * v, 0.03 * a];
  });
}

/** Return the mean velocity of the contact point over a long time. */
function meanVelocity({ motion, reach, range }: Loaded): [number, number] {
  const known: [number, number] = motion.genus ? [0, 4 * reach] : [0, STRETCH_LENGTH];
  const [first, last] = range ?? known;
  const [far, near] = [motion.at(last - 1e-9).position, motion.at(first).position];
  if (!far || !near) return [0, 0];
  return [(far[0] - near[0]) / (last - first), (far[1] - near[1]) / (last - first)];
}

/** Return a ball whose octants have two colours in turn, and a cap at the end of each axis. */
function painted(radius: number, dark: boolean): Mesh {
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
  const ball = new Mesh(geometry, new MeshStandardMaterial({ vertexColors: true, roughness: 0.4 }));
  for (const turn of [1, -1]) {
    const cap = new SphereGeometry(1.003 * radius, 48, 8, 0, 2 * Math.PI, 0, 0.27);
    cap.rotateX((turn * Math.PI) / 2);
    ball.add(new Mesh(cap, new MeshStandardMaterial({ color: VERMILION, roughness: 0.4 })));
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
