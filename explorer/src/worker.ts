/** The evaluator in a thread of its own: trails of thousands of points never hold up a picture. */
import type { ClosedFormDocument } from "./evaluator/document.ts";
import { ClosedFormMotion } from "./evaluator/motion.ts";
import { buffersOf, samplesOf } from "./evaluator/samples.ts";

export type Question =
  | { kind: "document"; document: ClosedFormDocument }
  | { kind: "samples"; id: number; times: Float64Array };

let motion: ClosedFormMotion | null = null;

self.onmessage = ({ data }: MessageEvent<Question>) => {
  if (data.kind === "document") {
    motion = new ClosedFormMotion(data.document);
  } else if (motion) {
    const samples = samplesOf(motion, data.times);
    self.postMessage({ id: data.id, samples }, { transfer: buffersOf(samples) as ArrayBuffer[] });
  }
};
