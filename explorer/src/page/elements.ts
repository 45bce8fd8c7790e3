/** The elements of index.html, by their ids. */
const find = <T extends HTMLElement>(id: string): T => {
  const found = document.getElementById(id);
  if (!found) throw new Error(`index.html has no element #${id}`);
  return found as T;
};

export const elements = {
  preset: find<HTMLSelectElement>("preset"),
  system: find<HTMLSelectElement>("system"),
  story: find("story"),
  banner: find("banner"),
  keyForm: find<HTMLFormElement>("key"),
  keyText: find<HTMLInputElement>("key-text"),
  play: find<HTMLButtonElement>("play"),
  time: find<HTMLInputElement>("time"),
  timeFault: find("time-fault"),
  letter: find("letter"),
  speed: find<HTMLInputElement>("speed"),
  speedText: find<HTMLOutputElement>("speed-text"),
  message: find("message"),
  data: find<HTMLDetailsElement>("data"),
  fields: find("fields"),
  facts: find("facts"),
  status: find("status"),
  formulas: find("formulas"),
  views: find("views"),
  theme: find<HTMLButtonElement>("theme"),
  lecture: find<HTMLButtonElement>("lecture"),
};

export const button = (id: string): HTMLButtonElement => find<HTMLButtonElement>(id);
