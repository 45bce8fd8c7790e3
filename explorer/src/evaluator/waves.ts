/** Sums over waves cos πM·z and sin πM·z of whole vectors M, as products of powers of e^{πi z_s}. */

export interface Terms {
  /** The vectors M, one after the other. */
  orders: Int32Array;
  /** The coefficients of cosines and sines, of each sum. */
  cosines: Float64Array[];
  sines: Float64Array[];
  /** Where each sum goes. */
  places: number[];
}

export class Waves {
  readonly #most: number;
  readonly #real: Float64Array[];
  readonly #imaginary: Float64Array[];
  /** The waves of the terms that were added last. */
  #x = new Float64Array(0);
  #y = new Float64Array(0);

  /** For phases z_1 … z_g and entries of M up to `most` in size. */
  constructor(g: number, most: number) {
    this.#most = most;
    const table = () => Array.from({ length: g }, () => new Float64Array(2 * most + 1));
    this.#real = table();
    this.#imaginary = table();
  }

  /** Take phases. */
  take(z: ArrayLike<number>): void {
    const most = this.#most;
    for (let s = 0; s < this.#real.length; s++) {
      const re = this.#real[s];
      const im = this.#imaginary[s];
      for (let k = 0; k <= most; k++) {
        // Every eighth power anew: the products between lose some 1e-16 each.
        if (k < 2 || k % 8 === 0) {
          re[most + k] = Math.cos(Math.PI * k * z[s]);
          im[most + k] = Math.sin(Math.PI * k * z[s]);
        } else {
          const [a, b] = [re[most + 1], im[most + 1]];
          const [x, y] = [re[most + k - 1], im[most + k - 1]];
          re[most + k] = a * x - b * y;
          im[most + k] = a * y + b * x;
        }
        re[most - k] = re[most + k];
        im[most - k] = -im[most + k];
      }
    }
  }

  /** Add the sums over the waves at these phases, times a factor. */
  add({ orders, cosines, sines, places }: Terms, factor: number, out: Float64Array): void {
    const [real, imaginary, most, g] = [this.#real, this.#imaginary, this.#most, this.#real.length];
    const count = cosines[0].length;
    if (this.#x.length < count) [this.#x, this.#y] = [new Float64Array(count), new Float64Array(count)];
    const [X, Y] = [this.#x, this.#y];
    for (let k = 0; k < count; k++) {
      let x = 1;
      let y = 0;
      for (let s = 0; s < g; s++) {
        const place = most + orders[k * g + s];
        const c = real[s][place];
        const i = imaginary[s][place];
        const turned = x * c - y * i;
        y = x * i + y * c;
        x = turned;
      }
      X[k] = x;
      Y[k] = y;
    }
    for (let j = 0; j < places.length; j++) {
      const [C, S] = [cosines[j], sines[j]];
      let sum = 0;
      for (let k = 0; k < count; k++) sum += C[k] * X[k] + S[k] * Y[k];
      out[places[j]] += factor * sum;
    }
  }
}
