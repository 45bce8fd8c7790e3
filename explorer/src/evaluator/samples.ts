/** Samples of many times in columns, for trails and plots; the worker sends them as they are. */
import type { Motion } from "./motion.ts";

const COLUMNS = ["frame", "q", "velocity", "z", "lambda", "position", "Omega"] as const;

/** Series of vectors, one row after the other; a sample has one row of each. */
export type Columns<T = Float64Array> = Record<(typeof COLUMNS)[number], T>;

export interface Samples extends Columns {
  times: Float64Array;
}

/** Return the samples of a motion at these times. */
export function samplesOf(motion: Motion, times: Float64Array): Samples {
  const samples: Partial<Columns> = {};
  times.forEach((t, k) => {
    const sample = motion.at(t);
    for (const name of COLUMNS) {
      samples[name] ??= new Float64Array(times.length * sample[name].length);
      samples[name].set(sample[name], k * sample[name].length);
    }
  });
  for (const name of COLUMNS) samples[name] ??= new Float64Array(0);
  return { times, ...(samples as Columns) };
}
