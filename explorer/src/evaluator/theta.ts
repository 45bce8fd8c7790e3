/**
 * Theta functions of a real period matrix iT with half-integer characteristics, all at one z.
 *
 * θ[ε;δ](z) = Σ_{m∈Z^g} exp(−π(m+ε)ᵀT(m+ε)) cos 2π(m+ε)·(z+δ), up to one common factor. In the
 * directions in which T is small the sum is transformed by Poisson's formula: with y = U(z+δ),
 * C = T_FG T_GG⁻¹ and S = T_FF − C T_GF in the basis U,
 *
 *     Σ_{x∈Z^F+ε_F} Σ_{k∈Z^G} exp(−π xᵀSx − π dᵀT_GG⁻¹d) cos 2π[x·(y_F + Cd) + k·ε_G],  d = k − y_G.
 *
 * Without such directions G is empty, U = 1, and the second sum is the first.
 */
import { apply, block, dot, inverse, type Matrix, product, transpose } from "./linear_algebra.ts";
import { type Terms, Waves } from "./waves.ts";

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

/** The functions of equal ε and (Uδ)_G, which share the waves e^{2πi x·(y_F + Cd)}, M = 2x. */
interface Group extends Terms {
  half: number[]; // ε_G
  shift: number[]; // (Uδ)_G
}

export class ThetaFunctions {
  readonly count: number;
  readonly #U: Matrix;
  readonly #F: number[];
  readonly #G: number[];
  readonly #inverse: Matrix;
  readonly #C: Matrix;
  readonly #offsets: number[][];
  readonly #groups: Group[];
  readonly #waves: Waves;

  /** The functions of a document's characteristics [ε, δ]. */
  constructor(
    T: Matrix,
    characteristics: [number[], number[]][],
    reduction: { basis: Matrix; waves: number[] } | null,
  ) {
    this.count = characteristics.length;
    const all = T.map((_, i) => i);
    this.#U = reduction?.basis ?? all.map((i) => all.map((j) => (i === j ? 1 : 0)));
    this.#F = reduction?.waves ?? all;
    this.#G = all.filter((i) => !this.#F.includes(i));
    const reduced = product(product(this.#U, T), transpose(this.#U));
    this.#inverse = inverse(block(reduced, this.#G, this.#G));
    this.#C = product(block(reduced, this.#F, this.#G), this.#inverse);
    const correction = product(this.#C, block(reduced, this.#G, this.#F));
    const S = block(reduced, this.#F, this.#F).map((row, i) =>
      row.map((entry, j) => entry - (correction[i][j] ?? 0)),
    );
    this.#offsets = latticePoints(this.#inverse, this.#G.map(() => 0), 0.5);
    const members = new Map<string, number[]>();
    characteristics.forEach(([epsilon, delta], place) => {
      const key = [...epsilon, ...pick(apply(this.#U, delta), this.#G)].join();
      members.set(key, [...(members.get(key) ?? []), place]);
    });
    this.#groups = [...members.values()].map((places) => this.#group(S, characteristics, places));
    const orders = this.#groups.flatMap((group) => [...group.orders].map(Math.abs));
    this.#waves = new Waves(this.#F.length, Math.max(1, ...orders));
  }

  #group(S: Matrix, characteristics: [number[], number[]][], places: number[]): Group {
    const shifts = places.map((place) => apply(this.#U, characteristics[place][1]));
    const back = transpose(inverse(this.#U).map((row) => row.map(Math.round)));
    const epsilon = apply(back, characteristics[places[0]][0]);
    const size = (x: number[]) => dot(x, apply(S, x));
    const found = latticePoints(S, pick(epsilon, this.#F), 0);
    const least = Math.min(...found.map(size));
    // Where G is empty x and −x have the same term, and one of them stands for both.
    const paired = !this.#G.length;
    const points = found.filter((x) => {
      const kept = !paired || (x.find((entry) => entry !== 0) ?? 1) > 0;
      return kept && Math.PI * (size(x) - least) < SMALLEST_EXPONENT;
    });
    const weight = (x: number[]) => (paired && x.some(Boolean) ? 2 : 1) * Math.exp(-Math.PI * size(x));
    const terms = (wave: (angle: number) => number) =>
      shifts.map((shift) =>
        Float64Array.from(points, (x) => weight(x) * wave(2 * Math.PI * dot(x, pick(shift, this.#F)))),
      );
    return {
      places,
      orders: Int32Array.from(points.flatMap((x) => x.map((entry) => Math.round(2 * entry)))),
      cosines: terms(Math.cos),
      sines: terms((angle) => -Math.sin(angle)),
      half: pick(epsilon, this.#G),
      shift: pick(shifts[0], this.#G),
    };
  }

  /** Write the values at z, divided by one common factor, into `out`. */
  evaluate(z: ArrayLike<number>, out: Float64Array): void {
    const y = apply(this.#U, z);
    const [yF, yG] = [pick(y, this.#F), pick(y, this.#G)];
    out.fill(0);
    if (!this.#G.length) this.#waves.take(yF);
    for (const group of this.#groups) {
      const middle = yG.map((entry, i) => entry + group.shift[i]);
      for (const offset of this.#offsets) {
        const k = offset.map((step, i) => Math.round(middle[i]) + step);
        const d = k.map((entry, i) => entry - middle[i]);
        if (d.length) this.#waves.take(yF.map((entry, i) => entry + dot(this.#C[i], d)));
        const gaussian = Math.exp(-Math.PI * dot(d, apply(this.#inverse, d)));
        // 2k·ε_G is whole: the sign of its half turns.
        const sign = Math.round(2 * dot(k, group.half)) % 2 ? -1 : 1;
        this.#waves.add(group, sign * gaussian, out);
      }
    }
  }
}

const pick = (x: ArrayLike<number>, places: number[]): number[] => places.map((i) => x[i]);
