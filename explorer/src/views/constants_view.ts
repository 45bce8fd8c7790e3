/**
 * The constants and the regimes. For n = 3 the plane of c_2 and λ: where λ_1 and λ_2 move, for every
 * c_2. For n = 4 the plane of c_2 and c_3. A click is a start with the constants clicked at.
 */
import type { Sample } from "../evaluator/motion.ts";
import { disc, stroke } from "./curve_view.ts";
import { Names } from "./names.ts";
import { GREEN, ORANGE, PINK, theme, VERMILION } from "./theme.ts";
import { element, namedConstants, originName, short, View, WITHOUT_TORUS } from "./view.ts";
import type { Loaded, Torus } from "./view.ts";

/** What a click chooses: c_2 … c_{n−1} and λ_1 … λ_{n−1}; c_1 where it is not 0. */
export interface Choice {
  c1?: number;
  constants: number[];
  lambda: number[];
}

/** Room at the sides of the map, parts of the canvas. */
const [LEFT, RIGHT, TOP, BOTTOM] = [0.11, 0.04, 0.05, 0.13];

type Place = [number, number];

/** A part of the map: its colour, its corners and its name. */
type Cell = [string, Place[], string];

export class ConstantsView extends View {
  #torus: Torus | null = null;
  #I: number[] = [];
  /** The names of the I, which need not increase with them; as on the curve. */
  #names: string[] = [];
  #lambda: number[] = [];
  /** c_2 … of this motion, and its c_1, which is 0 but for Neumann's system. */
  #c: number[] = [];
  #c1 = 0;
  #cursor: [number, number] | null = null;
  readonly #choose: (choice: Choice) => void;

  constructor(choose: (choice: Choice) => void) {
    super("constants", "Constants");
    this.#choose = choose;
    this.canvas.classList.add("map");
    this.canvas.addEventListener("click", (event) => {
      const box = this.canvas.getBoundingClientRect();
      const x = (event.clientX - box.left) / box.width;
      this.#pick(x, (event.clientY - box.top) / box.height);
    });
    this.canvas.addEventListener("keydown", (event) => this.#key(event));
  }

  refusal({ torus, motion, cause }: Loaded): string | null {
    if (!torus || !motion.genus) return cause ?? WITHOUT_TORUS;
    if (motion.body) {
      return "With an area constant, (Ω,γ) or (K,γ) not zero, I changes with the start: no map holds for all starts.";
    }
    if (motion.n < 3) return "In two dimensions the energy is the only constant.";
    if (motion.n > 4) return "The map shows motions in three and four dimensions.";
    return motion.genus < motion.n - 1 ? "The map shows motions in which every λ swings; here one does not." : null;
  }

  build({ torus, motion }: Loaded): void {
    this.#torus = torus;
    this.#I = motion.moments;
    this.#names = (torus?.origins ?? []).filter((name) => name[0] === "I").map(originName);
    this.#cursor = null;
    // Neumann's system has c_1 besides, which the map keeps.
    this.#c = torus ? torus.constants.slice(2 - motion.n) : [];
    this.#c1 = torus && torus.constants.length > this.#c.length ? torus.constants[0] : 0;
    const kept = this.#c1 ? ` with c₁ = ${short(this.#c1)}` : "";
    this.say(
      motion.n === 3
        ? `All motions${kept} at once: each vertical line is one c₂, and λ₁, λ₂ swing in its coloured parts.`
        : `All motions${kept} at once: each point is a pair c₂, c₃, and each colour a regime.`,
      motion.n === 3 ? "Orange: this motion, with λ₁ green and λ₂ pink." : "Large dot: this motion.",
    );
    this.caption.append(element("span", { class: "choice" }, " Click for a new start."));
  }

  show({ lambda }: Sample): void {
    this.#lambda = Array.from(lambda);
  }

  get #flat(): boolean {
    return this.#I.length === 3;
  }

  /** Return the ranges of the two axes. */
  #ranges(): [[number, number], [number, number]] {
    const I = this.#I;
    const low = Math.max(I[0], this.#c1);
    return this.#flat
      ? [[low, I[2]], [low, I[2]]]
      : [[low, I[2]], [I[1], I[3]]];
  }

  #x(value: number): number {
    const [low, high] = this.#ranges()[0];
    const part = (value - low) / (high - low);
    return (LEFT + (1 - LEFT - RIGHT) * part) * this.canvas.width;
  }

  #y(value: number): number {
    const [low, high] = this.#ranges()[1];
    const part = (value - low) / (high - low);
    return (1 - BOTTOM - (1 - TOP - BOTTOM) * part) * this.canvas.height;
  }

  draw(): void {
    const ratio = this.fit();
    const context = this.canvas.getContext("2d");
    const torus = this.#torus;
    if (!context || !torus) return;
    const colours = theme();
    context.fillStyle = colours.background;
    context.fillRect(0, 0, this.canvas.width, this.canvas.height);
    const names = new Names(context, ratio, 12);
    for (const [x, y] of this.#marks()) names.keepFree(x, y, 8 * ratio);
    const cells = this.#flat ? this.#zones() : this.#cells();
    for (const [colour, corners] of cells) this.#fill(context, colour, corners);
    this.#drawAxes(context, names, ratio);
    context.lineWidth = 1.5 * ratio;
    if (this.#flat) {
      context.strokeStyle = ORANGE;
      const x = this.#x(this.#c[0]);
      stroke(context, [[x, TOP * this.canvas.height], [x, (1 - BOTTOM) * this.canvas.height]]);
    }
    for (const [, corners, name] of cells) {
      const middle = centroid(corners.map(([x, y]) => [this.#x(x), this.#y(y)]));
      if (!middle) continue;
      // Beside the line of the motion.
      const off = this.#flat ? middle[0] - this.#x(this.#c[0]) : Infinity;
      const aside = Math.abs(off) < 14 * ratio ? Math.sign(off || 1) * 18 * ratio - off : 0;
      names.write(name, middle[0] + aside, middle[1]);
    }
    this.#marks().forEach(([x, y], s) => {
      this.#mark(context, x, y, this.#flat ? (s ? PINK : GREEN) : VERMILION, ratio);
    });
    if (this.#cursor && document.activeElement === this.canvas) {
      const [x, y] = [this.#cursor[0] * this.canvas.width, this.#cursor[1] * this.canvas.height];
      context.strokeStyle = colours.text;
      stroke(context, [[x - 9 * ratio, y], [x + 9 * ratio, y]]);
      stroke(context, [[x, y - 9 * ratio], [x, y + 9 * ratio]]);
    }
  }

  /** Return where the marks of the motion are, in pixels. */
  #marks(): Place[] {
    const [c2, c3] = this.#c;
    if (!this.#flat) return [[this.#x(c2), this.#y(c3)]];
    return this.#lambda.map((value) => [this.#x(c2), this.#y(value)]);
  }

  #mark(context: CanvasRenderingContext2D, x: number, y: number, fill: string, ratio: number) {
    context.fillStyle = theme().text;
    disc(context, x, y, 6.5 * ratio);
    context.fillStyle = fill;
    disc(context, x, y, 4.5 * ratio);
  }

  /** Shade a polygon of places of the map. */
  #fill(context: CanvasRenderingContext2D, colour: string, places: Place[]): void {
    const corners = places.map(([x, y]): Place => [this.#x(x), this.#y(y)]);
    context.globalAlpha = 0.38;
    context.fillStyle = colour;
    context.beginPath();
    for (const corner of corners) context.lineTo(...corner);
    context.fill();
    context.globalAlpha = 1;
  }

  /** Return where λ_1 and λ_2 move, for each c_2. */
  #zones(): Cell[] {
    const [, middle, high] = this.#I;
    const low = this.#ranges()[0][0];
    // λ_1 ∈ [max(c_1, I_1), min(c_2, I_2)], λ_2 ∈ [max(c_2, I_2), I_3].
    return [
      [GREEN, [[low, low], [middle, middle], [high, middle], [high, low]], "λ₁"],
      [PINK, [[low, middle], [middle, middle], [high, high], [low, high]], "λ₂"],
    ];
  }

  /** Return the four regimes of c_2 < c_3. */
  #cells(): Cell[] {
    const [, I2, I3, I4] = this.#I;
    const low = this.#ranges()[0][0];
    const [, second, third] = this.#names;
    return [
      [GREEN, [[low, I2], [I2, I2], [I2, I3], [low, I3]], `c₂ < ${second} < c₃ < ${third}`],
      [ORANGE, [[low, I3], [I2, I3], [I2, I4], [low, I4]], `c₂ < ${second}, ${third} < c₃`],
      [PINK, [[I2, I3], [I3, I3], [I3, I4], [I2, I4]], `${second} < c₂ < ${third} < c₃`],
      [VERMILION, [[I2, I2], [I3, I3], [I2, I3]], `${second} < c₂, c₃ < ${third}`],
    ];
  }

  #drawAxes(context: CanvasRenderingContext2D, written: Names, ratio: number): void {
    const colours = theme();
    const { width, height } = this.canvas;
    context.strokeStyle = colours.dim;
    context.lineWidth = ratio;
    const [[left, right], [bottom]] = this.#ranges();
    const I = [...new Set([...this.#I, left])].sort((a, b) => a - b);
    const inX = I.filter((value) => value >= left && value <= right);
    const inY = I.filter((value) => value >= bottom);
    context.setLineDash([4 * ratio, 4 * ratio]);
    for (const x of inX.map((value) => this.#x(value))) {
      stroke(context, [[x, TOP * height], [x, (1 - BOTTOM) * height]]);
    }
    for (const y of inY.map((value) => this.#y(value))) {
      stroke(context, [[LEFT * width, y], [(1 - RIGHT) * width, y]]);
    }
    context.setLineDash([]);
    const names = this.#flat ? ["c₂", "λ"] : ["c₂", "c₃"];
    const under = (1 - BOTTOM) * height + 11 * ratio;
    for (const value of inX) written.write(this.#nameOf(value), this.#x(value), under);
    written.write(names[0], this.#besideMarks(inX, 0), under);
    const beside = LEFT * width - 6 * ratio;
    for (const value of inY) written.write(this.#nameOf(value), beside, this.#y(value), "right");
    written.write(names[1], beside, this.#besideMarks(inY, 1), "right");
  }

  /** Return the name of a moment; those that are equal share a place. */
  #nameOf(value: number): string {
    if (value === this.#c1) return "c₁";
    return [...new Set(this.#I.flatMap((other, k) => (other === value ? [this.#names[k]] : [])))].join();
  }

  /** Return the middle of the widest gap between the marks of an axis. */
  #besideMarks(marks: number[], axis: 0 | 1): number {
    const places = marks.map((value) => (axis ? this.#y(value) : this.#x(value)));
    const gaps = places.slice(1).map((place, k): Place => [Math.abs(place - places[k]), k]);
    const [, k] = gaps.reduce((widest, gap) => (gap[0] > widest[0] ? gap : widest));
    return (places[k] + places[k + 1]) / 2;
  }

  #key(event: KeyboardEvent): void {
    const steps: Record<string, [number, number]> = {
      ArrowLeft: [-0.02, 0],
      ArrowRight: [0.02, 0],
      ArrowUp: [0, -0.02],
      ArrowDown: [0, 0.02],
    };
    const [x, y] = this.#cursor ?? [0.5, 0.45];
    if (event.key === "Enter") this.#pick(x, y);
    const step = steps[event.key];
    if (!step) return;
    event.preventDefault();
    this.#cursor = [x + step[0], y + step[1]];
  }

  /** Choose the constants at a place of the canvas. */
  #pick(x: number, y: number): void {
    const [[low, high], [bottom, top]] = this.#ranges();
    const across = low + ((high - low) * (x - LEFT)) / (1 - LEFT - RIGHT);
    const up = bottom + ((top - bottom) * (1 - BOTTOM - y)) / (1 - TOP - BOTTOM);
    const choice = this.#flat ? zoneChoice(this.#I, across, up, low) : cellChoice(this.#I, across, up, low);
    if (choice && choice.constants[0] > low) this.#choose({ ...choice, c1: this.#c1 });
  }

  describe(): string {
    if (!this.#torus) return "";
    const { regime } = this.#torus;
    return `${namedConstants(this.#torus)}; the regime is ${regime}. ${[...new Set(this.#I.map((value) => `${this.#nameOf(value)} = ${short(value)}`))].join(", ")}.`;
  }
}

/** Return the middle of a polygon; null of one without an area. */
function centroid(corners: Place[]): Place | null {
  let [area, x, y] = [0, 0, 0];
  corners.forEach(([a, b], k) => {
    const [c, d] = corners[(k + 1) % corners.length];
    const part = a * d - b * c;
    area += part;
    x += (a + c) * part;
    y += (b + d) * part;
  });
  return Math.abs(area) < 400 ? null : [x / (3 * area), y / (3 * area)];
}

/** Return c_2 and λ of a place in the map of n = 3; null outside of what moves. */
function zoneChoice(I: number[], c2: number, value: number, least: number): Choice | null {
  if (!(c2 > least && c2 < I[2])) return null;
  const cuts = [[least, Math.min(c2, I[1])], [Math.max(c2, I[1]), I[2]]];
  const chosen = cuts.findIndex(([low, high]) => value > low && value < high);
  if (chosen < 0) return null;
  const lambda = cuts.map(([low, high], s) => (s === chosen ? value : (low + high) / 2));
  return { constants: [c2], lambda };
}

/** Return c_2, c_3 and λ in the middle of the cuts; null where no motion has them. */
function cellChoice(I: number[], c2: number, c3: number, least: number): Choice | null {
  if (!(c2 > I[0] && c2 < I[2] && c3 > I[1] && c3 < I[3] && c2 < c3)) return null;
  const [inner, outer] = [[least, c2, c3], [c2, c3, Infinity]];
  const lambda = [0, 1, 2].map((s) => {
    const left = Math.max(inner[s], I[s]);
    return (left + Math.min(outer[s], I[s + 1])) / 2;
  });
  return { constants: [c2, c3], lambda };
}

/**
 * Return q and q' of a choice: q_i² = Π(I_i − λ_s)/Π_{j≠i}(I_i − I_j) and
 * λ_s' = 2w_s/Π_{j≠s}(λ_s − λ_j), w² = R(λ). I increases; signs are those given.
 */
export function startOf(I: number[], { c1 = 0, constants, lambda }: Choice, signs: number[]) {
  const q = I.map((value, i) => {
    const above = lambda.reduce((product, l) => product * (value - l), 1);
    const below = I.reduce((product, other, j) => (j === i ? product : product * (value - other)), 1);
    return signs[i] * Math.sqrt(Math.max(0, above / below));
  });
  const speeds = lambda.map((value, s) => {
    const R = [c1, ...constants, ...I].reduce((product, b) => product * (value - b), -1);
    const below = lambda.reduce((product, l, j) => (j === s ? product : product * (value - l)), 1);
    return (2 * Math.sqrt(Math.abs(R))) / below;
  });
  const prime = q.map((entry, i) =>
    lambda.reduce((sum, value, s) => sum + (entry / 2) * (speeds[s] / (value - I[i])), 0),
  );
  return { q, prime };
}
