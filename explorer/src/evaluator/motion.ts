/** A motion at any time, from its closed-form document (docs/closed-form.md, "Evaluation"). */
import type { DoubleDouble } from "./double_double.ts";
import { parse } from "./double_double.ts";
import { matrix, vector } from "./document.ts";
import type { ClosedFormDocument, Pair } from "./document.ts";
import { cross, dot, product } from "./linear_algebra.ts";
import { AreaBody } from "./area_body.ts";
import type { BodyState } from "./body_state.ts";
import { ContactPath } from "./contact_path.ts";
import { ShellBody } from "./shell_body.ts";
import { directions, spheroconic } from "./spheroconic.ts";
import { thetaFunctions } from "./theta.ts";
import type { ThetaFunctions } from "./theta.ts";
import { TimeMap } from "./time_map.ts";

/** What the views show at one time. */
export interface Sample extends BodyState {
  t: number;
  /** Phases in cycles modulo 2; empty where the motion has no torus. */
  z: Float64Array;
  lambda: Float64Array;
  /** The sign of dλ_s/dt. */
  directions: number[];
  /** The contact point of a ball, along e_2 … e_n; over a sphere along e_1 … e_n. */
  position: number[] | null;
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
  at(t: DoubleDouble | number): Sample;
}

export class ClosedFormMotion implements Motion {
  readonly n: number;
  readonly genus: number;
  readonly moments: number[];
  readonly body: AreaBody | null;
  readonly document: ClosedFormDocument;
  readonly #thetas: ThetaFunctions;
  readonly #values: Float64Array;
  readonly #timeMap: TimeMap;
  readonly #directions: number[][];
  readonly #rotation: number[][];
  readonly #frozen: number[][];
  readonly #order: number[];
  readonly #path: ContactPath | null;
  readonly #shell: ShellBody | null;

  constructor(document: ClosedFormDocument) {
    this.document = document;
    this.genus = document.genus;
    this.n = document.A.length;
    this.#thetas = thetaFunctions(
      matrix(document.riemann_matrix),
      document.characteristics,
      document.reduction,
    );
    this.#values = new Float64Array(this.#thetas.count);
    this.#timeMap = new TimeMap(document);
    // Both are along the principal axes, and the results along the axes that were given.
    const given = (rows: number[][]) =>
      document.axes ? product(matrix(document.axes), rows) : rows;
    this.#directions = given(matrix(document.directions));
    this.#rotation = matrix(document.rotation);
    this.#frozen = given(matrix(document.frozen));
    const moments = momentsOf(document);
    this.#order = moments.map((_, i) => i).sort((i, j) => moments[i] - moments[j]);
    this.moments = this.#order.map((i) => moments[i]);
    this.#path = document.path ? new ContactPath(document) : null;
    const { shell } = document;
    this.#shell = shell ? new ShellBody(shell, this.#directions, given(matrix(shell.still))) : null;
    this.body = document.area ? new AreaBody(document.area) : null;
  }

  get meanVelocity(): number[] | null {
    return this.#path?.meanVelocity ?? null;
  }

  at(t: DoubleDouble | number): Sample {
    const time = typeof t === "number" ? parse(t) : t;
    const { z, tau } = this.#timeMap.phases(time);
    return this.#atPhases(z, tau, time);
  }

  #atPhases(z: Float64Array, tau: number, time: DoubleDouble): Sample {
    this.#thetas.evaluate(z, this.#values);
    const x = this.#entries(this.document.q);
    const normals = [...this.document.normals, this.document.gamma].map((column) =>
      this.#entries(column),
    );
    const prime = this.#entries(this.document.q_prime);
    const rate = this.#rate();
    const xPrime = x.map((_, i) => prime.reduce((sum, p, k) => sum + p * normals[k][i], 0));
    const xDot = xPrime.map((entry) => entry / rate);
    const sorted = this.#order.map((i) => x[i]);
    const lambda = spheroconic(sorted, this.moments, new Float64Array(this.genus));
    const sortedDot = this.#order.map((i) => xDot[i]);
    const shell = this.#shell?.stateOf(x, xPrime, z, tau);
    const own = this.#frame(x, normals);
    const along = (values: number[]) => Float64Array.from(this.#directions, (row) => dot(row, values));
    const state =
      shell ?? this.body?.stateOf(own) ?? ownState(own, along(x), along(xDot), along(xPrime));
    return {
      t: time[0] + time[1],
      ...state,
      z,
      lambda,
      directions: directions(sorted, sortedDot, this.moments, lambda),
      position: shell?.position ?? this.#path?.at(z, tau, time) ?? null,
    };
  }

  #entries(pairs: Pair[]): number[] {
    return pairs.map(([place, constant]) => (constant * this.#values[place]) / this.#values[0]);
  }

  /** d(time)/dτ₁. */
  #rate(): number {
    const { characteristic, constant, power } = this.document.rate;
    const quotient = Math.abs(this.#values[characteristic] / this.#values[0]);
    return constant * quotient ** power;
  }

  #frame(x: number[], normals: number[][]): Float64Array {
    const n = this.n;
    const frame = new Float64Array(n * n);
    this.#directions.forEach((row, i) => {
      frame[i * n] = dot(row, x);
      const along = normals.map((column) => dot(row, column));
      for (let j = 0; j + 1 < n; j++) {
        let sum = this.#frozen[i][j];
        for (let k = 0; k < along.length; k++) sum += along[k] * this.#rotation[k][j];
        frame[i * n + j + 1] = sum;
      }
    });
    return frame;
  }
}

/** Return the state of a body without an area constant, whose Ω is q̇×q. */
function ownState(
  frame: Float64Array,
  q: Float64Array,
  velocity: Float64Array,
  prime: Float64Array,
): BodyState {
  const Omega = q.length === 3 ? cross(velocity, q) : new Float64Array(0);
  return { frame, q, velocity, prime, Omega };
}

/** Return I_j = 1/(D_j, A D_j) of the directions that move. */
function momentsOf(document: ClosedFormDocument): number[] {
  const A = vector(document.A);
  const D = matrix(document.directions);
  return D[0].map((_, j) => 1 / D.reduce((sum, row, i) => sum + A[i] * row[j] ** 2, 0));
}
