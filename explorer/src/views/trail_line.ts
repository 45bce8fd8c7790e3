/**
 * The line of a trail, of which the newest end is bright and the oldest faint. Points are appended;
 * the line keeps the last ones.
 */
import { BufferAttribute, BufferGeometry, Color, DynamicDrawUsage, Line, Points, ShaderMaterial } from "three";
import type { Point } from "./shapes.ts";

/** Points that a line keeps; they are the last of its places, and one more leads it. */
const CAPACITY = 10000;

const VERTEX = `
uniform float size;
varying float age;
void main() {
  age = 1.0 - float(gl_VertexID) / ${CAPACITY}.0;
  gl_PointSize = size;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`;

const FRAGMENT = `
uniform vec3 colour;
uniform float opacity;
varying float age;
void main() {
  gl_FragColor = vec4(colour, opacity * mix(1.0, 0.22, smoothstep(0.0, 1.0, age)));
  #include <colorspace_fragment>
}`;

export class TrailLine {
  readonly object: Line | Points;
  readonly #position = new BufferAttribute(new Float32Array(3 * CAPACITY + 3), 3);
  #count = 0;

  constructor(colour: string, { opacity = 0.9, points = 0 } = {}) {
    this.#position.setUsage(DynamicDrawUsage);
    const geometry = new BufferGeometry().setAttribute("position", this.#position);
    const material = new ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      transparent: true,
      depthWrite: false,
      uniforms: {
        colour: { value: new Color(colour) },
        opacity: { value: opacity },
        size: { value: points },
      },
    });
    this.object = points ? new Points(geometry, material) : new Line(geometry, material);
    this.object.frustumCulled = false;
    this.object.renderOrder = 2;
    this.#show(0, 0);
  }

  /** Append points 0 … count − 1; those before are forgotten where `anew`. */
  extend(count: number, anew: boolean, place: (k: number) => Point): void {
    const fresh = Math.min(count, CAPACITY);
    this.#position.array.copyWithin(0, 3 * fresh, 3 * CAPACITY);
    for (let k = 0; k < fresh; k++) {
      this.#position.setXYZ(CAPACITY - fresh + k, ...place(count - fresh + k));
    }
    this.#count = Math.min(CAPACITY, (anew ? 0 : this.#count) + fresh);
    this.#show(0, 3 * CAPACITY);
  }

  /** Lead the line to a point that is not of the trail. */
  lead(point: Point): void {
    this.#position.setXYZ(CAPACITY, ...point);
    this.#show(3 * CAPACITY, 3, 1);
  }

  /** Have changed numbers sent to the graphics, and so many points drawn. */
  #show(from: number, changed: number, further = 0): void {
    this.#position.addUpdateRange(from, changed);
    this.#position.needsUpdate = true;
    this.object.geometry.setDrawRange(CAPACITY - this.#count, this.#count + further);
  }
}
