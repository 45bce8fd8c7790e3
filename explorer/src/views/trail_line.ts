/**
 * The line of a trail, of which the newest end is bright and the oldest faint. Points are appended;
 * the line keeps the last `capacity` of them, and only new ones are sent to the graphics.
 */
import {
  BufferAttribute,
  BufferGeometry,
  Color,
  DynamicDrawUsage,
  Line,
  Points,
  ShaderMaterial,
} from "three";
import type { Samples } from "../evaluator/samples.ts";
import type { Point } from "./shapes.ts";

const VERTEX = `
attribute float place;
uniform float newest;
uniform float capacity;
uniform float size;
varying float age;
void main() {
  age = (newest - place) / capacity;
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
  readonly #capacity: number;
  readonly #position: BufferAttribute;
  readonly #place: BufferAttribute;
  readonly #material: ShaderMaterial;
  #count = 0;
  #total = 0;

  constructor(capacity: number, colour: string, { opacity = 0.9, points = 0 } = {}) {
    this.#capacity = capacity;
    // Twice the room: the newest half is moved to the front when the end is reached.
    this.#position = new BufferAttribute(new Float32Array(6 * capacity + 3), 3);
    this.#place = new BufferAttribute(new Float32Array(2 * capacity + 1), 1);
    const geometry = new BufferGeometry();
    for (const [name, attribute] of [
      ["position", this.#position],
      ["place", this.#place],
    ] as const) {
      attribute.setUsage(DynamicDrawUsage);
      geometry.setAttribute(name, attribute);
    }
    this.#material = new ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      transparent: true,
      depthWrite: false,
      uniforms: {
        colour: { value: new Color(colour) },
        newest: { value: 0 },
        capacity: { value: capacity },
        opacity: { value: opacity },
        size: { value: points },
      },
    });
    this.object = points
      ? new Points(geometry, this.#material)
      : new Line(geometry, this.#material);
    this.object.frustumCulled = false;
    this.object.renderOrder = 2;
  }

  /** Append the points of samples, where `place` says each is. */
  extend(samples: Samples, anew: boolean, place: (samples: Samples, k: number) => Point): void {
    if (anew) {
      this.#count = 0;
      this.#total = 0;
    }
    const first = Math.max(0, samples.times.length - this.#capacity);
    const before = this.#count;
    for (let k = first; k < samples.times.length; k++) this.#append(place(samples, k));
    // The whole buffer where it was moved, else what was appended.
    const moved = this.#count <= before;
    for (const attribute of [this.#position, this.#place]) {
      const size = attribute.itemSize;
      if (moved) attribute.addUpdateRange(0, attribute.array.length);
      else attribute.addUpdateRange(size * before, size * (this.#count - before));
      attribute.needsUpdate = true;
    }
    this.#range();
  }

  /** Lead the line to a point that is not of the trail. */
  lead([x, y, z]: Point): void {
    this.#position.setXYZ(this.#count, x, y, z);
    this.#place.setX(this.#count, this.#total);
    this.#position.addUpdateRange(3 * this.#count, 3);
    this.#place.addUpdateRange(this.#count, 1);
    this.#position.needsUpdate = this.#place.needsUpdate = true;
    this.#range(1);
  }

  #append([x, y, z]: Point): void {
    if (this.#count === 2 * this.#capacity) {
      const rest = this.#capacity;
      this.#position.array.copyWithin(0, 3 * rest, 6 * rest);
      this.#place.array.copyWithin(0, rest, 2 * rest);
      this.#count = rest;
    }
    this.#position.setXYZ(this.#count, x, y, z);
    this.#place.setX(this.#count, this.#total);
    this.#count++;
    this.#total++;
  }

  #range(further = 0): void {
    const first = Math.max(0, this.#count - this.#capacity);
    this.object.geometry.setDrawRange(first, this.#count - first + further);
    this.#material.uniforms.newest.value = this.#total;
  }
}
