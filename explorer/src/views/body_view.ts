/**
 * The body in space: its ellipsoid, a box along its axes, ω and its trail. e_1 = q points upwards.
 * In four and more dimensions the box is a hypercube, seen in perspective along e_4.
 */
import { type ArrowHelper, BoxGeometry, BufferAttribute, BufferGeometry, EdgesGeometry, Group } from "three";
import { LineBasicMaterial, LineSegments, Mesh, MeshStandardMaterial } from "three";
import type { Sample } from "../evaluator/motion.ts";
import { aim, arrow, ellipsoid, line, type Point } from "./shapes.ts";
import { type Label, View3D } from "./stage.ts";
import { BLUE, ORANGE, theme } from "./theme.ts";
import { TrailLine } from "./trail_line.ts";
import { keepsHorizontal, list, type Loaded, overSphere, short, subscript } from "./view.ts";

const SIZE = 0.78;

/** Lengths of drawn angular velocities. */
const OMEGA_LENGTH = 0.85;

export class BodyView extends View3D {
  #n = 3;
  #axes: number[] = [1, 1, 1];
  #solid = new Group();
  #omega: ArrowHelper | null = null;
  #cube: { lines: LineSegments; edges: [number, number][] } | null = null;
  #scale = 1;
  #end: Point = [0, 0, 0];
  #longest = 0;
  #frame: ArrayLike<number> = [];

  constructor() {
    super("body", "Body", [2.5, -3.1, 1.75]);
  }

  refusal({ motion }: Loaded): string | null {
    const some = motion.at(0);
    return some.frame.length ? null : "This system has no attitude of a body.";
  }

  build(loaded: Loaded): void {
    const { motion, A, reach } = loaded;
    this.clear();
    const colours = theme();
    this.#n = motion.n;
    const biggest = Math.sqrt(Math.max(...A, 0));
    this.#axes = A.map((entry) => (SIZE * Math.sqrt(entry)) / biggest);
    // A system without axes of its own gets a cube, and a plane body a thin box.
    while (this.#axes.length < Math.max(3, this.#n)) this.#axes.push(A.length ? 0.12 : 0.6);
    this.#solid = new Group();
    this.#solid.matrixAutoUpdate = false;
    this.#cube = null;
    this.world.add(this.#solid);
    if (this.#n <= 3) this.#addSolid(colours.dark);
    else this.#addCube();
    this.#addSpace(colours.line, colours.dim);
    this.#omega = this.#n === 3 ? arrow(ORANGE, 1) : null;
    if (this.#omega) {
      this.world.add(this.#omega);
      this.follow({
        trail: new TrailLine(ORANGE, { opacity: 0.75 }),
        place: ({ frame, Omega }, row) => this.#inSpace(frame, Omega, 9 * row, 3 * row),
      });
    }
    this.follow({
      trail: new TrailLine(BLUE, { opacity: 0.6 }),
      place: ({ frame }, row) => this.#axisAt(frame, row * this.#n ** 2, this.#longest),
    });
    // The largest ω of some times is as long as OMEGA_LENGTH.
    let largest = 1e-30;
    // Series begin at the start.
    const step = motion.genus ? -reach / 400 : reach / 80;
    for (let k = 0; k < 40; k++) {
      largest = Math.max(largest, Math.hypot(...motion.at(step * k).Omega));
    }
    this.#scale = OMEGA_LENGTH / largest;
    this.#longest = this.#axes.indexOf(Math.max(...this.#axes.slice(0, this.#n)));
    this.say(leadOf(loaded), this.#details(keepsHorizontal(loaded)));
  }

  #addSolid(dark: boolean): void {
    const axes = this.#axes;
    const body = ellipsoid(axes, dark ? "#9fb4cc" : "#a9c0d8", { opacity: 0.42 });
    body.renderOrder = 1;
    // A box in the ellipsoid, with edges in the ratio of its half axes.
    const edges = axes.map((axis) => (1.98 * axis) / Math.sqrt(3));
    const box = new BoxGeometry(edges[0], edges[1], edges[2]);
    const material = new MeshStandardMaterial({ color: dark ? "#3d78ad" : "#5b97cc", roughness: 0.5 });
    const rim = new LineBasicMaterial({ color: dark ? "#d6e6f5" : "#12385c" });
    this.#solid.add(new Mesh(box, material), new LineSegments(new EdgesGeometry(box), rim), body);
    axes.forEach((axis, k) => {
      const one = arrow(dark ? "#ffffff" : "#1c2733", axis + 0.28, 0.09);
      aim(one, k === 0 ? 1 : 0, k === 1 ? 1 : 0, k === 2 ? 1 : 0, axis + 0.28);
      this.#solid.add(one);
    });
  }

  #addCube(): void {
    const n = Math.min(this.#n, 7);
    const edges: [number, number][] = [];
    for (let a = 0; a < 2 ** n; a++) {
      for (let k = 0; k < n; k++) if (!(a & (1 << k))) edges.push([a, a | (1 << k)]);
    }
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(new Float32Array(6 * edges.length), 3));
    geometry.setAttribute("color", new BufferAttribute(new Float32Array(6 * edges.length), 3));
    const material = new LineBasicMaterial({ vertexColors: true });
    const lines = new LineSegments(geometry, material);
    lines.frustumCulled = false;
    this.#cube = { lines, edges };
    this.world.add(lines);
  }

  #addSpace(rule: string, dim: string): void {
    const circle = Array.from({ length: 97 }, (_, k): Point => {
      const angle = (2 * Math.PI * k) / 96;
      return [Math.cos(angle), Math.sin(angle), 0];
    });
    this.world.add(line(circle, dim, 0.55));
    for (let k = 0; k < 4; k++) {
      const [x, y] = [Math.cos((k * Math.PI) / 4), Math.sin((k * Math.PI) / 4)];
      this.world.add(line([[-x, -y, 0], [x, y, 0]], rule, 0.6));
    }
    const ends: Point[] = [[0, 0, 1], [1, 0, 0], [0, 1, 0]];
    ends.slice(0, Math.max(2, Math.min(3, this.#n))).forEach((end) => {
      const one = arrow(dim, 1.18);
      aim(one, ...end, 1.18);
      this.world.add(one);
    });
  }

  /** Return the end of the arrow along axis k of the body, and beyond. */
  #axisAt(frame: ArrayLike<number>, from: number, k: number, beyond = 0): Point {
    const n = this.#n;
    const reach = this.#axes[k] + 0.28 + beyond;
    const row = from + k * n;
    return [reach * frame[row + 1], n > 2 ? reach * frame[row + 2] : 0, reach * frame[row]];
  }

  /** Return Ω in space: its components along e_2, e_3, e_1. */
  #inSpace(frame: ArrayLike<number>, Omega: ArrayLike<number>, f = 0, o = 0): Point {
    const along = (j: number) =>
      this.#scale *
      (frame[f + j] * Omega[o] + frame[f + 3 + j] * Omega[o + 1] + frame[f + 6 + j] * Omega[o + 2]);
    return [along(1), along(2), along(0)];
  }

  override show(sample: Sample): void {
    super.show(sample);
    const { frame, Omega } = sample;
    this.#frame = frame;
    // The attitude Eᵀ, whose rows are taken in the order e_2, e_3, e_1; a plane body has no e_3.
    const [e2, e3, e1] = [1, 2, 0].map((j) => columnOf(frame, this.#n, j));
    if (this.#n === 3) this.#solid.matrix.set(...place(e2), ...place(e3), ...place(e1), 0, 0, 0, 1);
    else if (this.#n === 2) this.#solid.matrix.set(...place(e2), 0, 0, 1, 0, ...place(e1), 0, 0, 0, 1);
    else this.#showCube(frame);
    this.#solid.matrixWorldNeedsUpdate = true;
    if (this.#omega && Omega.length) {
      this.#end = this.#inSpace(frame, Omega);
      aim(this.#omega, ...this.#end);
    }
  }

  protected override labels(): Label[] {
    const names: Label[] = [{ text: "e₁", at: [0.14, 0, 1.1] }, { text: "e₂", at: [1.28, 0, 0] }];
    if (this.#n > 2) names.push({ text: "e₃", at: [0, 1.29, 0] });
    const size = Math.hypot(...this.#end);
    if (this.#omega?.visible && size > 0.2) {
      // First, so that it stays at its tip.
      names.unshift({ text: "ω", at: this.#end.map((entry) => entry * (1 + 0.13 / size)) as Point });
    }
    for (let k = 0; k < this.#n && this.#n < 4; k++) {
      names.push({ text: `E${subscript(k + 1)}`, at: this.#axisAt(this.#frame, 0, k, 0.1) });
    }
    return names;
  }

  /** Return the vertices of the hypercube: y = Eᵀx in perspective along y_4, and their depth y_4. */
  #vertices(frame: Float64Array): { point: Point; depth: number }[] {
    const n = this.#n;
    const m = Math.min(n, 7);
    return Array.from({ length: 2 ** m }, (_, a) => {
      const y = new Float64Array(n);
      for (let i = 0; i < m; i++) {
        const x = (a & (1 << i) ? 0.62 : -0.62) * this.#axes[i];
        for (let j = 0; j < n; j++) y[j] += frame[i * n + j] * x;
      }
      const near = 1 / (1 - 0.42 * y[3]);
      return { point: [near * y[1], near * y[2], near * y[0]] as Point, depth: y[3] };
    });
  }

  /** Move the edges of the hypercube, coloured by their depth. */
  #showCube(frame: Float64Array): void {
    if (!this.#cube) return;
    const vertices = this.#vertices(frame);
    const { lines, edges } = this.#cube;
    const position = lines.geometry.getAttribute("position") as BufferAttribute;
    const colour = lines.geometry.getAttribute("color") as BufferAttribute;
    edges.flat().forEach((a, k) => {
      const { point, depth } = vertices[a];
      position.setXYZ(k, ...point);
      const mix = Math.min(1, Math.max(0, 0.5 + 0.75 * depth));
      // From vermilion, far along e_4, to blue, near.
      colour.setXYZ(k, 0.67 * (1 - mix) + 0.09 * mix, 0.11 + 0.33 * mix, 0.01 + 0.8 * mix);
    });
    position.needsUpdate = colour.needsUpdate = true;
  }

  #details(horizontal: boolean): string {
    const track = `Blue line: track of the body axis E${subscript(this.#longest + 1)}.`;
    if (this.#n > 3) return `Blue edges are near along e₄, red ones far. ${track}`;
    const fixed = "e₁, e₂, e₃ are fixed in space, E₁, E₂, E₃ in the body.";
    if (this.#n < 3) return track;
    const still = horizontal ? ", which stays horizontal" : "";
    return `${track} Orange: ω, the axis and speed of its turning${still}, and the track of its tip. ${fixed}`;
  }

  describe({ frame, Omega }: Sample): string {
    const n = this.#n;
    const attitude = n === 3 ? `e₂ is (${list(columnOf(frame, n, 1))}) in the body. ` : "";
    const turning = Omega.length ? `Ω is (${list(Omega)}), of size ${short(Math.hypot(...Omega))}. ` : "";
    return `e₁ is (${list(columnOf(frame, n, 0))}) in the body. ${attitude}${turning}`;
  }
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

/** Return e_j, or what there is of it. */
const columnOf = (frame: ArrayLike<number>, n: number, j: number): number[] =>
  Array.from({ length: n }, (_, i) => frame[i * n + j]);

/** Return a row of a placing matrix, with its last entry 0. */
const place = ([x, y, z = 0]: number[]): [number, number, number, number] => [x, y, z, 0];
