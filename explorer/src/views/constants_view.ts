/**
 * The constants and the regimes. For n = 3 the plane of c_2 and λ: where λ_1 and λ_2 move, for every
 * c_2. For n = 4 the plane of c_2 and c_3. A click is a start with the constants clicked at.
 */
import { type Drawing, type Pen, type Place, View2D } from "./plane.ts";
import { GREEN, ORANGE, PINK, SERIES, theme, VERMILION } from "./theme.ts";
import { element, type Loaded, namedConstants, originName, short, WITHOUT_TORUS } from "./view.ts";

/** What a click chooses: c_2 … c_{n−1} and λ_1 … λ_{n−1}; c_1 where it is not 0. */
export interface Choice {
  c1?: number;
  constants: number[];
  lambda: number[];
}

/** Room at the sides of the map, parts of the canvas. */
const [LEFT, RIGHT, TOP, BOTTOM] = [0.11, 0.04, 0.05, 0.13];

/** A part of the map: its colour, its corners and its name. */
type Cell = [string, Place[], string];

/** What a map is of. */
interface Regimes {
  I: number[];
  /** The names of the I, which need not increase with them; as on the curve. */
  names: string[];
  /** c_1, which is 0 but for Neumann's system. */
  c1: number;
  /** The ranges of the two axes. */
  across: Place;
  up: Place;
}

/** A map, and the choice at a place of its canvas. */
interface ChoiceMap extends Drawing {
  pick: (x: number, y: number) => Choice | null;
}

const STEPS: Record<string, Place> = {
  ArrowLeft: [-0.02, 0],
  ArrowRight: [0.02, 0],
  ArrowUp: [0, -0.02],
  ArrowDown: [0, 0.02],
};

export class ConstantsView extends View2D<ChoiceMap> {
  #cursor: Place | null = null;

  constructor(choose: (choice: Choice) => void) {
    super("constants", "Constants");
    const pick = (x: number, y: number) => {
      const choice = this.picture?.pick(x, y);
      if (choice) choose(choice);
    };
    this.canvas.classList.add("map");
    this.canvas.addEventListener("click", ({ clientX, clientY }) => {
      const { left, top, width, height } = this.canvas.getBoundingClientRect();
      pick((clientX - left) / width, (clientY - top) / height);
    });
    this.canvas.addEventListener("keydown", (event) => {
      const [x, y] = this.#cursor ?? [0.5, 0.45];
      if (event.key === "Enter") pick(x, y);
      const step = STEPS[event.key];
      if (!step) return;
      event.preventDefault();
      this.#cursor = [x + step[0], y + step[1]];
    });
  }

  override refusal({ torus, motion, cause }: Loaded): string | null {
    if (!torus || !motion.genus) return cause ?? WITHOUT_TORUS;
    if (motion.body) {
      return "With an area constant, (Ω,γ) or (K,γ) not zero, I changes with the start: no map holds for all starts.";
    }
    if (motion.n < 3) return "In two dimensions the energy is the only constant.";
    if (motion.n > 4) return "The map shows motions in three and four dimensions.";
    return motion.genus < motion.n - 1 ? "The map shows motions in which every λ swings; here one does not." : null;
  }

  build(loaded: Loaded): ChoiceMap {
    const torus = loaded.torus!;
    const { n, moments: I } = loaded.motion;
    const flat = n === 3;
    // Neumann's system has c_1 besides, which the map keeps.
    const [c2, c3] = torus.constants.slice(2 - n);
    const c1 = torus.constants.length > n - 2 ? torus.constants[0] : 0;
    const across: Place = [Math.max(I[0], c1), I[2]];
    const names = torus.origins.filter((name) => name[0] === "I").map(originName);
    const regimes: Regimes = { I, names, c1, across, up: flat ? across : [I[1], I[3]] };
    const kept = c1 ? ` with c₁ = ${short(c1)}` : "";
    this.say(
      flat
        ? `All motions${kept} at once: each vertical line is one c₂, and λ₁, λ₂ swing in its coloured parts.`
        : `All motions${kept} at once: each point is a pair c₂, c₃, and each colour a regime.`,
      flat ? "Orange: this motion, with λ₁ green and λ₂ pink." : "Large dot: this motion.",
    );
    this.caption.append(element("span", { class: "choice" }, " Click for a new start."));
    this.#cursor = null;
    let marks: Place[] = [[c2, c3]];
    const values = new Set(I.map((value) => `${nameOf(regimes, value)} = ${short(value)}`));
    return {
      show: ({ lambda }) => {
        if (flat) marks = Array.from(lambda, (value): Place => [c2, value]);
      },
      paint: (pen) => {
        paint(pen, regimes, marks);
        if (!this.#cursor || document.activeElement !== this.canvas) return;
        const [x, y] = [this.#cursor[0] * this.canvas.width, this.#cursor[1] * this.canvas.height];
        pen.stroke([[x - 9 * pen.ratio, y], [x + 9 * pen.ratio, y]], theme().text);
        pen.stroke([[x, y - 9 * pen.ratio], [x, y + 9 * pen.ratio]], theme().text);
      },
      pick: (x, y) => {
        const [[low, high], [bottom, top]] = [regimes.across, regimes.up];
        const right = low + ((high - low) * (x - LEFT)) / (1 - LEFT - RIGHT);
        const up = bottom + ((top - bottom) * (1 - BOTTOM - y)) / (1 - TOP - BOTTOM);
        const choice = flat ? choiceOf(I, [right], low, up) : choiceOf(I, [right, up], low);
        return choice && { ...choice, c1 };
      },
      describe: () => `${namedConstants(torus)}; the regime is ${torus.regime}. ${[...values].join(", ")}.`,
    };
  }
}

/** Return where a point of the map is on a canvas, in pixels. */
function placeOf({ across, up }: Regimes, { width, height }: HTMLCanvasElement, [x, y]: Place): Place {
  const [right, above] = [(x - across[0]) / (across[1] - across[0]), (y - up[0]) / (up[1] - up[0])];
  return [
    (LEFT + (1 - LEFT - RIGHT) * right) * width,
    (1 - BOTTOM - (1 - TOP - BOTTOM) * above) * height,
  ];
}

/** Draw the map, and the marks of a motion: its λ_s, or its pair c_2, c_3. */
function paint(pen: Pen, regimes: Regimes, marks: Place[]): void {
  const { ratio } = pen;
  const { canvas } = pen.context;
  const flat = regimes.I.length === 3;
  const at = (point: Place) => placeOf(regimes, canvas, point);
  for (const mark of marks) pen.keepFree(...at(mark), 8 * ratio);
  const cells = (flat ? zonesOf(regimes) : cellsOf(regimes)).map(
    ([colour, corners, name]): Cell => [colour, corners.map(at), name],
  );
  for (const [colour, corners] of cells) pen.shade(corners, colour);
  drawAxes(pen, regimes);
  // The line of the motion, beside which names are written.
  const [own] = at(marks[0]);
  if (flat) pen.stroke([[own, TOP * canvas.height], [own, (1 - BOTTOM) * canvas.height]], ORANGE, 1.5);
  for (const [, corners, name] of cells) {
    const middle = centroid(corners);
    if (!middle) continue;
    const off = flat ? middle[0] - own : Infinity;
    const aside = Math.abs(off) < 14 * ratio ? Math.sign(off || 1) * 18 * ratio - off : 0;
    pen.write(name, middle[0] + aside, middle[1]);
  }
  marks.forEach((mark, s) => pen.mark(at(mark), flat ? SERIES[s] : VERMILION));
}

/** Return where λ_1 ∈ [max(c_1, I_1), min(c_2, I_2)] and λ_2 ∈ [max(c_2, I_2), I_3] move, for each c_2. */
function zonesOf({ I: [, middle, high], across: [low] }: Regimes): Cell[] {
  return [
    [GREEN, [[low, low], [middle, middle], [high, middle], [high, low]], "λ₁"],
    [PINK, [[low, middle], [middle, middle], [high, high], [low, high]], "λ₂"],
  ];
}

/** Return the four regimes of c_2 < c_3. */
function cellsOf({ I: [, I2, I3, I4], names: [, second, third], across: [low] }: Regimes): Cell[] {
  return [
    [GREEN, [[low, I2], [I2, I2], [I2, I3], [low, I3]], `c₂ < ${second} < c₃ < ${third}`],
    [ORANGE, [[low, I3], [I2, I3], [I2, I4], [low, I4]], `c₂ < ${second}, ${third} < c₃`],
    [PINK, [[I2, I3], [I3, I3], [I3, I4], [I2, I4]], `${second} < c₂ < ${third} < c₃`],
    [VERMILION, [[I2, I2], [I3, I3], [I2, I3]], `${second} < c₂, c₃ < ${third}`],
  ];
}

function drawAxes(pen: Pen, regimes: Regimes): void {
  const { ratio, context } = pen;
  const { width, height } = context.canvas;
  const [[left, right], [bottom]] = [regimes.across, regimes.up];
  const I = [...new Set([...regimes.I, left])].sort((a, b) => a - b);
  const inX = I.filter((value) => value >= left && value <= right);
  const inY = I.filter((value) => value >= bottom);
  const x = inX.map((value) => placeOf(regimes, context.canvas, [value, bottom])[0]);
  const y = inY.map((value) => placeOf(regimes, context.canvas, [left, value])[1]);
  context.setLineDash([4 * ratio, 4 * ratio]);
  const { dim } = theme();
  for (const at of x) pen.stroke([[at, TOP * height], [at, (1 - BOTTOM) * height]], dim);
  for (const at of y) pen.stroke([[LEFT * width, at], [(1 - RIGHT) * width, at]], dim);
  context.setLineDash([]);
  const under = (1 - BOTTOM) * height + 11 * ratio;
  const beside = LEFT * width - 6 * ratio;
  inX.forEach((value, k) => pen.write(nameOf(regimes, value), x[k], under));
  pen.write("c₂", middleOfWidest(x), under);
  inY.forEach((value, k) => pen.write(nameOf(regimes, value), beside, y[k], "right"));
  pen.write(regimes.I.length === 3 ? "λ" : "c₃", beside, middleOfWidest(y), "right");
}

/** Return the name of a moment; those that are equal share a place. */
function nameOf({ I, names, c1 }: Regimes, value: number): string {
  if (value === c1) return "c₁";
  return [...new Set(names.filter((_, k) => I[k] === value))].join();
}

/** Return the middle of the widest gap between the marks of an axis. */
function middleOfWidest(marks: number[]): number {
  const gaps = marks.slice(1).map((mark, k) => Math.abs(mark - marks[k]));
  const k = gaps.indexOf(Math.max(...gaps));
  return (marks[k] + marks[k + 1]) / 2;
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

/**
 * Return a start with constants c_2, … and c_1 or I_1 at `least`: λ_s is in the middle of its cut
 * [max(c_s, I_s), min(c_{s+1}, I_{s+1})], or at the value given. Null where no motion has them.
 */
function choiceOf(I: number[], constants: number[], least: number, value?: number): Choice | null {
  const c = [least, ...constants, Infinity];
  const cuts = I.slice(1).map((right, s): Place => [Math.max(c[s], I[s]), Math.min(c[s + 1], right)]);
  const chosen = cuts.findIndex(([low, high]) => value !== undefined && value > low && value < high);
  if (cuts.some(([low, high]) => !(low < high)) || (value !== undefined && chosen < 0)) return null;
  const lambda = cuts.map(([low, high], s) => (s === chosen ? value! : (low + high) / 2));
  return { constants, lambda };
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
