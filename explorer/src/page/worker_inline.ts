/** The thread of the evaluator, carried by the page itself: for a page that is one file. */
import EvaluatorWorker from "../worker.ts?worker&inline";

/** Return a worker, null where a page may have none. */
export function startWorker(): Worker | null {
  try {
    return new EvaluatorWorker();
  } catch {
    return null;
  }
}
