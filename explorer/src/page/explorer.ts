/** The page: its state, the motion that is loaded, and what happens at every picture. */
import { cross } from "../evaluator/linear_algebra.ts";
import { SeriesMotion } from "../evaluator/series_motion.ts";
import { type Choice, startOf } from "../views/constants_view.ts";
import { element, type Loaded } from "../views/view.ts";
import { Controls } from "./controls.ts";
import { button, elements } from "./elements.ts";
import { curlOf, gridBefore, jsonOf, pythonOf, save } from "./exports.ts";
import { Facts } from "./facts.ts";
import { evaluationOf, typeset } from "./formulas.ts";
import { Gallery } from "./gallery.ts";
import { BUSY, FAR, type Source } from "./loader.ts";
import { Player } from "./player.ts";
import { apiKey, Refusal, Unreachable } from "./service.ts";
import { PRESETS, presetOf } from "./presets.ts";
import { fragmentOf, type State, stateOf } from "./state.ts";
import { keepHorizontal, type Problem, SYSTEMS } from "./systems.ts";
import { Trail } from "./trail.ts";

/** Milliseconds of rest after which the engines of the server are compared. */
const COMPARE_AFTER_MS = 900;

/** Milliseconds of a picture beyond which fewer are drawn. */
const SLOW_MS = 24;

/** Milliseconds between looks for a server that has gone. */
const RETRY_MS = 3000;

const RESTS = "The body rests: its velocity is zero, so nothing moves.";

const FAR_TIME = "Far time: the document of this motion has 15 digits; the table has their error.";

const DIMMED = "Dimmed: the motion before this change.";

/** What a page shows of its motion. */
export interface Position {
  t: string;
  speed: number;
  playing: boolean;
}

export class Explorer {
  readonly #player = new Player();
  readonly #controls: Controls;
  readonly #facts = new Facts(elements.facts);
  readonly #gallery: Gallery;
  readonly #source: Source;
  #state: State;
  #loaded: Loaded | null = null;
  #trail: Trail | null = null;
  #loading = false;
  #wanted: Problem | null = null;
  #abort = new AbortController();
  #compareTimer = 0;
  #addressTimer = 0;
  /** Where the motion comes from, or what it is not compared with. */
  #origin = "";
  /** The status that is written, until another motion comes. */
  #said = "";
  #written = "";
  #formulas = "";
  #rest = 0;
  #tries = 0;

  constructor(source: Source) {
    this.#source = source;
    const change = (problem: Problem) => this.#set(problem);
    this.#controls = new Controls(elements.fields, !source.only, change);
    this.#state = this.#stateOf(location.hash);
    document.documentElement.dataset.editable = String(!source.only);
    this.#gallery = new Gallery(elements.views, {
      choose: (choice) => this.#start(choice),
      enlarged: (name) => {
        this.#state.large = name;
        this.#writeAddress();
      },
      play: () => this.place({ playing: true }),
      say: (sentence) => (elements.message.textContent = sentence),
    });
    this.#fillChoosers();
    this.#listen();
    this.#adopt(this.#state);
    requestAnimationFrame((instant) => this.#picture(instant));
  }

  /** Write the formulas by which the page computes a motion; series have none. */
  #showFormulas({ document }: Loaded): void {
    const lines = document ? evaluationOf(document) : [];
    elements.formulas.hidden = !lines.length;
    if (lines.join() === this.#formulas) return;
    this.#formulas = lines.join();
    elements.formulas.replaceChildren();
    for (const tex of lines) {
      const line = element("div");
      elements.formulas.append(line);
      void typeset(tex, line, true);
    }
  }

  #stateOf(fragment: string): State {
    const { only } = this.#source;
    const state = stateOf(fragment, only?.t);
    return only ? { ...state, problem: only.problem } : state;
  }

  #fillChoosers(): void {
    elements.preset.append(element("option", { value: "" }, "…"));
    for (const { name, title } of PRESETS) {
      elements.preset.append(element("option", { value: name }, title));
    }
    for (const [name, { title }] of Object.entries(SYSTEMS)) {
      elements.system.append(element("option", { value: name }, title));
    }
  }

  /** Take a state as a whole. */
  #adopt(state: State): void {
    this.#state = state;
    this.#showFault(this.#player.go(state.t));
    this.#player.playing = state.playing && !matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.#setSpeed(state.speed);
    this.#showPlaying();
    this.#gallery.enlarge(state.large);
    this.#lecture(state.lecture);
    this.#set(state.problem);
  }

  #listen(): void {
    elements.preset.addEventListener("change", () => {
      const preset = PRESETS.find(({ name }) => name === elements.preset.value);
      if (!preset) return;
      this.#go("0");
      this.#setSpeed(preset.speed ?? 1);
      this.#set(preset.problem);
    });
    elements.system.addEventListener("change", () => {
      this.#go("0");
      this.#set(SYSTEMS[elements.system.value].example);
    });
    elements.play.addEventListener("click", () => this.#toggle());
    elements.time.addEventListener("change", () => this.#go(elements.time.value));
    elements.speed.addEventListener("input", () => {
      this.#setSpeed(10 ** Number(elements.speed.value));
      this.#writeAddress();
    });
    for (const jump of document.querySelectorAll<HTMLElement>("[data-time]")) {
      jump.addEventListener("click", () => this.#go(jump.dataset.time ?? "0"));
    }
    elements.keyForm.addEventListener("submit", (event) => {
      event.preventDefault();
      apiKey.set(elements.keyText.value);
      this.#set(this.#state.problem);
    });
    elements.theme.addEventListener("click", () => this.#switchTheme());
    elements.lecture.addEventListener("click", () => this.#lecture(!this.#state.lecture));
    document.addEventListener("keydown", (event) => this.#key(event));
    window.addEventListener("hashchange", ({ newURL }) => {
      // By the address that was asked for: another may have been written since.
      const { hash } = new URL(newURL);
      if (hash !== this.#written) this.#adopt(this.#stateOf(hash));
    });
    // On a narrow page the data are folded, so that the motion comes first.
    const narrow = matchMedia("(max-width: 820px)");
    const fold = () => (elements.data.open = !narrow.matches);
    narrow.addEventListener("change", fold);
    fold();
    this.#listenToExports();
  }

  #listenToExports(): void {
    const texts: Record<string, () => string> = {
      link: () => location.href,
      python: () => pythonOf(this.#state.problem, this.#player.text()),
      curl: () => curlOf(this.#state.problem, this.#player.text()),
      json: () => jsonOf(this.#state.problem, this.#player.text()),
    };
    for (const [id, text] of Object.entries(texts)) {
      button(id).addEventListener("click", () => {
        this.#writeAddress(true);
        void this.#copy(id, text());
      });
    }
    // no link: a site without a server has no such page
    button("geodesics").addEventListener("click", () => location.assign("geodesics"));
    button("csv").addEventListener("click", () => {
      if (!this.#loaded) return;
      const grid = gridBefore(this.#loaded, this.#player.time[0]);
      this.#source.loadTable(this.#loaded, grid).then(
        (table) => save(table, "motion.csv", "text/csv"),
        (error: unknown) => (elements.message.textContent = `No table came: ${reasonOf(error)}`),
      );
    });
  }

  async #copy(id: string, text: string): Promise<void> {
    const made = button(id);
    const title = made.textContent ?? "";
    try {
      await navigator.clipboard.writeText(text);
      made.textContent = "Copied";
    } catch {
      // A page without the right to copy gives a file.
      save(text, `veselova-${id}.txt`);
      made.textContent = "Saved";
    }
    setTimeout(() => (made.textContent = title), 1200);
  }

  #key(event: KeyboardEvent): void {
    const target = event.target as HTMLElement;
    const typing = target.closest("input, select, textarea, button:not(.term), summary");
    if (typing || event.defaultPrevented) return;
    const lectures: Record<string, () => void> = {
      ArrowRight: () => this.#step(1),
      PageDown: () => this.#step(1),
      ArrowLeft: () => this.#step(-1),
      PageUp: () => this.#step(-1),
      1: () => this.#lecture(true, 1),
      2: () => this.#lecture(true, 2),
      Escape: () => this.#lecture(false),
    };
    const act = event.key === " " ? () => this.#toggle() : this.#state.lecture && lectures[event.key];
    if (!act) return;
    event.preventDefault();
    act();
  }

  /** Show one or two views alone, without controls, or the whole page again. */
  #lecture(on: boolean, count = 2): void {
    this.#state.lecture = on;
    document.documentElement.dataset.lecture = String(on);
    elements.lecture.textContent = on ? "Leave" : "Lecture";
    elements.lecture.blur();
    this.#gallery.feature(on ? this.#views() : [], count);
    this.#writeAddress();
  }

  /** Return the views of a lecture about the present motion. */
  #views(): string[] {
    const { large } = this.#state;
    return [...(large ? [large] : []), ...(presetOf(this.#state.problem)?.views ?? ["ball", "body"])];
  }

  /** Go to the next start, or to the one before. */
  #step(by: number): void {
    if (this.#source.only) return;
    const now = PRESETS.findIndex(({ name }) => name === elements.preset.value);
    elements.preset.value = PRESETS[(Math.max(now, 0) + by + PRESETS.length) % PRESETS.length].name;
    elements.preset.dispatchEvent(new Event("change"));
  }

  /** What is shown at the moment. */
  get position(): Position {
    const { playing, speed } = this.#player;
    return { t: this.#player.text(), speed: Number(speed.toPrecision(4)), playing };
  }

  /** Show another time, at another speed, or pause. */
  place({ t, speed, playing }: Partial<Position>): void {
    if (t !== undefined && t !== this.#player.text()) this.#go(t);
    if (speed !== undefined && speed > 0) this.#setSpeed(speed);
    if (playing !== undefined && playing !== this.#player.playing) this.#toggle();
  }

  #toggle(): void {
    this.#player.toggle();
    this.#showFault(null);
    elements.time.value = this.#player.text();
    this.#showPlaying();
    this.#writeAddress();
  }

  #showPlaying(): void {
    elements.play.textContent = this.#player.playing ? "Pause" : "Play";
  }

  #go(text: string): void {
    const fault = this.#player.go(text);
    this.#showFault(fault);
    if (!fault) this.#writeAddress();
  }

  #showFault(fault: string | null): void {
    elements.timeFault.textContent = fault ?? "";
    elements.time.toggleAttribute("aria-invalid", fault !== null);
  }

  #setSpeed(speed: number): void {
    this.#player.speed = speed;
    elements.speed.value = String(Math.log10(speed));
    elements.speedText.textContent = `${speed < 100 ? speed.toPrecision(2) : speed.toFixed(0)} /s`;
  }

  #switchTheme(): void {
    const light = document.documentElement.dataset.theme !== "light";
    applyTheme(light);
    if (this.#loaded) this.#show(this.#loaded);
  }

  /** Begin at constants and coordinates that were chosen on the map. */
  #start(choice: Choice): void {
    if (!this.#loaded || this.#source.only) return;
    const { motion, A, problem } = this.#loaded;
    const now = motion.at(this.#player.time);
    const order = A.map((_, i) => i).sort((i, j) => A[j] - A[i]);
    const { q, prime } = startOf(motion.moments, choice, order.map((i) => (now.q[i] < 0 ? -1 : 1)));
    const rate = Math.hypot(...now.velocity) / Math.hypot(...prime);
    const given = (values: number[]) => A.map((_, i) => values[order.indexOf(i)]);
    const [point, slope] = [given(q), given(prime)];
    const velocity = slope.map((x) => x * rate);
    const texts = (values: ArrayLike<number>) =>
      Array.from(values, (x) => String(Number(x.toPrecision(8))));
    const fits = A.length === motion.n;
    let start: object | null = null;
    if ("q_prime" in problem) start = { q: texts(point), q_prime: texts(slope) };
    else if ("q_dot" in problem) start = { q: texts(point), q_dot: texts(velocity) };
    else if ("Omega" in problem && motion.n === 3) {
      start = { gamma: texts(point), Omega: texts(cross(velocity, point)) };
    }
    if (!fits || !start) {
      const needed = fits ? "a body or a ball" : "an A along the axes";
      elements.message.textContent = `A new start from the map needs ${needed}.`;
      return;
    }
    const { frame: _, ...kept } = problem;
    this.#go("0");
    this.#set(keepHorizontal(problem, { ...kept, normalize: true, ...start }));
  }

  /** Take another problem: show it, and load its motion. */
  #set(problem: Problem): void {
    this.#state.problem = problem;
    this.#controls.show(problem);
    elements.system.value = problem.system in SYSTEMS ? problem.system : "";
    const preset = presetOf(problem);
    elements.preset.value = preset?.name ?? "";
    elements.story.textContent = this.#source.only?.story || (preset?.text ?? "A start of your own.");
    elements.story.dataset.title = preset?.title ?? "";
    if (this.#state.lecture) this.#gallery.feature(this.#views(), 2);
    this.#wanted = problem;
    void this.#load();
    this.#writeAddress();
  }

  /** Load the problem that is wanted; one at a time, the newest last. */
  async #load(): Promise<void> {
    if (this.#loading) return;
    this.#loading = true;
    while (this.#wanted) {
      const problem = this.#wanted;
      this.#wanted = null;
      const abort = new AbortController();
      const began = performance.now();
      try {
        const loaded = await this.#source.load(problem, abort.signal);
        this.#abort.abort();
        this.#abort = abort;
        this.#accept(loaded, performance.now() - began);
      } catch (error) {
        if (this.#refuse(error)) this.#wanted ??= problem;
        if (this.#wanted === problem) break;
      }
    }
    this.#loading = false;
  }

  #accept(loaded: Loaded, milliseconds: number): void {
    this.#tries = 0;
    elements.banner.hidden = true;
    elements.keyForm.hidden = true;
    delete document.documentElement.dataset.refused;
    const { velocity, Omega } = loaded.motion.at(0);
    const rests = Math.hypot(...velocity, ...Omega) < 1e-12;
    elements.message.textContent = `${this.#state.broken ?? ""} ${rests ? RESTS : ""}`.trim();
    this.#state.broken = "";
    this.#controls.mark([]);
    this.#show(loaded);
    this.#origin = originOf(loaded, milliseconds);
    this.#said = "";
    clearTimeout(this.#compareTimer);
    this.#compareTimer = window.setTimeout(() => void this.#compare(loaded), COMPARE_AFTER_MS);
  }

  /** Show a refusal at its field, and dim the motion before; return whether to try again later. */
  #refuse(error: unknown): boolean {
    document.documentElement.dataset.refused = "";
    if (!this.#loaded) this.#gallery.empty();
    if (error instanceof Unreachable) {
      elements.banner.textContent =
        "The server does not answer. The motion goes on; changes wait until it is back.";
      elements.banner.hidden = false;
      setTimeout(() => void this.#load(), RETRY_MS);
      return true;
    }
    if (error instanceof Refusal && error.status === 401) {
      elements.keyForm.hidden = false;
      elements.message.textContent = apiKey.get() ? error.message : "";
      return false;
    }
    if (error instanceof Refusal && BUSY.includes(error.status) && this.#tries++ < 4) {
      elements.message.textContent = `${error.message} The page asks again.`;
      setTimeout(() => void this.#load(), RETRY_MS);
      return true;
    }
    const sentence = reasonOf(error);
    const faults = error instanceof Refusal ? error.faults : [];
    const rest = this.#controls.mark(faults);
    if (rest.length < faults.length) elements.data.open = true;
    const said = [this.#state.broken, ...(faults.length ? rest : [sentence])];
    elements.message.textContent = [...said, this.#loaded ? DIMMED : ""].join(" ").trim();
    return false;
  }

  #show(loaded: Loaded): void {
    this.#trail?.close();
    this.#loaded = loaded;
    this.#player.limit(loaded.range);
    const [first, last] = this.#player.range;
    for (const jump of document.querySelectorAll<HTMLElement>("[data-time]")) {
      const time = Number(jump.dataset.time);
      jump.hidden = time < first || time > last;
    }
    elements.letter.textContent = loaded.time;
    this.#gallery.build(loaded);
    this.#facts.build(loaded);
    this.#showFormulas(loaded);
    this.#trail = new Trail(loaded, (samples, anew) => this.#gallery.extend(samples, anew));
  }

  async #compare(loaded: Loaded): Promise<void> {
    if (loaded !== this.#loaded || !loaded.document) return;
    try {
      const found = await this.#source.loadEngines(loaded, this.#abort.signal);
      if (loaded === this.#loaded) this.#gallery.compare(found);
    } catch (error) {
      if (loaded !== this.#loaded) return;
      this.#gallery.compare({ analytic: null, numeric: null });
      this.#origin = `The engines were not compared: ${reasonOf(error)}`;
    }
  }

  /** Say where the motion comes from, or what its numbers lack; where series end, go back. */
  #showStatus({ motion, document }: Loaded): void {
    let lack = "";
    if (motion instanceof SeriesMotion) {
      const end = motion.endBefore(this.#player.time[0]);
      if (end) {
        this.#player.go(String(end.time));
        this.#player.playing = false;
        elements.timeFault.textContent = `${elements.letter.textContent}: ${end.reason}; back at ${end.time}.`;
        elements.time.value = this.#player.text();
        this.#writeAddress();
      }
      lack = motion.lack(this.#player.time[0]);
    }
    const far = document && Math.abs(this.#player.time[0]) > FAR ? FAR_TIME : "";
    const said = lack || far || this.#origin;
    if (said === this.#said) return;
    this.#said = said;
    elements.status.textContent = said;
  }

  #picture(instant: number): void {
    requestAnimationFrame((next) => this.#picture(next));
    this.#player.advance(instant);
    const loaded = this.#loaded;
    // Where pictures take long, the thread is left to others for as long as the last one took.
    if (!loaded || document.hidden || instant < this.#rest) return;
    const sample = loaded.motion.at(this.#player.time);
    this.#gallery.show(sample);
    this.#facts.show(sample);
    this.#trail?.follow(this.#player.time[0]);
    this.#showStatus(loaded);
    const text = this.#player.text();
    // A text that was refused stays beside the reason.
    const refused = elements.time.hasAttribute("aria-invalid");
    if (document.activeElement !== elements.time && !refused) elements.time.value = text;
    if (this.#player.playing !== (elements.play.textContent === "Pause")) this.#showPlaying();
    const took = performance.now() - instant;
    this.#rest = took > SLOW_MS ? performance.now() + took : 0;
  }

  /** Write the state into the address, at once or when changes have come to rest. */
  #writeAddress(now = false): void {
    clearTimeout(this.#addressTimer);
    const write = () => {
      Object.assign(this.#state, this.position);
      this.#written = fragmentOf(this.#state, !this.#source.only);
      // A page inside a notebook has no address of its own.
      if (location.protocol === "about:") return;
      history.replaceState(null, "", this.#written);
      this.#written = location.hash;
    };
    if (now) write();
    else this.#addressTimer = window.setTimeout(write, 300);
  }
}

/** Return where the motion comes from, in a sentence. */
function originOf({ document, range, time, cause }: Loaded, milliseconds: number): string {
  if (range) return `Series of the engine, from ${time} = ${range[0]} to ${range[1]}.`;
  if (!document) return `Series of the service, in stretches of time: ${cause}`;
  return `Closed form in ${milliseconds.toFixed(0)} ms; every picture is computed here.`;
}

const reasonOf = (error: unknown): string =>
  error instanceof Error ? error.message : String(error);

/** Make the page light or dark. */
export function applyTheme(light: boolean): void {
  document.documentElement.dataset.theme = light ? "light" : "dark";
  elements.theme.textContent = light ? "Dark" : "Light";
}
