/**
 * Theta functions of a real period matrix iT with half-integer characteristics, all at one z.
 *
 * θ[ε;δ](z) = Σ_{m∈Z^g} exp(−π(m+ε)ᵀT(m+ε)) cos 2π(m+ε)·(z+δ), up to one common factor. In the
 * directions in which T is small the sum is transformed by Poisson's formula: with y = U(z+δ),
 * C = T_FG T_GG⁻¹ and S = T_FF − C T_GF in the basis U,
 *
 *     Σ_{x∈Z^F+ε_F} Σ_{k∈Z^G} exp(−π xᵀSx − π dᵀT_GG⁻¹d) cos 2π[x·(y_F + Cd) + k·ε_G],  d = k − y_G.
 */
import { apply, block, dot, inverse, product, transpose } from "./linear_algebra.ts";
import type { Matrix } from "./linear_algebra.ts";

/** Terms below exp(−39) = 1e-17 of the largest are left out. */
const SMALLEST_EXPONENT = 39;

/** Return the points x of Z^d + shift whose Gaussian of this form counts beside that of a point of the cube of half width `margin`. */
function latticePoints(form: Matrix, shift: number[], margin: number): number[][] {
  if (form.length === 0) return [[]];
  const diagonal = inverse(form).map((row, i) => row[i]);
  const corner = margin * margin * form.flat().reduce((sum, entry) => sum + Math.abs(entry), 0);
  const bound = SMALLEST_EXPONENT / Math.PI + dot(shift, apply(form, shift)) + corner;
  let points: number[][] = [[]];
  diagonal.forEach((entry, i) => {
    const reach = Math.sqrt(bound * entry) + margin;
    const steps: number[] = [];
    for (let k = Math.ceil(-reach - shift[i]); k <= Math.floor(reach - shift[i]); k++) {
      steps.push(k + shift[i]);
    }
    points = points.flatMap((point) => steps.map((step) => [...point, step]));
  });
  return points;
}

export interface ThetaFunctions {
  readonly count: number;
  /** Write the values at z, divided by one common factor, into `out`. */
  evaluate(z: ArrayLike<number>, out: Float64Array): void;
}

/** Return the functions of a document's characteristics [ε, δ]. */
export function thetaFunctions(
  T: Matrix,
  characteristics: [number[], number[]][],
  reduction: { basis: Matrix; waves: number[] } | null,
): ThetaFunctions {
  return reduction === null
    ? new PlainSums(T, characteristics)
    : new TransformedSums(T, characteristics, reduction.basis, reduction.waves);
}

interface Group {
  /** 2(m+ε), whole numbers, for one of each pair ±(m+ε). */
  orders: Int32Array;
  terms: number;
  places: number[];
  cosines: Float64Array[];
  sines: Float64Array[];
}

/** The series itself; functions of equal ε share the waves e^{πi 2(m+ε)·z}. */
class PlainSums implements ThetaFunctions {
  readonly count: number;
  readonly #g: number;
  readonly #groups: Group[];
  readonly #most: number;
  readonly #real: Float64Array[];
  readonly #imaginary: Float64Array[];

  constructor(T: Matrix, characteristics: [number[], number[]][]) {
    this.count = characteristics.length;
    this.#g = T.length;
    const places = new Map<string, number[]>();
    characteristics.forEach(([epsilon], place) => {
      const key = epsilon.join();
      places.set(key, [...(places.get(key) ?? []), place]);
    });
    this.#groups = [...places.values()].map((members) => group(T, characteristics, members));
    this.#most = Math.max(...this.#groups.flatMap(({ orders }) => [...orders].map(Math.abs)));
    const table = () => T.map(() => new Float64Array(2 * this.#most + 1));
    this.#real = table();
    this.#imaginary = table();
  }

  evaluate(z: ArrayLike<number>, out: Float64Array): void {
    const g = this.#g;
    const most = this.#most;
    powersOfWaves(z, most, Math.PI, this.#real, this.#imaginary);
    for (const { orders, terms, places, cosines, sines } of this.#groups) {
      for (const place of places) out[place] = 0;
      for (let k = 0; k < terms; k++) {
        let x = this.#real[0][most + orders[k * g]];
        let y = this.#imaginary[0][most + orders[k * g]];
        for (let i = 1; i < g; i++) {
          const c = this.#real[i][most + orders[k * g + i]];
          const s = this.#imaginary[i][most + orders[k * g + i]];
          const turned = x * c - y * s;
          y = x * s + y * c;
          x = turned;
        }
        for (let j = 0; j < places.length; j++) {
          out[places[j]] += cosines[j][k] * x - sines[j][k] * y;
        }
      }
    }
  }
}

/** Return the terms of the functions at `members`, which have equal ε. */
function group(T: Matrix, characteristics: [number[], number[]][], members: number[]): Group {
  const epsilon = characteristics[members[0]][0];
  const size = (m: number[]) => dot(m, apply(T, m));
  const least = size(epsilon);
  const points = latticePoints(T, epsilon, 0).filter((m) => {
    const lead = m.find((entry) => entry !== 0);
    return (lead === undefined || lead > 0) && Math.PI * (size(m) - least) < SMALLEST_EXPONENT;
  });
  const cosines: Float64Array[] = [];
  const sines: Float64Array[] = [];
  for (const place of members) {
    const delta = characteristics[place][1];
    const weight = (m: number[]) => (m.some(Boolean) ? 2 : 1) * Math.exp(-Math.PI * size(m));
    const angle = (m: number[]) => 2 * Math.PI * dot(m, delta);
    cosines.push(Float64Array.from(points, (m) => weight(m) * Math.cos(angle(m))));
    sines.push(Float64Array.from(points, (m) => weight(m) * Math.sin(angle(m))));
  }
  const orders = Int32Array.from(points.flatMap((m) => m.map((entry) => Math.round(2 * entry))));
  return { orders, terms: points.length, places: members, cosines, sines };
}

/** Write e^{i·unit·k·z_s} for |k| ≤ most into the tables of each s. */
export function powersOfWaves(
  z: ArrayLike<number>,
  most: number,
  unit: number,
  real: Float64Array[],
  imaginary: Float64Array[],
): void {
  for (let s = 0; s < real.length; s++) {
    const re = real[s];
    const im = imaginary[s];
    for (let k = 0; k <= most; k++) {
      // Every eighth power anew: the products between lose some 1e-16 each.
      if (k % 8 === 0) {
        re[most + k] = Math.cos(unit * k * z[s]);
        im[most + k] = Math.sin(unit * k * z[s]);
      } else {
        const [a, b] = [re[most + 1], im[most + 1]];
        const [x, y] = [re[most + k - 1], im[most + k - 1]];
        re[most + k] = k === 1 ? Math.cos(unit * z[s]) : a * x - b * y;
        im[most + k] = k === 1 ? Math.sin(unit * z[s]) : a * y + b * x;
      }
      re[most - k] = re[most + k];
      im[most - k] = -im[most + k];
    }
  }
}

interface TransformedFunction {
  shift: number[]; // Uδ
  waves: number[][]; // x
  weights: number[]; // exp(−π xᵀSx)
  half: number[]; // ε_G
}

/** The sum above, for T with small eigenvalues. */
class TransformedSums implements ThetaFunctions {
  readonly count: number;
  readonly #U: Matrix;
  readonly #F: number[];
  readonly #G: number[];
  readonly #inverse: Matrix;
  readonly #C: Matrix;
  readonly #offsets: number[][];
  readonly #functions: TransformedFunction[];

  constructor(T: Matrix, characteristics: [number[], number[]][], U: Matrix, waves: number[]) {
    this.count = characteristics.length;
    this.#U = U;
    this.#F = waves;
    this.#G = T.map((_, i) => i).filter((i) => !waves.includes(i));
    const reduced = product(product(U, T), transpose(U));
    this.#inverse = inverse(block(reduced, this.#G, this.#G));
    this.#C = product(block(reduced, this.#F, this.#G), this.#inverse);
    const correction = product(this.#C, block(reduced, this.#G, this.#F));
    const S = block(reduced, this.#F, this.#F).map((row, i) =>
      row.map((entry, j) => entry - (this.#G.length ? correction[i][j] : 0)),
    );
    const still = this.#G.map(() => 0);
    this.#offsets = latticePoints(this.#inverse, still, 0.5);
    const transposed = transpose(inverse(U).map((row) => row.map(Math.round)));
    this.#functions = characteristics.map(([epsilon, delta]) => {
      const half = apply(transposed, epsilon);
      const points = latticePoints(S, pick(half, this.#F), 0);
      const weights = points.map((x) => Math.exp(-Math.PI * dot(x, apply(S, x))));
      return { shift: apply(U, delta), waves: points, weights, half: pick(half, this.#G) };
    });
  }

  evaluate(z: ArrayLike<number>, out: Float64Array): void {
    const base = apply(this.#U, z);
    this.#functions.forEach((one, place) => {
      const y = base.map((entry, i) => entry + one.shift[i]);
      const yG = pick(y, this.#G);
      const yF = pick(y, this.#F);
      let sum = 0;
      for (const offset of this.#offsets) {
        const k = offset.map((step, i) => Math.round(yG[i]) + step);
        const d = k.map((entry, i) => entry - yG[i]);
        const gaussian = Math.exp(-Math.PI * dot(d, apply(this.#inverse, d)));
        const moved = yF.map((entry, i) => entry + dot(this.#C[i], d));
        const sign = dot(k, one.half);
        for (let j = 0; j < one.waves.length; j++) {
          const angle = dot(one.waves[j], moved) + sign;
          sum += gaussian * one.weights[j] * Math.cos(2 * Math.PI * angle);
        }
      }
      out[place] = sum;
    });
  }
}

const pick = (x: ArrayLike<number>, places: number[]): number[] => places.map((i) => x[i]);
