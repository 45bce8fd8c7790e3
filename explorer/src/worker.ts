/** The evaluator in a thread of its own: trails of thousands of points never hold up a picture. */
import type { ClosedFormDocument } from "./evaluator/document.ts";
import { type Motion, motionOf } from "./evaluator/motion.ts";
import { samplesOf } from "./evaluator/samples.ts";

/** First the document of a motion, then times of which the samples are sent back. */
export type Question = ClosedFormDocument | Float64Array;

let motion: Motion;

self.onmessage = ({ data }: MessageEvent<Question>) => {
  if (data instanceof Float64Array) {
    const samples = samplesOf(motion, data);
    self.postMessage(samples, { transfer: Object.values(samples).map(({ buffer }) => buffer) });
  } else motion = motionOf(data);
};
