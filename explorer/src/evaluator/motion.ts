/** A motion at any time, from its closed-form document (docs/closed-form.md, "Evaluation"). */
import { type AreaBody, areaBody } from "./area_body.ts";
import { contactPath } from "./contact_path.ts";
import { type DoubleDouble, parse } from "./double_double.ts";
import type { ClosedFormDocument, Pair } from "./document.ts";
import { apply, cross, dot, product } from "./linear_algebra.ts";
import { shellBody } from "./shell_body.ts";
import { spheroconic } from "./spheroconic.ts";
import { ThetaFunctions } from "./theta.ts";
import { timeMap } from "./time_map.ts";

/** The state of the body. */
export interface BodyState {
  /** The frame [e_1 … e_n], row by row; e_1 = q. */
  frame: Float64Array;
  q: Float64Array;
  /** dq/dt. */
  velocity: Float64Array;
  /** q' = dq/dτ₁; empty where τ₁ is not known, and with an area constant. */
  prime: Float64Array;
  /** Ω in the body where n = 3, q̇×q where it is horizontal; empty elsewhere. */
  Omega: Float64Array;
}

/** What the views show at one time. */
export interface Sample extends BodyState {
  t: number;
  /** Phases in cycles modulo 2; empty where the motion has no torus. */
  z: Float64Array;
  lambda: Float64Array;
  /** The sign of dλ_s/dt. */
  directions: number[];
  /** The contact point of a ball, along e_2 … e_n, over a sphere along e_1 … e_n; empty elsewhere. */
  position: Float64Array;
}

export interface Motion {
  readonly n: number;
  readonly genus: number;
  /** I_i = 1/A_i of the directions that move, increasing. */
  readonly moments: number[];
  /** The body with an area constant that moves on this torus; null where q itself does. */
  readonly body: AreaBody | null;
  /** The mean velocity of a ball over all times; null where it is not known. */
  readonly meanVelocity: number[] | null;
  /** How many stretches of series have come. */
  readonly revision: number;
  at(t: DoubleDouble | number): Sample;
}

/** Return the motion of a document. */
export function motionOf(document: ClosedFormDocument): Motion {
  const { A, axes, genus, area, path, shell, directions: D, rotation, rate } = document;
  const n = A.length;
  const thetas = new ThetaFunctions(document.riemann_matrix, document.characteristics, document.reduction);
  const values = new Float64Array(thetas.count);
  const times = timeMap(document);
  // Both are along the principal axes, and the results along the axes that were given.
  const given = (rows: number[][]) => (axes ? product(axes, rows) : rows);
  const [directions, frozen] = [D, document.frozen].map(given);
  // I_j = 1/(D_j, A D_j) of the directions that move.
  const coordinates = spheroconic(
    D[0].map((_, j) => 1 / D.reduce((sum, row, i) => sum + A[i] * row[j] ** 2, 0)),
  );
  const body = area ? areaBody(area) : null;
  const shellState = shell ? shellBody(shell, directions, given(shell.still)) : null;
  const contact = path ? contactPath(document, path, times.meanRate) : null;

  const entries = (pairs: Pair[]) => pairs.map(([place, constant]) => (constant * values[place]) / values[0]);
  const frameOf = (x: number[], normals: number[][]) => {
    const frame = new Float64Array(n * n);
    directions.forEach((row, i) => {
      frame[i * n] = dot(row, x);
      const along = normals.map((column) => dot(row, column));
      for (let j = 0; j + 1 < n; j++) {
        frame[i * n + j + 1] = along.reduce((sum, entry, k) => sum + entry * rotation[k][j], frozen[i][j]);
      }
    });
    return frame;
  };
  /** Return the state of a body without an area constant, whose Ω is q̇×q. */
  const ownState = (frame: Float64Array, ...vectors: number[][]): BodyState => {
    const [q, velocity, prime] = vectors.map((x) => Float64Array.from(apply(directions, x)));
    return { frame, q, velocity, prime, Omega: n === 3 ? cross(velocity, q) : new Float64Array(0) };
  };
  const at = (t: DoubleDouble | number): Sample => {
    const time = typeof t === "number" ? parse(t) : t;
    const { z, tau } = times.phases(time);
    thetas.evaluate(z, values);
    const x = entries(document.q);
    const columns = [...document.normals, document.gamma].map(entries);
    const prime = entries(document.q_prime);
    const xPrime = x.map((_, i) => prime.reduce((sum, p, k) => sum + p * columns[k][i], 0));
    // d(time)/dτ₁
    const slope = rate.constant * Math.abs(values[rate.characteristic] / values[0]) ** rate.power;
    const xDot = xPrime.map((entry) => entry / slope);
    const shown = shellState?.(x, xPrime, z, tau);
    const own = frameOf(x, columns);
    return {
      t: time[0] + time[1],
      ...(shown ?? body?.stateOf(own) ?? ownState(own, x, xDot, xPrime)),
      z,
      ...coordinates.of(x, xDot),
      position: shown?.position ?? Float64Array.from(contact?.at(z, tau, time) ?? []),
    };
  };
  const meanVelocity = contact?.meanVelocity ?? null;
  return { n, genus, moments: coordinates.moments, body, meanVelocity, revision: 0, at };
}
