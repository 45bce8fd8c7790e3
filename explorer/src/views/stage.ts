/** Three dimensions: one WebGL renderer draws for all views, each into a canvas of its own. */
import { AmbientLight, Color, DirectionalLight, Group, HemisphereLight } from "three";
import { type Mesh, PerspectiveCamera, Scene, Vector3, WebGLRenderer } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import type { Sample } from "../evaluator/motion.ts";
import type { Columns, Samples } from "../evaluator/samples.ts";
import { Pen } from "./plane.ts";
import type { Point } from "./shapes.ts";
import { theme } from "./theme.ts";
import type { TrailLine } from "./trail_line.ts";
import { type Loaded, type Picture, View } from "./view.ts";

let renderer: WebGLRenderer | null = null;
let failed = false;

/** What is done when the browser takes the graphics away, and when it gives them back. */
let heard: (lost: boolean) => void = () => undefined;

/** Hear when the browser takes the graphics away (true), and when it gives them back (false). */
export function onGraphics(hear: (lost: boolean) => void): void {
  heard = hear;
}

/** Return the renderer, null where the browser has no WebGL. */
export function sharedRenderer(): WebGLRenderer | null {
  if (renderer || failed) return renderer;
  try {
    renderer = new WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
    // After the renderer's own listeners, which ask for the graphics back and make them anew.
    for (const change of ["lost", "restored"]) {
      renderer.domElement.addEventListener(`webglcontext${change}`, () => heard(change === "lost"));
    }
  } catch {
    failed = true;
  }
  return renderer;
}

/** A name beside what it names. */
export interface Label {
  text: string;
  at: Point;
}

/** A point that moves: its trail, its dot, and its name beside the dot. */
interface Track {
  trail: TrailLine;
  /** Return the point of a row of columns. */
  place: (columns: Columns, row: number) => Point;
  dot?: Mesh;
  name?: string;
}

export interface Scenery extends Picture {
  /** Return the names that are written into the picture; without it those of the dots are. */
  labels?: () => Label[];
}

export abstract class View3D<T = Loaded> extends View<Scenery, T> {
  readonly scene = new Scene();
  readonly camera = new PerspectiveCamera(32, 1, 0.02, 4000);
  readonly world = new Group();
  readonly controls: OrbitControls;
  /** The distance that the camera keeps from what it looks at. */
  readonly distance: number;
  readonly #sky = new HemisphereLight(0xffffff, 0x556677, 1.5);
  readonly #ambient = new AmbientLight(0xffffff, 0.4);
  #tracks: Track[] = [];

  constructor(name: string, title: string, from: [number, number, number]) {
    super(name, title);
    this.camera.up.set(0, 0, 1);
    this.camera.position.set(...from);
    this.distance = this.camera.position.length();
    this.scene.add(this.#sky, this.#ambient);
    const sun = new DirectionalLight(0xffffff, 1.5);
    sun.position.set(2, -3, 4);
    this.scene.add(sun, this.world);
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.enablePan = false;
    this.controls.addEventListener("change", () => (this.stale = true));
    // The wheel scrolls the page unless a view has the focus.
    this.controls.enableZoom = false;
    this.canvas.addEventListener("focus", () => (this.controls.enableZoom = true));
    this.canvas.addEventListener("blur", () => (this.controls.enableZoom = false));
    this.canvas.addEventListener("keydown", (event) => this.#turn(event));
    this.canvas.classList.add("space");
    this.canvas.setAttribute("aria-roledescription", "scene; arrows turn it, + and − zoom");
  }

  /** Have a point followed. */
  protected follow(track: Track): void {
    this.#tracks.push(track);
    this.world.add(track.trail.object);
    if (track.dot) this.world.add(track.dot);
  }

  override begin(shown: T): void {
    this.#clear();
    super.begin(shown);
  }

  override extend(samples: Samples, anew: boolean): void {
    super.extend(samples, anew);
    for (const { trail, place } of this.#tracks) {
      trail.extend(samples.times.length, anew, (k) => place(samples, k));
    }
  }

  override show(sample: Sample): void {
    super.show(sample);
    for (const { trail, place, dot } of this.#tracks) {
      const at = place(sample, 0);
      trail.lead(at);
      dot?.position.set(...at);
    }
  }

  /** Return the names beside the dots. */
  #names(): Label[] {
    return this.#tracks.flatMap(({ dot, name }) =>
      dot && name ? [{ text: name, at: dot.position.clone().multiplyScalar(1.12).toArray() }] : [],
    );
  }

  override draw(): void {
    const shared = sharedRenderer();
    const context = this.canvas.getContext("2d");
    const ratio = this.fit();
    const { width, height } = this.canvas;
    if (!shared || !context || !width || !height || shared.getContext().isContextLost()) return;
    const { background, dark } = theme();
    this.scene.background = new Color(background);
    // On a light page surfaces are as light as their colours.
    this.#sky.groundColor.set(dark ? 0x556677 : 0xd5dde6);
    this.#ambient.intensity = dark ? 0.4 : 1;
    this.camera.aspect = width / height;
    // A tall canvas sees as much of the breadth as a square one does.
    this.camera.fov = this.camera.aspect < 1 ? 32 / Math.max(this.camera.aspect, 0.55) : 32;
    this.camera.updateProjectionMatrix();
    const canvas = shared.domElement;
    if (canvas.width < width || canvas.height < height) {
      const [w, h] = [Math.max(canvas.width, width), Math.max(canvas.height, height)];
      shared.setSize(w, h, false);
    }
    shared.setScissorTest(true);
    shared.setViewport(0, 0, width, height);
    shared.setScissor(0, 0, width, height);
    shared.render(this.scene, this.camera);
    context.drawImage(canvas, 0, canvas.height - height, width, height, 0, 0, width, height);
    const pen = new Pen(context, ratio, 13);
    for (const { text, at } of this.picture?.labels?.() ?? this.#names()) {
      const { x, y, z } = new Vector3(...at).project(this.camera);
      if (Math.abs(x) > 1.1 || Math.abs(y) > 1 || z > 1) continue;
      pen.write(text, (0.5 + 0.5 * x) * width, (0.5 - 0.5 * y) * height);
    }
  }

  /** Take everything out of the world and free its memory. */
  #clear(): void {
    this.world.traverse((object) => {
      // Materials stay: the last one of a kind would take its compiled shaders along.
      (object as Partial<Mesh>).geometry?.dispose();
    });
    this.world.clear();
    this.#tracks = [];
  }

  #turn(event: KeyboardEvent): void {
    const turns: Record<string, () => void> = {
      ArrowLeft: () => this.controls.rotateLeft(0.12),
      ArrowRight: () => this.controls.rotateLeft(-0.12),
      ArrowUp: () => this.controls.rotateUp(0.12),
      ArrowDown: () => this.controls.rotateUp(-0.12),
      "+": () => this.controls.dollyIn(1 / 1.12),
      "=": () => this.controls.dollyIn(1 / 1.12),
      "-": () => this.controls.dollyOut(1 / 1.12),
    };
    const turn = turns[event.key];
    if (!turn || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    turn();
  }
}
