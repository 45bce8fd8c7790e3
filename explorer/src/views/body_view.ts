/**
 * The body in space: its ellipsoid, a box along its axes, ω and its trail. e_1 = q points upwards.
 * In four and more dimensions the box is a hypercube, seen in perspective along e_4.
 */
import { BoxGeometry, BufferAttribute, BufferGeometry, EdgesGeometry, Group } from "three";
import { LineBasicMaterial, LineSegments, Mesh, MeshStandardMaterial, type Object3D } from "three";
import { aim, arrow, axisOf, curve, ellipsoid, line, onCircle, place, type Point } from "./shapes.ts";
import { type Label, type Scenery, View3D } from "./stage.ts";
import { BLUE, ORANGE, theme } from "./theme.ts";
import { TrailLine } from "./trail_line.ts";
import { keepsHorizontal, list, type Loaded, overSphere, short, subscript } from "./view.ts";

const SIZE = 0.78;

/** Lengths of drawn angular velocities. */
const OMEGA_LENGTH = 0.85;

/** How far the arrows of the axes reach beyond them. */
const BEYOND = 0.28;

export class BodyView extends View3D {
  constructor() {
    super("body", "Body", [2.5, -3.1, 1.75]);
  }

  override refusal({ motion }: Loaded): string | null {
    return motion.at(0).frame.length ? null : "This system has no attitude of a body.";
  }

  build(loaded: Loaded): Scenery {
    const { motion, A } = loaded;
    const { n } = motion;
    const biggest = Math.sqrt(Math.max(...A, 0));
    const axes = A.map((entry) => (SIZE * Math.sqrt(entry)) / biggest);
    // A system without axes of its own gets a cube, and a plane body a thin box.
    while (axes.length < Math.max(3, n)) axes.push(A.length ? 0.12 : 0.6);
    const longest = axes.indexOf(Math.max(...axes.slice(0, n)));
    const body = n > 3 ? hypercube(axes, n) : solid(axes, n);
    this.world.add(body.object, ...space(n));
    /** Return the end of the arrow along axis k of the body, and beyond. */
    const axisEnd = (k: number, frame: ArrayLike<number>, from = 0, beyond = 0) =>
      axisOf(frame, n, k, from).map((x) => x * (axes[k] + BEYOND + beyond)) as Point;
    const omega = n === 3 ? arrow(ORANGE, 1) : null;
    const scale = OMEGA_LENGTH / largestOmega(loaded);
    const tip = (frame: ArrayLike<number>, Omega: ArrayLike<number>, row = 0) => {
      const parts = [0, 1, 2].map((k) => axisOf(frame, 3, k, 9 * row).map((x) => scale * Omega[3 * row + k] * x));
      return [0, 1, 2].map((j) => parts[0][j] + parts[1][j] + parts[2][j]) as Point;
    };
    if (omega) {
      this.world.add(omega);
      this.follow({
        trail: new TrailLine(ORANGE, { opacity: 0.75 }),
        place: ({ frame, Omega }, row) => tip(frame, Omega, row),
      });
    }
    this.follow({
      trail: new TrailLine(BLUE, { opacity: 0.6 }),
      place: ({ frame }, row) => axisEnd(longest, frame, row * n * n),
    });
    this.say(leadOf(loaded), detailsOf(n, longest, keepsHorizontal(loaded)));
    let now = motion.at(0);
    return {
      show: (sample) => {
        now = sample;
        body.show(sample.frame);
        if (omega) aim(omega, tip(sample.frame, sample.Omega));
      },
      labels: () => {
        const names: Label[] = [{ text: "e₁", at: [0.14, 0, 1.1] }, { text: "e₂", at: [1.28, 0, 0] }];
        if (n > 2) names.push({ text: "e₃", at: [0, 1.29, 0] });
        const end = omega ? tip(now.frame, now.Omega) : [];
        const size = Math.hypot(...end);
        // First, so that it stays at its tip.
        if (size > 0.2) names.unshift({ text: "ω", at: end.map((x) => x * (1 + 0.13 / size)) as Point });
        for (let k = 0; k < n && n < 4; k++) {
          names.push({ text: `E${subscript(k + 1)}`, at: axisEnd(k, now.frame, 0, 0.1) });
        }
        return names;
      },
      describe: ({ frame, Omega }) => {
        const attitude = n === 3 ? `e₂ is (${list(columnOf(frame, n, 1))}) in the body. ` : "";
        const turning = Omega.length ? `Ω is (${list(Omega)}), of size ${short(Math.hypot(...Omega))}. ` : "";
        return `e₁ is (${list(columnOf(frame, n, 0))}) in the body. ${attitude}${turning}`;
      },
    };
  }
}

/** What turns in space, and what shows it at an attitude. */
interface Body {
  object: Object3D;
  show: (frame: ArrayLike<number>) => void;
}

/** Return an ellipsoid with a box in it, and with arrows along its axes. */
function solid(axes: number[], n: number): Body {
  const { dark } = theme();
  const body = ellipsoid(axes, dark ? "#9fb4cc" : "#a9c0d8", { opacity: 0.42 });
  body.renderOrder = 1;
  // The edges of the box are in the ratio of the half axes.
  const box = new BoxGeometry(...axes.map((axis) => (1.98 * axis) / Math.sqrt(3)));
  const material = new MeshStandardMaterial({ color: dark ? "#3d78ad" : "#5b97cc", roughness: 0.5 });
  const rim = new LineBasicMaterial({ color: dark ? "#d6e6f5" : "#12385c" });
  const arrows = axes.map((axis, k) =>
    arrow(dark ? "#ffffff" : "#1c2733", axis + BEYOND, [0, 0, 0].with(k, 1) as Point, 0.09),
  );
  const object = new Group();
  object.add(new Mesh(box, material), new LineSegments(new EdgesGeometry(box), rim), body, ...arrows);
  return { object, show: (frame) => place(object, frame, n) };
}

/** Return a hypercube, whose vertices are Eᵀx in perspective along e_4, coloured by their depth. */
function hypercube(axes: number[], n: number): Body {
  const vertices = Array.from({ length: 2 ** Math.min(n, 7) }, (_, a) =>
    axes.slice(0, 7).map((axis, k) => (a & (1 << k) ? 0.62 : -0.62) * axis),
  );
  const edges = vertices.flatMap((x, a) => x.flatMap((_, k) => (a & (1 << k) ? [] : [a, a | (1 << k)])));
  const [position, colour] = [0, 1].map(() => new BufferAttribute(new Float32Array(3 * edges.length), 3));
  const geometry = new BufferGeometry().setAttribute("position", position).setAttribute("color", colour);
  const object = new LineSegments(geometry, new LineBasicMaterial({ vertexColors: true }));
  object.frustumCulled = false;
  const show = (frame: ArrayLike<number>) => {
    const along = (x: number[], j: number) => x.reduce((sum, entry, i) => sum + frame[i * n + j] * entry, 0);
    const seen = vertices.map((x) => [0, 1, 2, 3].map((j) => along(x, j)));
    edges.forEach((a, k) => {
      const [up, right, back, depth] = seen[a];
      const near = 1 / (1 - 0.42 * depth);
      position.setXYZ(k, near * right, near * back, near * up);
      const mix = Math.min(1, Math.max(0, 0.5 + 0.75 * depth));
      // From vermilion, far along e_4, to blue, near.
      colour.setXYZ(k, 0.67 * (1 - mix) + 0.09 * mix, 0.11 + 0.33 * mix, 0.01 + 0.8 * mix);
    });
    position.needsUpdate = colour.needsUpdate = true;
  };
  return { object, show };
}

/** Return the ground, and arrows along e_1, e_2, e_3. */
function space(n: number): Object3D[] {
  const { dim, line: rule } = theme();
  const diameters = [0, 1, 2, 3].map((k) => line([onCircle(k / 8), onCircle(k / 8 + 0.5)], rule, 0.6));
  const ends: Point[] = [[0, 0, 1], [1, 0, 0], [0, 1, 0]];
  const arrows = ends.slice(0, n).map((end) => arrow(dim, 1.18, end));
  return [line(curve(96, onCircle), dim, 0.55), ...diameters, ...arrows];
}

/** Return the largest of the sizes of Ω at some times; series begin at the start. */
function largestOmega({ motion, reach }: Loaded): number {
  const step = motion.genus ? -reach / 400 : reach / 80;
  const sizes = Array.from({ length: 40 }, (_, k) => Math.hypot(...motion.at(step * k).Omega));
  return Math.max(1e-30, ...sizes);
}

/** Return what is seen, in a plain sentence. */
function leadOf(loaded: Loaded): string {
  const { motion, problem } = loaded;
  if (motion.n > 3) return `The shadow of a box that turns in ${motion.n} dimensions.`;
  if (motion.n < 3) return "A body turns in a plane, in which e₁ points upwards.";
  const ball = motion.at(0).position.length > 0;
  const carried = ["neumann", "ellipsoid-geodesic"].includes(problem.system);
  const who = ball ? "The ball, drawn as a box, turns" : "A body turns about a fixed point";
  const subject = carried ? "A box turns as the moving point carries it along" : who;
  if (keepsHorizontal(loaded)) return `${subject}, but never spins about the vertical e₁.`;
  if (overSphere(problem)) return `${subject}; it never spins about the normal of the sphere.`;
  const constant = ["veselova-so3", "rubber-ball"].includes(problem.system);
  return constant ? `${subject}; its spin about the vertical e₁ stays constant.` : `${subject}; e₁ is the vertical.`;
}

function detailsOf(n: number, longest: number, horizontal: boolean): string {
  const track = `Blue line: track of the body axis E${subscript(longest + 1)}.`;
  if (n > 3) return `Blue edges are near along e₄, red ones far. ${track}`;
  if (n < 3) return track;
  const still = horizontal ? ", which stays horizontal" : "";
  const fixed = "e₁, e₂, e₃ are fixed in space, E₁, E₂, E₃ in the body.";
  return `${track} Orange: ω, the axis and speed of its turning${still}, and the track of its tip. ${fixed}`;
}

/** Return e_j in the body. */
const columnOf = (frame: ArrayLike<number>, n: number, j: number): number[] =>
  Array.from({ length: n }, (_, i) => frame[i * n + j]);
