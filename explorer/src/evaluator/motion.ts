/** A motion at any time, from its closed-form document (docs/closed-form.md, "Evaluation"). */
import { AreaBody } from "./area_body.ts";
import { ContactPath } from "./contact_path.ts";
import { type DoubleDouble, parse } from "./double_double.ts";
import type { ClosedFormDocument, Pair } from "./document.ts";
import { apply, cross, dot, product } from "./linear_algebra.ts";
import { ShellBody } from "./shell_body.ts";
import { Spheroconic } from "./spheroconic.ts";
import { ThetaFunctions } from "./theta.ts";
import { TimeMap } from "./time_map.ts";

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

export class ClosedFormMotion implements Motion {
  readonly n: number;
  readonly genus: number;
  readonly revision = 0;
  readonly moments: number[];
  readonly body: AreaBody | null;
  readonly meanVelocity: number[] | null;
  readonly document: ClosedFormDocument;
  readonly #thetas: ThetaFunctions;
  readonly #values: Float64Array;
  readonly #timeMap: TimeMap;
  readonly #directions: number[][];
  readonly #frozen: number[][];
  readonly #coordinates: Spheroconic;
  readonly #path: ContactPath | null;
  readonly #shell: ShellBody | null;

  constructor(document: ClosedFormDocument) {
    const { A, axes, area, path, shell, directions: D } = document;
    this.document = document;
    this.genus = document.genus;
    this.n = A.length;
    this.#thetas = new ThetaFunctions(document.riemann_matrix, document.characteristics, document.reduction);
    this.#values = new Float64Array(this.#thetas.count);
    this.#timeMap = new TimeMap(document);
    // Both are along the principal axes, and the results along the axes that were given.
    const given = (rows: number[][]) => (axes ? product(axes, rows) : rows);
    this.#directions = given(D);
    this.#frozen = given(document.frozen);
    // I_j = 1/(D_j, A D_j) of the directions that move.
    this.#coordinates = new Spheroconic(
      D[0].map((_, j) => 1 / D.reduce((sum, row, i) => sum + A[i] * row[j] ** 2, 0)),
    );
    this.moments = this.#coordinates.moments;
    this.body = area ? new AreaBody(area) : null;
    this.#shell = shell ? new ShellBody(shell, this.#directions, given(shell.still)) : null;
    this.#path = path ? new ContactPath(document, path, this.#timeMap.meanRate) : null;
    this.meanVelocity = this.#path?.meanVelocity ?? null;
  }

  at(t: DoubleDouble | number): Sample {
    const time = typeof t === "number" ? parse(t) : t;
    const { z, tau } = this.#timeMap.phases(time);
    this.#thetas.evaluate(z, this.#values);
    const { q, q_prime, normals, gamma } = this.document;
    const x = this.#entries(q);
    const columns = [...normals, gamma].map((column) => this.#entries(column));
    const prime = this.#entries(q_prime);
    const xPrime = x.map((_, i) => prime.reduce((sum, p, k) => sum + p * columns[k][i], 0));
    const rate = this.#rate();
    const xDot = xPrime.map((entry) => entry / rate);
    const shell = this.#shell?.stateOf(x, xPrime, z, tau);
    const own = this.#frame(x, columns);
    return {
      t: time[0] + time[1],
      ...(shell ?? this.body?.stateOf(own) ?? this.#ownState(own, x, xDot, xPrime)),
      z,
      ...this.#coordinates.of(x, xDot),
      position: shell?.position ?? Float64Array.from(this.#path?.at(z, tau, time) ?? []),
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
    const { rotation } = this.document;
    const frame = new Float64Array(n * n);
    this.#directions.forEach((row, i) => {
      frame[i * n] = dot(row, x);
      const along = normals.map((column) => dot(row, column));
      for (let j = 0; j + 1 < n; j++) {
        let sum = this.#frozen[i][j];
        for (let k = 0; k < along.length; k++) sum += along[k] * rotation[k][j];
        frame[i * n + j + 1] = sum;
      }
    });
    return frame;
  }

  /** Return the state of a body without an area constant, whose Ω is q̇×q. */
  #ownState(frame: Float64Array, ...vectors: number[][]): BodyState {
    const given = (values: number[]) => Float64Array.from(apply(this.#directions, values));
    const [q, velocity, prime] = vectors.map(given);
    const Omega = this.n === 3 ? cross(velocity, q) : new Float64Array(0);
    return { frame, q, velocity, prime, Omega };
  }
}
