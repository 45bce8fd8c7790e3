/** A page inside a notebook: what it shows follows the widget, and the widget follows it. */
import type { Explorer, Position } from "./explorer.ts";

/** Milliseconds between two messages to the notebook. */
const EVERY_MS = 200;

/** Exchange the time with the notebook that holds the page, if one does. */
export function followNotebook(explorer: Explorer): void {
  if (window.parent === window) return;
  window.addEventListener("message", ({ data, source }) => {
    if (source === window.parent && data?.veselova) explorer.place(data.veselova);
  });
  let sent = "";
  setInterval(() => {
    const position: Position = explorer.position;
    const text = JSON.stringify(position);
    if (text === sent) return;
    sent = text;
    // The page has no origin of its own there, and tells nothing but its time.
    window.parent.postMessage({ veselova: position }, "*");
  }, EVERY_MS);
}
