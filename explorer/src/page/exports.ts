/** Files and texts that leave the page. */
import type { Loaded } from "../views/view.ts";
import { type Problem, SYSTEMS } from "./systems.ts";

/** Offer a file. */
export function save(content: Blob | string, name: string, type = "text/plain"): void {
  const blob = typeof content === "string" ? new Blob([content], { type }) : content;
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** Return pictures, one above the other, as one PNG. */
export function pictureOf(canvases: HTMLCanvasElement[], background: string): Promise<Blob> {
  const all = document.createElement("canvas");
  all.width = Math.max(...canvases.map(({ width }) => width));
  all.height = canvases.reduce((sum, { height }) => sum + height, 0);
  const context = all.getContext("2d")!;
  context.fillStyle = background;
  context.fillRect(0, 0, all.width, all.height);
  let y = 0;
  for (const canvas of canvases) {
    context.drawImage(canvas, 0, y);
    y += canvas.height;
  }
  return new Promise((resolve, reject) =>
    all.toBlob((blob) => (blob ? resolve(blob) : reject(new Error("no picture"))), "image/png"),
  );
}

/** A grid of times, as a request states it. */
export interface Grid {
  start: number;
  stop: number;
  count: number;
}

/** Return 1001 times in round steps: those before a time, or the first ones of the motion. */
export function gridBefore({ reach, range }: Loaded, t: number): Grid {
  const count = 1001;
  if (range) return { start: range[0], stop: range[1], count };
  const exponent = Math.floor(Math.log10(reach / count));
  const part = [5, 2, 1].find((digit) => digit * 10 ** exponent <= reach / count) ?? 1;
  const now = Math.ceil(t / (part * 10 ** exponent));
  const first = t < 0 ? now : Math.max(0, now - count + 1);
  const time = (k: number) => Number(`${k * part}e${exponent}`);
  return { start: time(first), stop: time(first + count - 1), count };
}

/** Return what the page knows of a motion as a table, by the names of the service's columns. */
export function tableOf({ problem, motion, document, time, torusA: A }: Loaded, grid: Grid): string {
  const { start, stop, count } = grid;
  const names: string[] = [];
  const rows = Array.from({ length: count }, (_, k) => {
    const t = k === count - 1 ? stop : start + k * ((stop - start) / (count - 1));
    const { q, velocity, frame, Omega, position, lambda } = motion.at(t);
    const row: number[] = [];
    const add = (name: string, values: ArrayLike<number>, columns = 0) => {
      const index = (i: number) => (columns ? `_${Math.floor(i / columns) + 1}_${(i % columns) + 1}` : `_${i + 1}`);
      if (!k) names.push(...Array.from(values, (_, i) => name + index(i)));
      row.push(...Array.from(values));
    };
    if ("X" in problem && A.length) {
      const size = Math.sqrt(A.reduce((sum, a, i) => sum + a * q[i] * q[i], 0));
      add("X", A.map((a, i) => (a * q[i]) / size));
    }
    if ("gamma" in problem) {
      add("Omega", Omega);
      add("gamma", q);
    }
    if ("q" in problem) add("q", q);
    if ("q_dot" in problem) add("q_dot", velocity);
    add("frame", frame, motion.n);
    add("position", position ?? []);
    if ("q" in problem) add("spheroconic", lambda);
    const { at_start: e0, per_unit_time: e1 } = document?.error ?? {};
    return [t, ...(document ? [Number(e0) + Number(e1) * Math.abs(t)] : []), ...row].join();
  });
  const titles = [time === "τ₁" ? "tau1" : time, ...(document ? ["error"] : []), ...names];
  return [titles.join(), ...rows].join("\n") + "\n";
}

const PYTHON: Record<string, string> = { true: "True", false: "False", null: "None", ",": ", ", ":": ": " };

/** Return a value as Python writes it; texts are as in JSON. */
const literal = (value: unknown): string =>
  JSON.stringify(value).replace(/"(?:[^"\\]|\\.)*"|\w+|[,:]/g, (word) => PYTHON[word] ?? word);

/** Return the problem as a script of the Python package. */
export function pythonOf(problem: Problem, t: string): string {
  const { system, ...data } = problem;
  const name = SYSTEMS[system]?.className ?? system;
  const given = Object.entries(data).map(([key, value]) => `    ${key}=${literal(value)},`);
  return [
    "import veselova as vs",
    "",
    `problem = vs.${name}(`,
    ...given,
    ")",
    `trajectory = vs.solve(problem, ["${t}"])`,
    "print(trajectory.frame, trajectory.error)",
    "",
  ].join("\n");
}

/** Return the request for the present time as JSON. */
export const jsonOf = (problem: Problem, t: string): string =>
  JSON.stringify({ problem, times: [t] }, null, 2) + "\n";

/** Return the same request as a command. */
export function curlOf(problem: Problem, t: string): string {
  const address = new URL("v1/trajectories", location.href).href;
  const body = JSON.stringify({ problem, times: [t] }).replaceAll("'", "'\\''");
  return `curl -s '${address}' -H 'Content-Type: application/json' -d '${body}'\n`;
}
