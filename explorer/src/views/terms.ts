/** Technical terms in running text: each has a sentence for those who ask, by pointer or by key. */
import { element } from "./view.ts";

export const TERMS: Record<string, string> = {
  λ: "Coordinates of a point on a sphere, as longitude and latitude are, which suit this body.",
  c: "Numbers that never change along a motion; the coordinates λ turn back at some of them.",
  z: "Angles in whole turns, at fixed ratios of speed; they give the attitude but for half turns.",
  umbilic: "A point of an ellipsoid where it is curved alike in all directions; there are four.",
  regime: "The kind of motion: generic, one where a λ stands still (closed-cut), or a limit case.",
  geodesic: "A path that turns neither left nor right, the shortest between points near each other.",
};

const PATTERN = /(?<!\p{L})(?:(λ)|([cz])(?=[₁-₉])|(umbilic|regime|geodesic))[₁-₉s]*/gu;

/** Write a text into an element; the first of each term in it is explained. */
export function explain(text: string, host: HTMLElement): void {
  const seen = new Set<string>();
  let written = 0;
  host.replaceChildren();
  for (const { 0: word, 1: letter, 2: other, 3: noun, index } of text.matchAll(PATTERN)) {
    const name = letter ?? other ?? noun;
    if (seen.has(name)) continue;
    seen.add(name);
    const term = element("button", { type: "button", class: "term", title: TERMS[name] }, word);
    host.append(text.slice(written, index), term);
    written = index + word.length;
  }
  host.append(text.slice(written));
}
