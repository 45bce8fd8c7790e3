/**
 * Plots: λ_s(t), integrals at times up to 10¹², and the differences of browser, closed form and
 * integration, with their errors, on a logarithmic axis.
 */
import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import type { Sample } from "../evaluator/motion.ts";
import type { Samples } from "../evaluator/samples.ts";
import { BLUE, GREEN, ORANGE, PINK, SERIES, theme, VERMILION } from "./theme.ts";
import { element, energyName, type Loaded, short, subscript, View } from "./view.ts";

/** Samples of the trail that the first plot shows. */
const WINDOW = 1200;

/** The height of a plot, in pixels. */
const HEIGHT = 220;

const FONT_OF_AXES = "11px 'DejaVu Sans', system-ui, sans-serif";

/** Times beyond this part of what a plot shows are written as their difference from the newest. */
const FAR = 1e4;

/** What is zero is drawn here on a logarithmic axis. */
const FLOOR = 1e-17;

/** A series of one engine of the server, with its own error at each time. */
export interface EngineSeries {
  times: number[];
  frame: number[][][];
  error: number[];
}

export interface Differences {
  analytic: EngineSeries | null;
  numeric: EngineSeries | null;
}

interface Plot {
  title: string;
  x: string;
  host: HTMLElement;
  logarithmic: boolean;
  longTimes: boolean;
  lines: { name: string; colour: string; dashed?: boolean }[];
  data: uPlot.AlignedData;
  chart: uPlot | null;
}

export class EnginesView extends View {
  readonly #host = element("div", { class: "plots" });
  #plots: Plot[] = [];
  #loaded: Loaded | null = null;
  /** The plot of the coordinates, which goes on as the motion does. */
  #motion: Plot | null = null;
  #largest: string[] = [];
  /** The plot of differences while the server computes them. */
  #awaited: Plot | null = null;
  #stale = true;

  constructor() {
    super("engines", "Engines");
    this.canvas.replaceWith(this.#host);
    this.#host.setAttribute("role", "img");
    this.#host.setAttribute("aria-label", "Plots of the motion and of its errors");
    this.#host.setAttribute("aria-describedby", this.twin.id);
  }

  refusal({ motion, document }: Loaded): string | null {
    if (document || motion.moments.length > 1) return null;
    return "Without a closed form there is nothing to compare.";
  }

  build(loaded: Loaded): void {
    this.#loaded = loaded;
    this.say(
      loaded.document
        ? "The same motion computed in three ways, and how little they differ."
        : "The coordinates λ of q against time; nothing else is known here to compare with.",
    );
    this.#host.classList.toggle("alone", !loaded.document);
    for (const { chart } of this.#plots) chart?.destroy();
    this.#plots = [];
    this.#motion = null;
    this.#largest = [];
    this.#host.replaceChildren();
    const lines = Array.from(loaded.motion.at(0).lambda, (_, s) => ({
      name: `λ${subscript(s + 1)}`,
      colour: SERIES[s % SERIES.length],
    }));
    if (lines.length) {
      this.#motion = this.#add(`λ(${loaded.time})`, loaded.time, lines, false, false);
    }
    if (loaded.document) {
      const { times, columns, names } = integralErrors(loaded);
      const colours = [BLUE, GREEN, ORANGE, PINK];
      const lines = names.map((name, k) => ({ name, colour: colours[k] }));
      const plot = this.#add("Change of integrals", loaded.time, lines, true, true);
      plot.data = [times, ...columns];
      const last = columns.map((column) => column[column.length - 1]);
      this.#awaited = this.#add("Difference of frames", loaded.time, [], true, false);
      this.#largest.push(`At 10⁶ the integrals are off by ${short(Math.max(...last), 2)}.`);
    }
  }

  /** Take the series of the server's engines. */
  compare({ analytic, numeric }: Differences): void {
    if (!this.#loaded) return;
    this.#awaited?.host.remove();
    const { motion, time } = this.#loaded;
    const lines: Plot["lines"] = [];
    const columns: number[][] = [];
    const add = (name: string, colour: string, series: EngineSeries | null) => {
      if (!series) return;
      const found = series.times.map((t, k) => {
        const own = motion.at(t).frame;
        return Math.max(FLOOR, ...series.frame[k].flat().map((x, i) => Math.abs(x - own[i])));
      });
      lines.push({ name: `browser − ${name}`, colour });
      lines.push({ name: `error of ${name}`, colour, dashed: true });
      columns.push(found, series.error.map((x) => Math.max(x, FLOOR)));
      this.#largest.push(`Browser and ${name} differ by at most ${short(Math.max(...found), 2)}.`);
    };
    add("closed form", BLUE, analytic);
    add("integration", VERMILION, numeric);
    const times = (analytic ?? numeric)?.times;
    if (!times) return;
    const plot = this.#add("Difference of frames", time, lines, true, false);
    plot.data = [times, ...columns];
    this.#stale = true;
  }

  #add(title: string, x: string, lines: Plot["lines"], logarithmic: boolean, longTimes: boolean) {
    const host = element("div", { class: "plot" });
    const heading = element("h3", {}, title);
    const legend = element("p", { class: "legend" });
    for (const { name, colour, dashed } of lines) {
      const mark = element("i", { class: dashed ? "dashed" : "" });
      mark.style.borderColor = colour;
      const entry = element("span", {}, name);
      entry.prepend(mark);
      legend.append(entry);
    }
    host.append(heading, legend, element("p", { class: "legend computing" }, "computing…"));
    this.#host.append(host);
    const plot: Plot = { title, x, host, logarithmic, longTimes, lines, data: [[]], chart: null };
    this.#plots.push(plot);
    return plot;
  }

  override extend({ times, lambda }: Samples, anew: boolean): void {
    const plot = this.#motion;
    if (!plot || !lambda.length) return;
    const count = lambda.length / times.length;
    const fresh = [
      Array.from(times),
      ...plot.lines.map((_, s) => Array.from(times, (_, k) => lambda[k * count + s])),
    ];
    const kept = (column: number) => (anew ? [] : Array.from(plot.data[column] ?? []));
    const columns = fresh.map((column, i) => [...kept(i), ...column.slice(-WINDOW)].slice(-WINDOW));
    plot.data = columns as uPlot.AlignedData;
    plot.chart?.setData(plot.data);
  }

  show(): void {}

  draw(): void {
    const width = Math.floor(this.#host.clientWidth);
    if (!width) return;
    for (const plot of this.#plots) {
      const fit = plot.host.clientWidth - 4;
      if (plot.data.length < 2 || fit < 60) continue;
      if (!plot.chart || this.#stale) {
        plot.chart?.destroy();
        plot.host.querySelector(".computing")?.remove();
        plot.chart = makeChart(plot, fit);
      } else if (Math.abs(plot.chart.width - fit) > 2) {
        plot.chart.setSize({ width: fit, height: plot.chart.height });
      }
    }
    this.#stale = false;
  }

  /** Return the canvases of the plots, for pictures. */
  canvases(): HTMLCanvasElement[] {
    return this.#plots.flatMap(({ chart }) => (chart ? [chart.ctx.canvas] : []));
  }

  describe({ lambda }: Sample): string {
    const now = lambda.length ? `λ is ${Array.from(lambda, (x) => short(x)).join(", ")}. ` : "";
    return `${now}${this.#largest.join(" ")}`;
  }
}

function makeChart(plot: Plot, width: number): uPlot {
  const colours = theme();
  const axis = (side: number, logarithmic: boolean): uPlot.Axis => ({
    stroke: colours.text,
    grid: { stroke: colours.line, width: 1 },
    ticks: { stroke: colours.line, width: 1, size: 4 },
    size: side === 2 ? 26 : 46,
    font: FONT_OF_AXES,
    ...(side === 2
      ? { label: (chart) => labelOf(chart, plot.x), labelFont: FONT_OF_AXES, labelSize: 16, labelGap: 0 }
      : {}),
    ...(side === 2 && !logarithmic ? { values: valuesOf } : {}),
    ...(logarithmic
      ? { splits: decades, filter: (_, all) => all, values: (_, all) => all.map(powerOfTen) }
      : {}),
  });
  const options: uPlot.Options = {
    width,
    height: HEIGHT,
    legend: { show: false },
    cursor: { show: false },
    // Curves keep to their values, not to whole pixels.
    pxAlign: 0,
    scales: {
      x: { time: false, distr: plot.longTimes ? 3 : 1 },
      y: { distr: plot.logarithmic ? 3 : 1 },
    },
    axes: [axis(2, plot.longTimes), axis(3, plot.logarithmic)],
    series: [
      {},
      ...plot.lines.map(({ name, colour, dashed }) => ({
        label: name,
        stroke: colour,
        width: 1.5,
        points: { show: false },
        ...(dashed ? { dash: [5, 4] } : {}),
      })),
    ],
  };
  return new uPlot(options, plot.data, plot.host);
}

/** Return the newest time of a plot whose times are too far to be written; null of others. */
function newestOf(chart: uPlot): number | null {
  const times = chart.data[0];
  const [first, last] = [times[0] ?? 0, times[times.length - 1] ?? 0];
  return Math.abs(last) > FAR * (last - first) && Math.abs(last) > FAR ? last : null;
}

function labelOf(chart: uPlot, x: string): string {
  return newestOf(chart) === null ? x : `${x}, from the newest`;
}

/** Return what is written at the marks of a time axis. */
function valuesOf(chart: uPlot, marks: number[]): string[] {
  const newest = newestOf(chart);
  return marks.map((mark) => {
    const shown = newest === null ? mark : Number((mark - newest).toPrecision(3));
    return String(Number(shown.toPrecision(12))).replace("-", "−");
  });
}

/** Return at most seven powers of ten between two numbers. */
function decades(_: uPlot, __: number, low: number, high: number): number[] {
  const [first, last] = [Math.ceil(Math.log10(low) - 1e-9), Math.floor(Math.log10(high) + 1e-9)];
  const step = Math.max(1, Math.ceil((last - first) / 6));
  return Array.from({ length: Math.floor((last - first) / step) + 1 }, (_, k) =>
    Number(`1e${first + k * step}`),
  );
}

function powerOfTen(value: number): string {
  const digits = String(Math.round(Math.log10(value))).replace("-", "⁻");
  return `10${digits.replace(/\d/g, (digit) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[Number(digit)])}`;
}

/** Return how far integrals at times from 0.1 to 10⁶ are from those at the start. */
function integralErrors({ motion, document, A, problem }: Loaded) {
  const times = Array.from({ length: 141 }, (_, k) => 10 ** (-1 + k / 20));
  const energy = motion.body || (document?.time === "t" && A.length === motion.n);
  const names = ["(q,q)", "EᵀE", ...(motion.body ? [] : ["Σ cₖ"]), ...(energy ? [energyName(problem, motion)] : [])];
  const integrals = (sample: Sample) => [
    ...ofFrame(sample),
    ...(motion.body ? [motion.body.integralOf(sample)] : ofRankOne(sample, A)),
  ];
  const start = integrals(motion.at(0));
  const rows = times.map((t) => integrals(motion.at(t)));
  const columns = names.map((_, k) =>
    rows.map((row) => Math.max(FLOOR, Math.abs(row[k] - start[k]) / (Math.abs(start[k]) || 1))),
  );
  return { times, columns, names };
}

/** Return (q,q), and 1 more than the largest entry of EᵀE − 1. */
function ofFrame({ q, frame }: Sample): number[] {
  const n = q.length;
  let off = 0;
  for (let a = 0; a < n; a++) {
    for (let b = 0; b <= a; b++) {
      let product = a === b ? -1 : 0;
      for (let i = 0; i < n; i++) product += frame[i * n + a] * frame[i * n + b];
      off = Math.max(off, Math.abs(product));
    }
  }
  return [q.reduce((total, x) => total + x * x, 0), 1 + off];
}

/** Return Σ c_k = tr I − (q,Iq) − (q',q'), and the energy. */
function ofRankOne({ q, prime, velocity }: Sample, A: number[]): number[] {
  const sum = (f: (i: number) => number) => A.reduce((total, _, i) => total + f(i), 0);
  const c = sum((i) => (1 - q[i] * q[i]) / A[i] - prime[i] * prime[i]);
  const [vv, qq, qv] = [
    sum((i) => A[i] * velocity[i] ** 2),
    sum((i) => A[i] * q[i] ** 2),
    sum((i) => A[i] * q[i] * velocity[i]),
  ];
  return [c, vv * qq - qv * qv];
}
