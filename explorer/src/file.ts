/** The page of one motion as a file (veselova's `Trajectory.to_html`). */
import "./style.css";
import { Explorer } from "./page/explorer.ts";
import { FileSource } from "./page/file_source.ts";
import { followNotebook } from "./page/notebook.ts";

const carried = document.getElementById("motion")?.textContent ?? "null";
try {
  const source = new FileSource(JSON.parse(carried));
  document.title = source.only.title;
  const explorer = new Explorer(source);
  followNotebook(explorer);
} catch (error) {
  const message = document.getElementById("message");
  if (message) message.textContent = (error as Error).message;
}
