/** q on the unit sphere: its trail, the net of spheroconic coordinates, the zone of the motion. */
import type { ArrowHelper } from "three";
import type { AreaBody } from "../evaluator/area_body.ts";
import type { Sample } from "../evaluator/motion.ts";
import { netValues, spheroconicLine } from "./conics.ts";
import { aim, arrow, ball, ellipsoid, line, type Point } from "./shapes.ts";
import { View3D } from "./stage.ts";
import { GREEN, ORANGE, PINK, theme, VERMILION } from "./theme.ts";
import { TrailLine } from "./trail_line.ts";
import type { Problem } from "../page/systems.ts";
import { list, type Loaded, originName, overSphere, short, type Torus } from "./view.ts";

export class SphereView extends View3D {
  #n = 3;
  /** With an area constant v is in the zone, in the place of q. */
  #body: AreaBody | null = null;
  #velocity: ArrowHelper | null = null;
  #zone = "";

  constructor() {
    super("sphere", "Sphere", [2.5, -3.0, 1.7]);
  }

  refusal({ motion }: Loaded): string | null {
    return motion.at(0).q.length ? null : "This system has no vector q.";
  }

  build({ motion, torus, torusA: A, problem }: Loaded): void {
    this.clear();
    const colours = theme();
    this.#body = motion.body;
    this.#n = motion.n;
    const I = A.length === 3 && motion.moments.length === 3 ? A.map((entry) => 1 / entry) : null;
    const edges = I && torus ? edgesOf(torus) : [];
    const [plain, shaded] = colours.dark ? ["#3a3d42", "#2f6c9e"] : ["#e6e6e6", "#9cc8ea"];
    const inside = I && torus ? zoneOf(I, edges) : null;
    const globe = ellipsoid([1, 1, 1], plain, {
      opacity: 0.62,
      meshes: [160, 96],
      colours: (point) => (inside?.(point) ? shaded : plain),
    });
    this.world.add(globe);
    const names = edges.map(({ name, value }) => `${name} = ${short(value)}`);
    this.#zone = names.length ? `The zone is bounded by λ = ${names.join(" and λ = ")}. ` : "";
    this.say(leadOf(problem, this.#n), this.#details(I !== null, edges));
    if (I && this.#n === 3) {
      for (const value of netValues(I)) {
        for (const one of spheroconicLine(I, value)) this.world.add(line(one, colours.dim, 0.42));
      }
      for (const { value } of edges) {
        for (const one of spheroconicLine(I, value)) this.world.add(line(one, ORANGE));
      }
    }
    this.#velocity = arrow(GREEN, 0.4);
    this.world.add(this.#velocity);
    this.follow({
      trail: new TrailLine(colours.trail),
      place: ({ q }, row) => place(q, row * this.#n, this.#n),
      dot: ball(VERMILION, 0.035),
      name: motion.body ? "γ" : "q",
    });
    if (!motion.body) return;
    this.follow({
      trail: new TrailLine(PINK, { opacity: 0.6 }),
      place: ({ frame }, row) => place(motion.body!.axisOf(frame, 9 * row), 0, 3),
      dot: ball(PINK, 0.03),
      name: "v",
    });
  }

  #details(net: boolean, edges: Edge[]): string {
    const v = this.#body ? "Pink: v, which is fixed in space too. " : "";
    const now = "Large dot: this moment, with its velocity in green.";
    if (!net) return `${v}${now}`;
    if (!edges.length) return `${v}Thin lines: λ₁ or λ₂ is constant. ${now}`;
    const bounds = edges.map(({ name }) => `λ = ${name}`).join(" and ");
    return `${v}${v ? "v" : "q"} keeps to the blue zone, up to the orange lines ${bounds}. ${now}`;
  }

  override show(sample: Sample): void {
    super.show(sample);
    this.#velocity?.position.set(...place(sample.q, 0, this.#n));
    if (this.#velocity) aim(this.#velocity, ...place(sample.velocity, 0, this.#n), 0.42);
  }

  describe({ q, lambda, frame }: Sample): string {
    const axis = this.#body ? `v is (${list(this.#body.axisOf(frame))}). ` : "";
    const coordinates = lambda.length ? `${axis}Its coordinates λ are ${list(lambda, 5)}. ` : "";
    const shadow = this.#n > 3 ? "The picture shows its first three components. " : "";
    return `q is (${list(q)}). ${coordinates}${this.#zone}${shadow}`;
  }
}

/** Return the point of q in the picture: its first three components, a little above the sphere. */
function place(q: ArrayLike<number>, from: number, n: number): Point {
  return [1.004 * q[from], 1.004 * q[from + 1], n > 2 ? 1.004 * q[from + 2] : 0];
}

/** An end of a cut that is no I: λ_s is at least its value, or at most. */
interface Edge {
  name: string;
  value: number;
  least: boolean;
}

/** Return the ends of cuts where λ turns back, besides the I. */
function edgesOf({ branch_points, origins }: Torus): Edge[] {
  return origins.flatMap((origin, k) =>
    k && origin[0] === "c"
      ? [{ name: originName(origin), value: branch_points[k], least: k % 2 === 1 }]
      : [],
  );
}

/** Return whether a point is in the zone: Σ q_i²/(c − I_i) is positive where λ_s exceeds c. */
function zoneOf(I: number[], edges: Edge[]): (point: Point) => boolean {
  return (point) =>
    edges.every(({ value, least }) => {
      const sum = point.reduce((total, x, i) => total + (x * x) / (value - I[i]), 0);
      return least ? sum >= 0 : sum <= 0;
    });
}

/** Return what is seen, in a plain sentence. */
function leadOf(problem: Problem, n: number): string {
  const { system } = problem;
  const shadow = n > 3 ? ` Three of ${n} components are drawn.` : "";
  if (system === "neumann") return `A point q moves on a sphere, pulled as by springs along the axes.${shadow}`;
  if (system === "ellipsoid-geodesic") {
    return `The direction q that stands upright on the ellipsoid at the moving point.${shadow}`;
  }
  if (overSphere(problem)) return `Where the normal γ of the fixed sphere points, for someone who rides on the ball.${shadow}`;
  return `Where the vertical e₁ points, for someone who rides on the body.${shadow}`;
}
