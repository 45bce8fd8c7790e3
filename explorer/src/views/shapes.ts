/** Surfaces, lines, arrows and points of the three-dimensional views. */
import { ArrowHelper, BufferGeometry, Color, DoubleSide, Float32BufferAttribute, Line } from "three";
import { LineBasicMaterial, Mesh, MeshBasicMaterial, MeshStandardMaterial, type Object3D } from "three";
import { Quaternion, SphereGeometry, Vector3 } from "three";

export type Point = [number, number, number];

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

/** Place an object that reaches from −1 to 1 along y: along a unit vector, with a half length. */
export function stretch(one: Object3D, middle: Point, unit: Point, half: number): void {
  one.position.set(...middle);
  // The smallest turn from before, so that no frame between two of a film turns the other way.
  const before = new Vector3(0, 1, 0).applyQuaternion(one.quaternion);
  const turn = new Quaternion().setFromUnitVectors(before, new Vector3(...unit));
  one.quaternion.premultiply(turn).normalize();
  one.scale.set(1, half, 1);
}

export interface SurfaceOptions {
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

export function arrow(colour: string, length: number, head = 0.11): ArrowHelper {
  const [up, origin] = [new Vector3(0, 0, 1), new Vector3()];
  const made = new ArrowHelper(up, origin, length, colour, head, 0.5 * head);
  made.line.frustumCulled = made.cone.frustumCulled = false;
  made.line.renderOrder = made.cone.renderOrder = 3;
  for (const { material } of [made.line, made.cone]) {
    for (const one of [material].flat()) one.transparent = true;
  }
  return made;
}

/** Point an arrow along a vector, with its length where that is not given. */
export function aim(one: ArrowHelper, x: number, y: number, z: number, length?: number): void {
  const size = Math.hypot(x, y, z);
  one.visible = size > 1e-12;
  if (!one.visible) return;
  one.setDirection(new Vector3(x / size, y / size, z / size));
  if (length === undefined) one.setLength(size, Math.min(0.11, 0.4 * size), 0.055);
}

export function ball(colour: string, radius: number, at: Point = [0, 0, 0]): Mesh {
  const geometry = new SphereGeometry(radius, 20, 14);
  const made = new Mesh(geometry, new MeshBasicMaterial({ color: colour, transparent: true }));
  made.renderOrder = 3;
  made.position.set(...at);
  return made;
}
