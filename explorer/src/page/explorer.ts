/** The page: its state, the motion that is loaded, and what happens at every picture. */
import { cross } from "../evaluator/linear_algebra.ts";
import type { Sample } from "../evaluator/motion.ts";
import { SeriesMotion } from "../evaluator/series_motion.ts";
import { type Choice, startOf } from "../views/constants_view.ts";
import { element, type Loaded, write } from "../views/view.ts";
import { addressWriter, copy, find, markRefused, oneAtATime, onFragment, onKey, onTheme } from "./common.ts";
import { Controls } from "./controls.ts";
import { elements } from "./elements.ts";
import { curlOf, gridBefore, jsonOf, pythonOf, save } from "./exports.ts";
import { facts } from "./facts.ts";
import { evaluationOf, typeset } from "./formulas.ts";
import { Gallery } from "./gallery.ts";
import { BUSY, FAR, type Source } from "./loader.ts";
import { Player } from "./player.ts";
import { Refusal, Unreachable } from "./service.ts";
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

const GONE = "The server does not answer. The motion goes on; changes wait until it is back.";

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
  readonly #gallery: Gallery;
  readonly #source: Source;
  readonly #load = oneAtATime(() => this.#loadWanted());
  readonly #writeAddress = addressWriter(() => fragmentOf({ ...this.#state, ...this.position }, !this.#source.only));
  #state: State;
  #loaded: Loaded | null = null;
  #showFacts: (sample: Sample) => void = () => undefined;
  #trail: Trail | null = null;
  #abort = new AbortController();
  #compareTimer = 0;
  #retryTimer = 0;
  /** Where the motion comes from, or what it is not compared with. */
  #origin = "";
  /** The status that is written, until another motion comes. */
  #said = "";
  #formulas = "";
  #rest = 0;
  #tries = 0;

  constructor(source: Source) {
    this.#source = source;
    const change = (problem: Problem) => this.#set(problem);
    this.#controls = new Controls(find("fields"), !source.only, change);
    this.#state = this.#stateOf(location.hash);
    document.documentElement.dataset.editable = String(!source.only);
    this.#gallery = new Gallery(find("views"), {
      choose: (choice) => this.#start(choice),
      enlarged: (name) => {
        this.#state.large = name;
        this.#writeAddress();
      },
      play: () => this.place({ playing: true }),
      say: (sentence) => (elements.message.textContent = sentence),
    });
    const option = (value: string, title: string) => element("option", { value }, title);
    elements.preset.append(option("", "…"), ...PRESETS.map(({ name, title }) => option(name, title)));
    elements.system.append(...Object.entries(SYSTEMS).map(([name, { title }]) => option(name, title)));
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
    elements.formulas.replaceChildren(...lines.map((tex) => typeset(tex, true)));
  }

  #stateOf(fragment: string): State {
    const { only } = this.#source;
    const state = stateOf(fragment, only?.t);
    return only ? { ...state, problem: only.problem } : state;
  }

  /** Take a state as a whole. */
  #adopt(state: State): void {
    this.#state = state;
    this.#player.playing = state.playing && !matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.#showPlayer(this.#player.go(state.t));
    this.#setSpeed(state.speed);
    this.#gallery.enlarge(state.large);
    this.#lecture(state.lecture);
    this.#set(state.problem);
  }

  /** Begin at t = 0 with another problem. */
  #begin(problem: Problem): void {
    this.#go("0");
    this.#set(problem);
  }

  #listen(): void {
    elements.preset.addEventListener("change", () => {
      const preset = PRESETS.find(({ name }) => name === elements.preset.value);
      if (!preset) return;
      this.#setSpeed(preset.speed ?? 1);
      this.#begin(preset.problem);
    });
    elements.system.addEventListener("change", () => this.#begin(SYSTEMS[elements.system.value].example));
    elements.play.addEventListener("click", () => this.#toggle());
    elements.time.addEventListener("change", () => this.#go(elements.time.value));
    elements.speed.addEventListener("input", () => {
      this.#setSpeed(10 ** Number(elements.speed.value));
      this.#writeAddress();
    });
    for (const jump of elements.jumps) jump.addEventListener("click", () => this.#go(jump.dataset.time ?? "0"));
    onKey(() => this.#set(this.#state.problem));
    onTheme(() => this.#loaded && this.#show(this.#loaded));
    elements.lecture.addEventListener("click", () => this.#lecture(!this.#state.lecture));
    document.addEventListener("keydown", (event) => this.#key(event));
    onFragment((fragment) => this.#adopt(this.#stateOf(fragment)));
    // On a narrow page the data are folded, so that the motion comes first.
    const narrow = matchMedia("(max-width: 820px)");
    const fold = () => (elements.data.open = !narrow.matches);
    narrow.addEventListener("change", fold);
    fold();
    this.#listenToExports();
  }

  #listenToExports(): void {
    const texts: Record<string, (problem: Problem, t: string) => string> = {
      link: () => location.href,
      python: pythonOf,
      curl: curlOf,
      json: jsonOf,
    };
    for (const [id, text] of Object.entries(texts)) {
      find(id).addEventListener("click", () => {
        this.#writeAddress(true);
        void copy(id, text(this.#state.problem, this.#player.text()));
      });
    }
    // no link: a site without a server has no such page
    find("geodesics").addEventListener("click", () => location.assign("geodesics"));
    find("csv").addEventListener("click", () => {
      if (!this.#loaded) return;
      const grid = gridBefore(this.#loaded, this.#player.time[0]);
      this.#source.loadTable(this.#loaded, grid).then(
        (table) => save(table, "motion.csv", "text/csv"),
        (error: Error) => (elements.message.textContent = `No table came: ${error.message}`),
      );
    });
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
    this.#showPlayer(null);
    elements.time.value = this.#player.text();
    this.#writeAddress();
  }

  #go(text: string): void {
    const fault = this.#player.go(text);
    this.#showPlayer(fault);
    if (!fault) this.#writeAddress();
  }

  /** Show whether the motion plays, and what is wrong with the time. */
  #showPlayer(fault: string | null): void {
    this.#showPlaying();
    elements.timeFault.textContent = fault ?? "";
    elements.time.toggleAttribute("aria-invalid", fault !== null);
  }

  #showPlaying(): void {
    write(elements.play, this.#player.playing ? "Pause" : "Play");
  }

  #setSpeed(speed: number): void {
    this.#player.speed = speed;
    elements.speed.value = String(Math.log10(speed));
    elements.speedText.textContent = `${speed < 100 ? speed.toPrecision(2) : speed.toFixed(0)} /s`;
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
    this.#begin(keepHorizontal(problem, { ...kept, normalize: true, ...start }));
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
    void this.#load();
    this.#writeAddress();
  }

  async #loadWanted(): Promise<void> {
    const { problem } = this.#state;
    const abort = new AbortController();
    const began = performance.now();
    clearTimeout(this.#retryTimer);
    try {
      const loaded = await this.#source.load(problem, abort.signal);
      this.#abort.abort();
      this.#abort = abort;
      this.#accept(loaded, performance.now() - began);
    } catch (error) {
      this.#refuse(error);
    }
  }

  #accept(loaded: Loaded, milliseconds: number): void {
    this.#tries = 0;
    elements.banner.hidden = true;
    markRefused(null);
    const { velocity, Omega } = loaded.motion.at(0);
    const rests = Math.hypot(...velocity, ...Omega) < 1e-12;
    elements.message.textContent = `${this.#state.broken} ${rests ? RESTS : ""}`.trim();
    this.#state.broken = "";
    this.#controls.mark([]);
    this.#show(loaded);
    this.#origin = originOf(loaded, milliseconds);
    this.#said = "";
    clearTimeout(this.#compareTimer);
    this.#compareTimer = window.setTimeout(() => void this.#compare(loaded), COMPARE_AFTER_MS);
  }

  /** Show a refusal at its field, and dim the motion before; of a server gone or busy, ask again. */
  #refuse(error: unknown): void {
    if (!this.#loaded) this.#gallery.empty();
    if (markRefused(error)) return;
    const gone = error instanceof Unreachable;
    const busy = error instanceof Refusal && BUSY.includes(error.status) && this.#tries++ < 4;
    write(elements.banner, gone ? GONE : "");
    elements.banner.hidden = !gone;
    if (gone || busy) this.#retryTimer = window.setTimeout(() => void this.#load(), RETRY_MS);
    if (busy) elements.message.textContent = `${error.message} The page asks again.`;
    if (gone || busy) return;
    const faults = error instanceof Refusal ? error.faults : [];
    const rest = this.#controls.mark(faults);
    if (rest.length < faults.length) elements.data.open = true;
    const said = [this.#state.broken, ...(faults.length ? rest : [(error as Error).message])];
    elements.message.textContent = [...said, this.#loaded ? DIMMED : ""].join(" ").trim();
  }

  #show(loaded: Loaded): void {
    this.#trail?.close();
    this.#loaded = loaded;
    this.#player.limit(loaded.range);
    const [first, last] = this.#player.range;
    for (const jump of elements.jumps) {
      const time = Number(jump.dataset.time);
      jump.hidden = time < first || time > last;
    }
    elements.letter.textContent = loaded.time;
    this.#gallery.build(loaded);
    this.#showFacts = facts(find("facts"), loaded);
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
      this.#origin = `The engines were not compared: ${(error as Error).message}`;
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
    this.#showFacts(sample);
    this.#trail?.follow(this.#player.time[0]);
    this.#showStatus(loaded);
    const text = this.#player.text();
    // A text that was refused stays beside the reason.
    const refused = elements.time.hasAttribute("aria-invalid");
    if (document.activeElement !== elements.time && !refused) elements.time.value = text;
    this.#showPlaying();
    const took = performance.now() - instant;
    this.#rest = took > SLOW_MS ? performance.now() + took : 0;
  }
}

/** Return where the motion comes from, in a sentence. */
function originOf({ document, range, time, cause }: Loaded, milliseconds: number): string {
  if (range) return `Series of the engine, from ${time} = ${range[0]} to ${range[1]}.`;
  if (!document) return `Series of the service, in stretches of time: ${cause}`;
  return `Closed form in ${milliseconds.toFixed(0)} ms; every picture is computed here.`;
}
