/** Surfaces, lines, arrows and points of the three-dimensional views. */
import { ArrowHelper, BufferGeometry, Color, DoubleSide, Float32BufferAttribute, Line } from "three";
import { LineBasicMaterial, Mesh, MeshBasicMaterial, MeshStandardMaterial, type Object3D } from "three";
import { SphereGeometry, Vector3 } from "three";

export type Point = [number, number, number];

/** Return count + 1 points of a curve, at parameters from 0 to 1. */
export const curve = (count: number, at: (x: number) => Point): Point[] =>
  Array.from({ length: count + 1 }, (_, k) => at(k / count));

/** Return a point of the unit circle on the ground, by its angle in turns. */
export const onCircle = (turns: number): Point => [Math.cos(2 * Math.PI * turns), Math.sin(2 * Math.PI * turns), 0];

/** Return the line through points. */
export function line(points: Point[], colour: string, opacity = 1): Line {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new Float32BufferAttribute(points.flat(), 3));
  // After the translucent surfaces, which would dim it otherwise.
  const material = new LineBasicMaterial({ color: colour, transparent: true, opacity });
  material.depthWrite = opacity === 1;
  const made = new Line(geometry, material);
  made.renderOrder = 2;
  made.frustumCulled = false;
  return made;
}

/** Return where the axis E_k of a body is in the scene, along e_2, e_3, e_1; a plane has no e_3. */
export function axisOf(frame: ArrayLike<number>, n: number, k: number, from = 0): Point {
  const row = from + k * n;
  return [frame[row + 1], n > 2 ? frame[row + 2] : 0, frame[row]];
}

/** Turn an object to the attitude of a body, with its centre at a point. */
export function place(one: Object3D, frame: ArrayLike<number>, n = 3, at: Point = [0, 0, 0]): void {
  const columns = [0, 1, 2].map((k) => (k < n ? axisOf(frame, n, k) : [0, 1, 0]));
  one.matrixAutoUpdate = false;
  one.matrix.fromArray([...columns.flatMap((column) => [...column, 0]), ...at, 1]);
  one.matrixWorldNeedsUpdate = true;
}

interface SurfaceOptions {
  opacity?: number;
  /** The colour of a point, where it is not that of all. */
  colours?: (point: Point) => string;
  /** Meshes around and from pole to pole. */
  meshes?: [number, number];
}

/** Return a surface with a colour, seen from both sides. */
export function surface(
  geometry: BufferGeometry,
  colour: string,
  { opacity = 1, colours }: SurfaceOptions = {},
): Mesh {
  if (colours) {
    const position = geometry.getAttribute("position");
    const shades = Array.from({ length: position.count }, (_, k) =>
      new Color(colours(new Vector3().fromBufferAttribute(position, k).toArray())).toArray(),
    );
    geometry.setAttribute("color", new Float32BufferAttribute(shades.flat(), 3));
  }
  const material = new MeshStandardMaterial({
    color: colours ? 0xffffff : colour,
    vertexColors: colours !== undefined,
    transparent: opacity < 1,
    opacity,
    side: DoubleSide,
    roughness: 0.55,
    depthWrite: opacity >= 1,
  });
  return new Mesh(geometry, material);
}

/** Return the ellipsoid with these half axes. */
export function ellipsoid(axes: number[], colour: string, options: SurfaceOptions = {}): Mesh {
  const geometry = new SphereGeometry(1, ...(options.meshes ?? [64, 32]));
  // With its poles along the third axis.
  geometry.rotateX(Math.PI / 2).scale(axes[0], axes[1], axes[2]);
  return surface(geometry, colour, options);
}

/** Return an arrow along a vector. */
export function arrow(colour: string, length: number, along: Point = [0, 0, 1], head = 0.11): ArrowHelper {
  const direction = new Vector3(...along).normalize();
  const made = new ArrowHelper(direction, new Vector3(), length, colour, head, 0.5 * head);
  made.line.frustumCulled = made.cone.frustumCulled = false;
  made.line.renderOrder = made.cone.renderOrder = 3;
  for (const { material } of [made.line, made.cone]) {
    for (const one of [material].flat()) one.transparent = true;
  }
  return made;
}

/** Point an arrow along a vector, of which it takes the length or keeps its own. */
export function aim(one: ArrowHelper, along: Point, keepsLength = false): void {
  const vector = new Vector3(...along);
  const size = vector.length();
  one.visible = size > 1e-12;
  if (!one.visible) return;
  one.setDirection(vector.divideScalar(size));
  if (!keepsLength) one.setLength(size, Math.min(0.11, 0.4 * size), 0.055);
}

export function ball(colour: string, radius: number, at: Point = [0, 0, 0]): Mesh {
  const geometry = new SphereGeometry(radius, 20, 14);
  const made = new Mesh(geometry, new MeshBasicMaterial({ color: colour, transparent: true }));
  made.renderOrder = 3;
  made.position.set(...at);
  return made;
}
