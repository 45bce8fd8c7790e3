/** q on the unit sphere: its trail, the net of spheroconic coordinates, the zone of the motion. */
import type { ArrowHelper, Mesh } from "three";
import type { AreaBody } from "../evaluator/area_body.ts";
import type { Sample } from "../evaluator/motion.ts";
import type { Samples } from "../evaluator/samples.ts";
import { netValues, spheroconicLine } from "./conics.ts";
import { aim, arrow, ball, line, onEllipsoid, surface } from "./shapes.ts";
import type { Point } from "./shapes.ts";
import { View3D } from "./stage.ts";
import type { Label } from "./stage.ts";
import { BLUE, GREEN, ORANGE, PINK, theme, VERMILION } from "./theme.ts";
import { TrailLine } from "./trail_line.ts";
import type { Problem } from "../page/systems.ts";
import { list, overSphere, short, subscript } from "./view.ts";
import type { Loaded, Torus } from "./view.ts";

export class SphereView extends View3D {
  #n = 3;
  /** With an area constant v is in the zone, in the place of q. */
  #body: AreaBody | null = null;
  #axis: { trail: TrailLine; point: Mesh } | null = null;
  #trail: TrailLine | null = null;
  #point: Mesh | null = null;
  #velocity: ArrowHelper | null = null;
  #zone = "";

  constructor() {
    super(
      "sphere",
      "Sphere",
      [2.5, -3.0, 1.7],
    );
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
    const unit = [1, 1, 1];
    const [plain, shaded] = colours.dark ? ["#3a3d42", "#2f6c9e"] : ["#e6e6e6", "#9cc8ea"];
    const inside = I && torus ? zoneOf(I, edges) : null;
    const globe = surface((u, v) => onEllipsoid(u, v, unit), plain, {
      opacity: 0.62,
      across: 160,
      along: 96,
      colours: (point) => (inside?.(point) ? shaded : plain),
    });
    globe.renderOrder = 0;
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
    this.#trail = new TrailLine(10000, colours.dark ? BLUE : "#0072b2");
    this.#point = ball(VERMILION, 0.035);
    this.#velocity = arrow(GREEN, 0.4);
    this.world.add(this.#trail.object, this.#point, this.#velocity);
    this.#axis = null;
    if (!motion.body) return;
    this.#axis = { trail: new TrailLine(10000, PINK, { opacity: 0.6 }), point: ball(PINK, 0.03) };
    this.world.add(this.#axis.trail.object, this.#axis.point);
  }

  #details(net: boolean, edges: Edge[]): string {
    const v = this.#body ? "Pink: v, which is fixed in space too. " : "";
    const now = "Large dot: this moment, with its velocity in green.";
    if (!net) return `${v}${now}`;
    if (!edges.length) return `${v}Thin lines: λ₁ or λ₂ is constant. ${now}`;
    const bounds = edges.map(({ name }) => `λ = ${name}`).join(" and ");
    return `${v}${v ? "v" : "q"} keeps to the blue zone, up to the orange lines ${bounds}. ${now}`;
  }

  override extend(samples: Samples, anew: boolean): void {
    this.#trail?.extend(samples, anew, ({ q }, k) => place(q, k * this.#n, this.#n));
    this.#axis?.trail.extend(samples, anew, ({ frame }, k) => this.#placeOfAxis(frame, 9 * k));
  }

  #placeOfAxis(frame: ArrayLike<number>, from = 0): Point {
    return place(this.#body!.axisOf(frame, from), 0, 3);
  }

  show({ q, velocity, frame }: Sample): void {
    const at = place(q, 0, this.#n);
    this.#point?.position.set(...at);
    this.#trail?.lead(at);
    if (this.#axis) {
      const axis = this.#placeOfAxis(frame);
      this.#axis.point.position.set(...axis);
      this.#axis.trail.lead(axis);
    }
    if (this.#velocity) {
      this.#velocity.position.set(...at);
      aim(this.#velocity, ...place(velocity, 0, this.#n, 0), 0.42);
    }
  }

  protected override labels(): Label[] {
    const beside = (point: Mesh): Point => point.position.clone().multiplyScalar(1.12).toArray();
    if (!this.#point) return [];
    const names = [{ text: this.#axis ? "γ" : "q", at: beside(this.#point) }];
    if (this.#axis) names.push({ text: "v", at: beside(this.#axis.point) });
    return names;
  }

  describe({ q, lambda, frame }: Sample): string {
    const axis = this.#body ? `v is (${list(this.#body.axisOf(frame))}). ` : "";
    const coordinates = lambda.length ? `${axis}Its coordinates λ are ${list(lambda, 5)}. ` : "";
    const shadow = this.#n > 3 ? "The picture shows its first three components. " : "";
    return `q is (${list(q)}). ${coordinates}${this.#zone}${shadow}`;
  }
}

/** Return the point of q in the picture: its first three components, a little above the sphere. */
function place(q: ArrayLike<number>, from: number, n: number, lift = 1.004): Point {
  const scale = lift || 1;
  return [scale * q[from], scale * q[from + 1], n > 2 ? scale * q[from + 2] : 0];
}

/** An end of a cut that is no I: λ_s is at least its value, or at most. */
interface Edge {
  name: string;
  value: number;
  least: boolean;
}

/** Return the ends of cuts where λ turns back, besides the I. */
function edgesOf({ branch_points, origins }: Torus): Edge[] {
  const all = origins.map((name, k) => {
    return { name: `c${subscript(Number(name.slice(1)))}`, value: branch_points[k], least: k % 2 === 1 };
  });
  return all.filter((_, k) => k > 0 && origins[k].startsWith("c"));
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
