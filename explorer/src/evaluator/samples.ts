/** Samples of many times in columns, for trails and plots; the worker sends them as they are. */
import type { Motion } from "./motion.ts";

export interface Samples {
  times: Float64Array;
  frame: Float64Array;
  q: Float64Array;
  velocity: Float64Array;
  z: Float64Array;
  lambda: Float64Array;
  position: Float64Array;
  Omega: Float64Array;
}

const COLUMNS = ["frame", "q", "velocity", "z", "lambda", "position", "Omega"] as const;

/** Return the samples of a motion at these times. */
export function samplesOf(motion: Motion, times: Float64Array): Samples {
  const samples = { times } as Samples;
  for (let k = 0; k < times.length; k++) {
    const sample = motion.at(times[k]);
    for (const name of COLUMNS) {
      const values = sample[name] ?? [];
      samples[name] ??= new Float64Array(times.length * values.length);
      samples[name].set(values, k * values.length);
    }
  }
  for (const name of COLUMNS) samples[name] ??= new Float64Array(0);
  return samples;
}

/** Return what of the samples can be moved to another thread. */
export const buffersOf = (samples: Samples): ArrayBufferLike[] => [
  samples.times.buffer,
  ...COLUMNS.map((name) => samples[name].buffer),
];
