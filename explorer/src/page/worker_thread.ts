/** The thread of the evaluator, a file beside the page. */

/** Return a worker, null where a page may have none. */
export function startWorker(): Worker | null {
  try {
    return new Worker(new URL("../worker.ts", import.meta.url), { type: "module" });
  } catch {
    return null;
  }
}
