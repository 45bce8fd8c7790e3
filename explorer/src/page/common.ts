/** What the pages have in common: light and dark, the key, the address, and requests one at a time. */
import { save } from "./exports.ts";
import { apiKey, Refusal } from "./service.ts";

const root = document.documentElement;

/** Return the element of the page with an id. */
export function find<T extends HTMLElement>(id: string): T {
  const found = document.getElementById(id);
  if (!found) throw new Error(`The page has no element #${id}.`);
  return found as T;
}

/** Make the page light or dark. */
function applyTheme(light: boolean): void {
  root.dataset.theme = light ? "light" : "dark";
  find("theme").textContent = light ? "Dark" : "Light";
}

applyTheme(matchMedia("(prefers-color-scheme: light)").matches);

/** Have the button make the page light or dark. */
export function onTheme(changed: () => void): void {
  find("theme").addEventListener("click", () => {
    applyTheme(root.dataset.theme !== "light");
    changed();
  });
}

/** Take a key that is entered, and try again. */
export function onKey(again: () => void): void {
  find("key").addEventListener("submit", (event) => {
    event.preventDefault();
    apiKey.set(find<HTMLInputElement>("key-text").value);
    again();
  });
}

/** Dim what is of before a refusal, and ask for a key where it is for that; return whether it is. */
export function markRefused(error: unknown): boolean {
  const locked = error instanceof Refusal && error.status === 401;
  root.toggleAttribute("data-refused", error !== null);
  find("key").hidden = !locked;
  if (locked) find("message").textContent = apiKey.get() ? error.message : "";
  return locked;
}

/** Return what writes a fragment into the address: at once, or when changes have come to rest. */
export function addressWriter(fragment: () => string): (now?: boolean) => void {
  let timer = 0;
  const write = () => {
    // A page inside a notebook has no address of its own.
    if (location.protocol !== "about:") history.replaceState(null, "", fragment());
  };
  return (now = false) => {
    clearTimeout(timer);
    if (now) write();
    else timer = window.setTimeout(write, 300);
  };
}

/** Hear of another fragment: that which was asked for, since another may have been written. */
export function onFragment(adopt: (fragment: string) => void): void {
  window.addEventListener("hashchange", ({ newURL }) => adopt(new URL(newURL).hash));
}

/** Copy a text, and say so on the button that was pressed. */
export async function copy(id: string, text: string): Promise<void> {
  const pressed = find(id);
  const title = pressed.textContent;
  try {
    await navigator.clipboard.writeText(text);
    pressed.textContent = "Copied";
  } catch {
    // A page without the right to copy gives a file.
    save(text, `veselova-${id}.txt`);
    pressed.textContent = "Saved";
  }
  setTimeout(() => (pressed.textContent = title), 1200);
}

/** Return what has a task done, one at a time: once more, at last, for all that ask meanwhile. */
export function oneAtATime(task: () => Promise<void>): () => Promise<void> {
  let [busy, again] = [false, false];
  return async () => {
    again = true;
    if (busy) return;
    busy = true;
    while (again) {
      again = false;
      await task();
    }
    busy = false;
  };
}
