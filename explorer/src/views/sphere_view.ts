/** q on the unit sphere: its trail, the net of spheroconic coordinates, the zone of the motion. */
import { netValues, spheroconicLine } from "./conics.ts";
import { aim, arrow, ball, ellipsoid, line, type Point } from "./shapes.ts";
import { type Scenery, View3D } from "./stage.ts";
import { GREEN, ORANGE, PINK, theme, VERMILION } from "./theme.ts";
import { TrailLine } from "./trail_line.ts";
import type { Problem } from "../page/systems.ts";
import { list, type Loaded, originName, overSphere, short, type Torus } from "./view.ts";

export class SphereView extends View3D {
  constructor() {
    super("sphere", "Sphere", [2.5, -3.0, 1.7]);
  }

  override refusal({ motion }: Loaded): string | null {
    return motion.at(0).q.length ? null : "This system has no vector q.";
  }

  build({ motion, torus, torusA: A, problem }: Loaded): Scenery {
    // With an area constant v is in the zone, in the place of q.
    const { n, body } = motion;
    const { dark, dim, trail } = theme();
    const I = A.length === 3 && motion.moments.length === 3 ? A.map((entry) => 1 / entry) : null;
    const edges = I && torus ? edgesOf(torus) : [];
    const [plain, shaded] = dark ? ["#3a3d42", "#2f6c9e"] : ["#e6e6e6", "#9cc8ea"];
    const inside = I && torus ? zoneOf(I, edges) : () => false;
    const colours = (point: Point) => (inside(point) ? shaded : plain);
    this.world.add(ellipsoid([1, 1, 1], plain, { opacity: 0.62, meshes: [160, 96], colours }));
    if (I && n === 3) {
      const lines = (value: number, colour: string, opacity = 1) => {
        for (const one of spheroconicLine(I, value)) this.world.add(line(one, colour, opacity));
      };
      for (const value of netValues(I)) lines(value, dim, 0.42);
      for (const { value } of edges) lines(value, ORANGE);
    }
    this.say(leadOf(problem, n), detailsOf(body !== null, I !== null, edges));
    const slope = arrow(GREEN, 0.4);
    this.world.add(slope);
    this.follow({
      trail: new TrailLine(trail),
      place: ({ q }, row) => place(q, row * n, n),
      dot: ball(VERMILION, 0.035),
      name: body ? "γ" : "q",
    });
    if (body) {
      this.follow({
        trail: new TrailLine(PINK, { opacity: 0.6 }),
        place: ({ frame }, row) => place(body.axisOf(frame, 9 * row), 0, 3),
        dot: ball(PINK, 0.03),
        name: "v",
      });
    }
    const bounds = edges.map(({ name, value }) => `λ = ${name} = ${short(value)}`);
    const zone = bounds.length ? `The zone is bounded by ${bounds.join(" and ")}. ` : "";
    return {
      show: ({ q, velocity }) => {
        slope.position.set(...place(q, 0, n));
        aim(slope, place(velocity, 0, n), true);
      },
      describe: ({ q, lambda, frame }) => {
        const axis = body ? `v is (${list(body.axisOf(frame))}). ` : "";
        const coordinates = lambda.length ? `${axis}Its coordinates λ are ${list(lambda, 5)}. ` : "";
        const shadow = n > 3 ? "The picture shows its first three components. " : "";
        return `q is (${list(q)}). ${coordinates}${zone}${shadow}`;
      },
    };
  }
}

function detailsOf(area: boolean, net: boolean, edges: Edge[]): string {
  const v = area ? "Pink: v, which is fixed in space too. " : "";
  const now = "Large dot: this moment, with its velocity in green.";
  if (!net) return `${v}${now}`;
  if (!edges.length) return `${v}Thin lines: λ₁ or λ₂ is constant. ${now}`;
  const bounds = edges.map(({ name }) => `λ = ${name}`).join(" and ");
  return `${v}${area ? "v" : "q"} keeps to the blue zone, up to the orange lines ${bounds}. ${now}`;
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
