/** Files and texts that leave the page. */
import { samplesOf } from "../evaluator/samples.ts";
import type { Loaded } from "../views/view.ts";
import { SYSTEMS } from "./systems.ts";
import type { Problem } from "./systems.ts";

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

/** Return the motion before a time as a table. */
export function tableOf({ motion, reach, time }: Loaded, t: number, count = 1001): string {
  const step = reach / (count - 1);
  const times = Float64Array.from({ length: count }, (_, k) => t - reach + k * step);
  const samples = samplesOf(motion, times);
  const n = motion.n;
  const names = [time];
  const columns: { values: ArrayLike<number>; size: number }[] = [{ values: times, size: 1 }];
  const add = (values: ArrayLike<number>, titles: string[]) => {
    if (!values.length) return;
    names.push(...titles);
    columns.push({ values, size: titles.length });
  };
  const indices = Array.from({ length: n }, (_, i) => i + 1);
  add(samples.q, indices.map((i) => `q.${i}`));
  add(samples.frame, indices.flatMap((i) => indices.map((j) => `frame.${i}.${j}`)));
  add(samples.lambda, Array.from({ length: samples.lambda.length / count }, (_, s) => `lambda.${s + 1}`));
  add(samples.z, Array.from({ length: motion.genus }, (_, s) => `z.${s + 1}`));
  add(samples.position, indices.slice(1).map((i) => `position.${i - 1}`));
  const rows = Array.from(times, (_, k) =>
    columns.flatMap(({ values, size }) => Array.from({ length: size }, (_, i) => values[k * size + i])),
  );
  return [names.join(), ...rows.map((row) => row.join())].join("\n") + "\n";
}

/** Return the problem as a script of the Python package. */
export function pythonOf(problem: Problem, t: string): string {
  const { system, ...data } = problem;
  const name = SYSTEMS[system]?.className ?? system;
  const literal = (value: unknown): string => {
    if (value === true) return "True";
    if (value === false) return "False";
    if (value === null) return "None";
    if (Array.isArray(value)) return `[${value.map(literal).join(", ")}]`;
    if (typeof value === "object") {
      const entries = Object.entries(value as object);
      return `{${entries.map(([key, entry]) => `"${key}": ${literal(entry)}`).join(", ")}}`;
    }
    return JSON.stringify(value);
  };
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
