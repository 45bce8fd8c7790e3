/** A scene and its motion as a GLB file, which other programs of three dimensions play. */
import {
  AnimationClip,
  Group,
  InterpolateDiscrete,
  Matrix4,
  Object3D,
  Quaternion,
  QuaternionKeyframeTrack,
  ShaderMaterial,
  Vector3,
  VectorKeyframeTrack,
} from "three";
import type { KeyframeTrack, Mesh } from "three";
import { GLTFExporter } from "three/addons/exporters/GLTFExporter.js";
import type { Motion } from "../evaluator/motion.ts";
import { line } from "../views/shapes.ts";
import type { Point } from "../views/shapes.ts";
import type { View3D } from "../views/stage.ts";
import { SCENE_S } from "./recorder.ts";

/** Pictures a second. */
const PICTURES = 30;

/** What is filmed: from a time on, at a speed, between the times that are known. */
export interface Film {
  motion: Motion;
  from: number;
  speed: number;
  range: [number, number] | null;
}

/** Return the scene of a view with its motion in the seconds that follow. */
export async function sceneFile(view: View3D, film: Film): Promise<Blob> {
  const seconds = secondsOf(film);
  const actors = view.actors();
  const poses = actors.map(() => [] as Matrix4[]);
  const paths: Point[][] = [[]];
  for (const second of seconds) {
    const sample = film.motion.at(film.from + second * film.speed);
    view.show(sample);
    view.pose(sample);
    actors.forEach((actor, k) => {
      if (actor.matrixAutoUpdate) actor.updateMatrix();
      poses[k].push(actor.matrix.clone());
    });
    const point = view.pen(sample);
    if (!point) continue;
    const before = paths[paths.length - 1].at(-1);
    if (before && !view.joined(before, point)) paths.push([]);
    paths[paths.length - 1].push(point);
  }
  const { scene, doubles } = copyOf(view.world, actors);
  for (const path of paths) if (path.length > 1) scene.children[0].add(line(path, view.ink));
  const tracks = doubles.flatMap((double, k) => tracksOf(double, seconds, poses[k]));
  const clip = new AnimationClip("motion", seconds[seconds.length - 1], tracks);
  const options = { binary: true, trs: true, onlyVisible: false, animations: [clip] };
  const content = await new GLTFExporter().parseAsync(scene, options);
  return new Blob([content as ArrayBuffer], { type: "model/gltf-binary" });
}

/** Return the seconds of the pictures, fewer where the motion is not known so long. */
function secondsOf({ from, speed, range }: Film): number[] {
  const last = range ? Math.min(SCENE_S, (range[1] - from) / speed) : SCENE_S;
  const count = Math.max(2, Math.round(last * PICTURES) + 1);
  return Array.from({ length: count }, (_, k) => (last * k) / (count - 1));
}

/** Return a copy of the world without its trails, and what stands there for the actors. */
function copyOf(world: Group, actors: Object3D[]): { scene: Object3D; doubles: Object3D[] } {
  const [originals, copies]: Object3D[][] = [[], []];
  const copy = world.clone();
  world.traverse((object) => originals.push(object));
  copy.traverse((object) => copies.push(object));
  const doubles = actors.map((actor) => copies[originals.indexOf(actor)]);
  // Trails are drawn by a program of their own, which no file can carry.
  for (const object of copies) {
    const drawn = (object as Mesh).material instanceof ShaderMaterial || object.userData.live;
    const unseen = !object.visible && !doubles.includes(object);
    if (drawn || unseen) object.removeFromParent();
  }
  // Upwards is z here, and y in these files.
  const root = new Group();
  root.name = "veselova";
  root.rotation.x = -Math.PI / 2;
  root.add(copy);
  return { scene: root, doubles };
}

function tracksOf(double: Object3D, seconds: number[], poses: Matrix4[]): KeyframeTrack[] {
  const [positions, turns, scales]: number[][] = [[], [], []];
  const [position, turn, scale] = [new Vector3(), new Quaternion(), new Vector3()];
  let before: Quaternion | null = null;
  for (const pose of poses) {
    pose.decompose(position, turn, scale);
    // Of the two quaternions of a rotation the one near that before: players go straight between.
    if (before && before.dot(turn) < 0) turn.set(-turn.x, -turn.y, -turn.z, -turn.w);
    before = turn.clone();
    positions.push(...position.toArray());
    turns.push(...turn.toArray());
    scales.push(...scale.toArray());
  }
  poses[0].decompose(double.position, double.quaternion, double.scale);
  double.matrixAutoUpdate = true;
  const name = double.uuid;
  const places = new VectorKeyframeTrack(`${name}.position`, seconds, positions);
  if (double.userData.leaps) places.setInterpolation(InterpolateDiscrete);
  return [
    places,
    new QuaternionKeyframeTrack(`${name}.quaternion`, seconds, turns),
    new VectorKeyframeTrack(`${name}.scale`, seconds, scales),
  ];
}
