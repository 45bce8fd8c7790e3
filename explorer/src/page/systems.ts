/** The systems of the page: which of their data have sliders, and how Python names them. */
import { fractionOf, textOf } from "../evaluator/fraction.ts";
import { problemOf } from "./presets.ts";

export type Problem = { system: string } & Record<string, unknown>;

/** Return whether a value from outside may be a problem. */
export const isProblem = (value: unknown): value is Problem =>
  typeof value === "object" && value !== null && "system" in value;

export interface Field {
  name: string;
  symbol: string;
  /** What it is, with the paper's label. */
  text: string;
  /** The ends of its sliders. */
  range: [number, number];
  scalar?: boolean;
  /** Whether they are moments of a body, of which none exceeds the sum of the other two. */
  moments?: boolean;
}

export interface System {
  title: string;
  className: string;
  fields: Field[];
  example: Problem;
  /** Whether no closed form is known. */
  integrated?: boolean;
}

const field = (name: string, symbol: string, range: [number, number], text: string): Field => {
  return { name, symbol, range, text };
};
const scalar = (name: string, symbol: string, text: string): Field => {
  return { ...field(name, symbol, [0.1, 5], text), scalar: true };
};

const A = field("A", "A", [0.3, 5], "The inertia 𝓘(Eᵢ∧Eⱼ) = AᵢAⱼ/det A Eᵢ∧Eⱼ of the body, (4.5)");
const MOMENTS = "The principal moments of inertia; of a real body none exceeds the sum of the other two";
const inertia: Field = { ...field("inertia", "I", [0.1, 5], MOMENTS), moments: true };
const Omega = field("Omega", "Ω", [-2, 2], "The angular velocity in the body; where (Ω,γ) = 0 it stays so");
const gamma = field("gamma", "γ", [-1, 1], "The vertical seen from the body, γ = e₁");
const mass = scalar("mass", "m", "The mass");
const radius = scalar("radius", "a", "The radius");
const sphere = scalar("sphere", "σ", "The radius of the fixed sphere");
const q = field("q", "q", [-1, 1], "The unit vector q = e₁ seen from the body; its length is mended");
const qDot = field("q_dot", "q̇", [-1.5, 1.5], "The velocity of q, made tangent to the sphere; ω = q∧q̇, (44.3)");

const { A: threeA, q: point, gamma: vertical } = { ...problemOf("generic"), ...problemOf("body") };

export const SYSTEMS: Record<string, System> = {
  "veselova-so3": {
    title: "Body by its moments of inertia",
    className: "VeselovaSO3",
    fields: [inertia, gamma, Omega],
    example: problemOf("body"),
  },
  veselova: {
    title: "Body by the paper's A",
    className: "Veselova",
    fields: [A, q, qDot],
    example: problemOf("generic"),
  },
  "rubber-ball": {
    title: "Rubber ball, which keeps its spin",
    className: "RubberBall",
    fields: [inertia, mass, radius, sphere, gamma, Omega],
    example: problemOf("ball"),
  },
  "chaplygin-ball": {
    title: "Chaplygin's ball",
    className: "ChaplyginBall",
    fields: [inertia, mass, radius, gamma, { ...Omega, text: "The angular velocity in the body; (Ω,γ) is free" }],
    example: problemOf("chaplygin"),
  },
  "ellipsoid-geodesic": {
    title: "Geodesic on an ellipsoid",
    className: "EllipsoidGeodesic",
    fields: [
      { ...A, text: "The squared half axes of the ellipsoid Σ Xᵢ²/Aᵢ = 1" },
      field("X", "X", [-2, 2], "The point on the ellipsoid"),
      field("X_dot", "Ẋ", [-1.5, 1.5], "The tangent dX/ds, made of unit length"),
    ],
    example: {
      system: "ellipsoid-geodesic",
      A: threeA,
      X: ["1", "1", "0.5"],
      X_dot: ["1", "-1", "0.2"],
      normalize: true,
    },
  },
  neumann: {
    title: "Neumann's system",
    className: "NeumannSystem",
    fields: [
      { ...A, text: "The potential ½(A⁻¹q,q) on the sphere, (4.7)" },
      q,
      field("q_prime", "q′", [-1.5, 1.5], "The velocity in Neumann's time τ₁, (4.6)"),
    ],
    example: { system: "neumann", A: threeA, q: point, q_prime: ["0.8", "0.6", "-1"], normalize: true },
  },
  "euler-poisson": {
    title: "Free body (Euler)",
    className: "EulerPoisson",
    integrated: true,
    fields: [inertia, gamma, { ...Omega, text: "The angular velocity in the body" }],
    example: {
      system: "euler-poisson",
      inertia: ["1", "2", "2.5"],
      gamma: vertical,
      Omega: ["0.1", "1.5", "0.1"],
      normalize: true,
    },
  },
  lr: {
    title: "LR system on SO(n)",
    className: "LRSystem",
    integrated: true,
    fields: [],
    example: problemOf("chaos"),
  },
};

/** Return the entries of a field of a problem, as texts. */
export function entriesOf(problem: Problem, field: Field): string[] {
  const value = problem[field.name];
  if (field.scalar) return [String(value ?? "")];
  return Array.isArray(value) ? value.map(String) : [];
}

/** Return whether the data of a field are a list of numbers, which sliders can change. */
export function isEditable(problem: Problem, field: Field): boolean {
  const value = problem[field.name];
  const simple = (entry: unknown) => ["string", "number"].includes(typeof entry);
  return field.scalar ? simple(value) : Array.isArray(value) && value.every(simple);
}

/** Return a copy of a problem with one entry replaced. */
export function withEntry(problem: Problem, field: Field, i: number, text: string): Problem {
  if (field.scalar) return { ...problem, [field.name]: text };
  const entries = entriesOf(problem, field).map((entry, k) => (k === i ? text : entry));
  return { ...problem, [field.name]: entries };
}

/** Return the ends of the slider of an entry: between those of moments every body is possible. */
export function rangeOf(problem: Problem, field: Field, i: number): [number, number] {
  const others = entriesOf(problem, field).filter((_, k) => k !== i).map(numberOf);
  const [a, b] = field.moments && others.length === 2 ? others : [NaN, NaN];
  const [low, high] = field.range;
  if (!(a > 0 && b > 0)) return [low, high];
  const exact = (value: number) => Number(value.toPrecision(12));
  return [Math.max(low, exact(Math.abs(a - b))), Math.min(high, exact(a + b))];
}

/** Systems in which Ω is horizontal, (Ω,γ) = 0. */
const HORIZONTAL = new Set(["rubber-ball", "veselova-so3"]);

/**
 * Return an edited problem with Ω made horizontal again, exactly, if it was before: by one component
 * that was not edited where γ allows it. Those who want another (Ω,γ) write it into the JSON.
 */
export function keepHorizontal(before: Problem, after: Problem, kept = -1): Problem {
  const texts = (problem: Problem, name: string) => [problem[name] ?? []].flat().map(String);
  const product = texts(before, "gamma").reduce(
    (sum, x, k) => sum + numberOf(x) * numberOf(texts(before, "Omega")[k]),
    0,
  );
  if (!HORIZONTAL.has(after.system) || !(Math.abs(product) < 1e-9)) return after;
  const Omega = texts(after, "Omega");
  const sizes = texts(after, "gamma").map((x) => Math.abs(numberOf(x)));
  const [g, w] = [texts(after, "gamma"), Omega].map((vector) => vector.map(fractionOf));
  const most = Math.max(...sizes);
  // The one along the largest γ_k, which follows least.
  const free = sizes.map((_, k) => k).filter((k) => k !== kept && sizes[k] > 0.03 * most);
  const k = free.sort((a, b) => sizes[b] - sizes[a])[0] ?? kept;
  if (!(most > 0) || w.length !== g.length || !g[k]?.[0] || ![...g, ...w].every(Boolean)) return after;
  let [above, below] = [0n, 1n];
  g.forEach((x, j) => {
    if (j === k) return;
    const part = x![1] * w[j]![1];
    above = above * part - x![0] * w[j]![0] * below;
    below *= part;
  });
  Omega[k] = textOf([above * g[k]![1], below * g[k]![0]]);
  return { ...after, Omega };
}

/** Return a text with a decimal point in the place of a decimal comma, and a plain minus sign. */
export const tidy = (text: string): string =>
  text.trim().replace("−", "-").replace(/^([-+]?\d*),(\d+(?:e[-+]?\d+)?)$/i, "$1.$2");

/** Return the number that a number or a text states; "7/10" too. */
export function numberOf(given: unknown): number {
  const [above, below] = String(given).split("/");
  if (above.trim() === "") return NaN;
  return below === undefined ? Number(above) : Number(above) / Number(below);
}

/** Return a copy with one dimension more or fewer. */
export function withDimension(problem: Problem, system: System, change: 1 | -1): Problem {
  const changed: Problem = { ...problem };
  for (const field of system.fields.filter((one) => !one.scalar)) {
    const entries = entriesOf(problem, field);
    const last = field.range[0] > 0 ? String(Number(entries.at(-1)) / 2) : "0.2";
    changed[field.name] = change > 0 ? [...entries, last] : entries.slice(0, -1);
  }
  delete changed.frame;
  return changed;
}

/** Systems whose dimension can be changed. */
export const ANY_DIMENSION = new Set(["veselova", "neumann", "ellipsoid-geodesic"]);
