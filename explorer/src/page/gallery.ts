/** The cards of the views: which can be shown, which is large, and their pictures. */
import type { Sample } from "../evaluator/motion.ts";
import type { Samples } from "../evaluator/samples.ts";
import { BallView } from "../views/ball_view.ts";
import { BodyView } from "../views/body_view.ts";
import { type Choice, ConstantsView } from "../views/constants_view.ts";
import { CurveView } from "../views/curve_view.ts";
import { EllipsoidView } from "../views/ellipsoid_view.ts";
import { type Differences, EnginesView } from "../views/engines_view.ts";
import { ShellView } from "../views/shell_view.ts";
import { SphereView } from "../views/sphere_view.ts";
import { onGraphics, sharedRenderer, View3D } from "../views/stage.ts";
import { theme } from "../views/theme.ts";
import { TorusView } from "../views/torus_view.ts";
import { element, type Loaded, type View, write } from "../views/view.ts";
import { pictureOf, save } from "./exports.ts";
import { filmType, record, type Recording } from "./recorder.ts";

/** Milliseconds between two writings of the twins in text. */
const TWIN_EVERY_MS = 1000;

const LOST =
  "The browser has taken the graphics away: scenes in space stand still until it gives them back. If it does not, load the page again.";

const NO_WEBGL = "This browser has no WebGL: scenes in space are left out, plots work.";

/** What views ask of the page. */
export interface Hooks {
  /** Begin at constants that were chosen on the map. */
  choose: (choice: Choice) => void;
  /** A view was enlarged, or none. */
  enlarged: (name: string) => void;
  /** Let the motion play. */
  play: () => void;
  /** Say something in a sentence. */
  say: (sentence: string) => void;
}

export class Gallery {
  readonly #engines = new EnginesView();
  readonly #views: View[];
  readonly #host: HTMLElement;
  readonly #absent = element("p", { id: "absent" });
  readonly #lost = element("p", { id: "lost", role: "alert" });
  readonly #seen = new Set<Element>();
  readonly #hooks: Hooks;
  /** Films that are being recorded; their views are drawn out of sight too. */
  readonly #recordings = new Map<View, Recording>();
  #shown: View[] = [];
  #written = -TWIN_EVERY_MS;
  #time = NaN;
  /** The views of a lecture, the first ones first; empty without one. */
  #lecture: string[] = [];
  #count = 2;

  constructor(host: HTMLElement, hooks: Hooks) {
    this.#host = host;
    this.#hooks = hooks;
    this.#views = [
      new BodyView(),
      new SphereView(),
      new TorusView(),
      new BallView(),
      new ShellView(),
      new EllipsoidView(),
      new CurveView(),
      new ConstantsView(hooks.choose),
      this.#engines,
    ];
    const watch = new IntersectionObserver((entries) => {
      for (const { target, isIntersecting } of entries) {
        if (isIntersecting) this.#seen.add(target);
        else this.#seen.delete(target);
      }
    });
    for (const view of this.#views) {
      view.card.append(this.#tools(view));
      host.append(view.card);
      watch.observe(view.card);
    }
    host.append(this.#absent);
    host.parentElement?.before(this.#lost);
    onGraphics((lost) => {
      this.#lost.textContent = lost ? LOST : "";
      this.refresh();
    });
  }

  #tools(view: View): HTMLElement {
    const tools = element("div", { class: "card-tools" });
    const add = (text: string, label: string, act: (made: HTMLButtonElement) => void) => {
      const made = element("button", { type: "button", "aria-label": `${text}, ${label}: ${view.title}` }, text);
      made.addEventListener("click", () => act(made));
      tools.append(made);
    };
    add("PNG", "save a picture", () => void this.#savePicture(view));
    const type = filmType();
    if (type && (view instanceof View3D || view.name === "curve")) {
      add("WebM", "record a film", (made) => void this.#record(view, made, type));
    }
    if (view !== this.#engines) {
      add("⤢", "enlarge or reduce", () => {
        const large = view.card.classList.contains("large") ? "" : view.name;
        this.enlarge(large);
        this.#hooks.enlarged(large);
      });
    }
    return tools;
  }

  async #savePicture(view: View): Promise<void> {
    view.draw();
    const canvases = view === this.#engines ? this.#engines.canvases() : [view.canvas];
    if (canvases.length) save(await pictureOf(canvases, theme().background), `${view.name}.png`);
  }

  /** Record a film until the button is pressed again. */
  async #record(view: View, made: HTMLButtonElement, type: string): Promise<void> {
    const going = this.#recordings.get(view);
    if (going) {
      going.stop();
      return;
    }
    this.#hooks.play();
    const recording = record(view.canvas, type);
    this.#recordings.set(view, recording);
    made.textContent = "Stop";
    try {
      save(await recording.film, `${view.name}.webm`);
    } catch (error) {
      this.#hooks.say((error as Error).message);
    } finally {
      this.#recordings.delete(view);
      made.textContent = "WebM";
    }
  }

  /** Make one view as broad as the page, or none. */
  enlarge(name: string): void {
    for (const view of this.#views) {
      const large = view.name === name;
      view.card.classList.toggle("large", large);
      if (large) this.#host.prepend(view.card);
    }
    if (!name) for (const view of this.#views) this.#host.append(view.card);
    this.#host.append(this.#absent);
    this.#fillRows();
  }

  /** Show the first views of a list that the motion has, and no others; all where it is empty. */
  feature(names: string[], count: number): void {
    this.#lecture = names;
    const shown = [...new Set([...names, "body", "sphere"])].filter((name) =>
      this.#shown.some((view) => view.name === name),
    );
    const chosen = names.length ? shown.slice(0, count) : [];
    for (const { card, name } of this.#views) {
      card.classList.toggle("featured", chosen.includes(name));
      card.style.order = chosen[0] === name ? "-1" : "";
    }
    this.#host.classList.toggle("alone", chosen.length === 1);
    this.#count = count;
    this.refresh();
  }

  /** Make some cards broader, so that no row of three or two columns ends with a hole. */
  #fillRows(): void {
    const small = this.#shown.filter(
      ({ card, name }) => name !== "engines" && !card.classList.contains("large"),
    );
    // The body first, then the ball, which has much to show on a broad picture.
    const first = ["body", "ball", "shell", "sphere"].flatMap((name) => small.filter((view) => view.name === name));
    for (const columns of [2, 3]) {
      const holes = (columns - (small.length % columns)) % columns;
      this.#views.forEach((view) => {
        const place = first.indexOf(view);
        view.card.classList.toggle(`broad-of-${columns}`, place >= 0 && place < holes);
      });
    }
  }

  /** Show no view: there is no motion. */
  empty(): void {
    for (const { card } of this.#views) card.hidden = true;
    this.#absent.textContent = "There is no motion to show.";
  }

  /** Begin with another motion; views that cannot show it are named with the reason. */
  build(loaded: Loaded): void {
    const webgl = sharedRenderer() !== null;
    const lacking = new Map<string, string[]>();
    this.#shown = this.#views.filter((view) => {
      const reason = view instanceof View3D && !webgl ? "" : view.refusal(loaded);
      view.card.hidden = reason !== null;
      if (reason) lacking.set(reason, [...(lacking.get(reason) ?? []), view.title]);
      return reason === null;
    });
    const reasons = [...lacking].map(([reason, titles]) => `${titles.join(", ")}: ${reason}`);
    this.#absent.textContent = [...(webgl ? [] : [NO_WEBGL]), ...reasons].join(" ");
    this.#fillRows();
    for (const view of this.#shown) view.begin(loaded);
    this.feature(this.#lecture, this.#count);
  }

  extend(samples: Samples, anew: boolean): void {
    for (const view of this.#shown) view.extend(samples, anew);
  }

  /** Take the series of the server's engines. */
  compare(differences: Differences): void {
    this.#engines.picture?.compare(differences);
    this.#engines.stale = true;
    this.#written = -TWIN_EVERY_MS;
  }

  /** Have everything drawn and described anew. */
  refresh(): void {
    for (const view of this.#shown) view.stale = true;
    this.#written = -TWIN_EVERY_MS;
  }

  /** Show a time; what has not changed is not drawn again. */
  show(sample: Sample): void {
    const now = performance.now();
    const moved = sample.t !== this.#time;
    const due = now - this.#written >= TWIN_EVERY_MS;
    if (due) this.#written = now;
    this.#time = sample.t;
    for (const view of this.#shown) {
      if (moved) view.stale = true;
      // What is out of sight is drawn now and then, so that scrolling finds no empty card.
      const watched = due || this.#seen.has(view.card) || this.#recordings.has(view);
      if (view.stale && watched) {
        view.show(sample);
        view.draw();
        view.stale = false;
      }
      if (due) write(view.twin, view.picture?.describe(sample) ?? "");
    }
  }
}
