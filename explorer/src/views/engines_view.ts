/**
 * Plots: λ_s(t), integrals at times up to 10¹², and the differences of browser, closed form and
 * integration, with their errors, on a logarithmic axis.
 */
import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { dot } from "../evaluator/linear_algebra.ts";
import type { Motion, Sample } from "../evaluator/motion.ts";
import type { Samples } from "../evaluator/samples.ts";
import { BLUE, GREEN, ORANGE, PINK, SERIES, theme, VERMILION } from "./theme.ts";
import { element, energyName, type Loaded, type Picture, short, subscript, View } from "./view.ts";

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

interface PlotLine {
  name: string;
  colour: string;
  dashed?: boolean;
}

interface Plot {
  host: HTMLElement;
  legend: HTMLElement;
  /** The letter of the time. */
  x: string;
  /** Which of the axes are logarithmic. */
  logarithmic: "" | "y" | "xy";
  lines: PlotLine[];
  data: uPlot.AlignedData;
  chart: uPlot | null;
}

interface Comparison extends Picture {
  /** Take the series of the server's engines. */
  compare: (differences: Differences) => void;
}

export class EnginesView extends View<Comparison> {
  readonly #host = element("div", { class: "plots", role: "img" });
  #plots: Plot[] = [];

  constructor() {
    super("engines", "Engines");
    this.canvas.replaceWith(this.#host);
    this.#host.setAttribute("aria-label", "Plots of the motion and of its errors");
    this.#host.setAttribute("aria-describedby", this.twin.id);
  }

  override refusal({ motion, document }: Loaded): string | null {
    if (document || motion.moments.length > 1) return null;
    return "Without a closed form there is nothing to compare.";
  }

  build(loaded: Loaded): Comparison {
    const { motion, document, time } = loaded;
    this.say(
      document
        ? "The same motion computed in three ways, and how little they differ."
        : "The coordinates λ of q against time; nothing else is known here to compare with.",
    );
    this.#host.classList.toggle("alone", !document);
    for (const { chart } of this.#plots) chart?.destroy();
    this.#plots = [];
    this.#host.replaceChildren();
    const coordinates = Array.from(motion.at(0).lambda, (_, s) => ({
      name: `λ${subscript(s + 1)}`,
      colour: SERIES[s % SERIES.length],
    }));
    const course = coordinates.length ? this.#add(`λ(${time})`, time, "") : null;
    if (course) fill(course, coordinates, [[]]);
    const largest: string[] = [];
    if (document) {
      const { times, columns, names } = integralErrors(loaded);
      const lines = names.map((name, k) => ({ name, colour: [BLUE, GREEN, ORANGE, PINK][k] }));
      fill(this.#add("Change of integrals", time, "xy"), lines, [times, ...columns]);
      const last = columns.map((column) => column[column.length - 1]);
      largest.push(`At 10⁶ the integrals are off by ${short(Math.max(...last), 2)}.`);
    }
    const awaited = document ? this.#add("Difference of frames", time, "y") : null;
    return {
      extend: (samples, anew) => {
        if (course) goOn(course, samples, anew);
      },
      compare: (found) => {
        if (!awaited) return;
        const lines: PlotLine[] = [];
        const columns: number[][] = [];
        const add = (name: string, colour: string, series: EngineSeries | null) => {
          if (!series) return;
          const away = differencesOf(motion, series);
          lines.push({ name: `browser − ${name}`, colour }, { name: `error of ${name}`, colour, dashed: true });
          columns.push(away, series.error.map((x) => Math.max(x, FLOOR)));
          largest.push(`Browser and ${name} differ by at most ${short(Math.max(...away), 2)}.`);
        };
        add("closed form", BLUE, found.analytic);
        add("integration", VERMILION, found.numeric);
        const times = (found.analytic ?? found.numeric)?.times;
        if (times) fill(awaited, lines, [times, ...columns]);
        else awaited.host.remove();
      },
      describe: ({ lambda }) => {
        const now = lambda.length ? `λ is ${Array.from(lambda, (x) => short(x)).join(", ")}. ` : "";
        return `${now}${largest.join(" ")}`;
      },
    };
  }

  #add(title: string, x: string, logarithmic: Plot["logarithmic"]): Plot {
    const legend = element("p", { class: "legend" }, "computing…");
    const host = element("div", { class: "plot" }, element("h3", {}, title), legend);
    this.#host.append(host);
    const plot: Plot = { host, legend, x, logarithmic, lines: [], data: [[]], chart: null };
    this.#plots.push(plot);
    return plot;
  }

  draw(): void {
    for (const plot of this.#plots) {
      const fit = plot.host.clientWidth - 4;
      if (plot.data.length < 2 || fit < 60) continue;
      plot.chart ??= makeChart(plot, fit);
      if (Math.abs(plot.chart.width - fit) > 2) plot.chart.setSize({ width: fit, height: HEIGHT });
    }
  }

  /** Return the canvases of the plots, for pictures. */
  canvases(): HTMLCanvasElement[] {
    return this.#plots.flatMap(({ chart }) => (chart ? [chart.ctx.canvas] : []));
  }
}

/** Give a plot its lines, with a legend, and their data. */
function fill(plot: Plot, lines: PlotLine[], data: uPlot.AlignedData): void {
  Object.assign(plot, { lines, data });
  const entries = lines.map(({ name, colour, dashed }) => {
    const mark = element("i", { class: dashed ? "dashed" : "" });
    mark.style.borderColor = colour;
    return element("span", {}, mark, name);
  });
  plot.legend.replaceChildren(...entries);
}

/** Append the coordinates of new samples to their plot. */
function goOn(plot: Plot, { times, lambda }: Samples, anew: boolean): void {
  const count = lambda.length / times.length;
  const fresh = [times, ...plot.lines.map((_, s) => times.map((_, k) => lambda[k * count + s]))];
  plot.data = fresh.map((column, i) => {
    const kept = anew ? [] : Array.from(plot.data[i] ?? []);
    return [...kept, ...column.slice(-WINDOW)].slice(-WINDOW);
  }) as uPlot.AlignedData;
  plot.chart?.setData(plot.data);
}

/** Return the largest differences of the frames of a motion from those of an engine. */
const differencesOf = (motion: Motion, { times, frame }: EngineSeries): number[] =>
  times.map((t, k) => {
    const own = motion.at(t).frame;
    return Math.max(FLOOR, ...frame[k].flat().map((x, i) => Math.abs(x - own[i])));
  });

function makeChart(plot: Plot, width: number): uPlot {
  const colours = theme();
  const [x, y] = ["x", "y"].map((axis) => plot.logarithmic.includes(axis));
  const axis: uPlot.Axis = {
    stroke: colours.text,
    grid: { stroke: colours.line, width: 1 },
    ticks: { stroke: colours.line, width: 1, size: 4 },
    font: FONT_OF_AXES,
  };
  const label = { labelFont: FONT_OF_AXES, labelSize: 16, labelGap: 0 };
  const powers: uPlot.Axis = { splits: decades, filter: (_, all) => all, values: (_, all) => all.map(powerOfTen) };
  const options: uPlot.Options = {
    width,
    height: HEIGHT,
    legend: { show: false },
    cursor: { show: false },
    // Curves keep to their values, not to whole pixels.
    pxAlign: 0,
    scales: { x: { time: false, distr: x ? 3 : 1 }, y: { distr: y ? 3 : 1 } },
    axes: [
      { ...axis, size: 26, label: (chart) => labelOf(chart, plot.x), ...label, ...(x ? powers : { values: valuesOf }) },
      { ...axis, size: 46, ...(y ? powers : {}) },
    ],
    series: [
      {},
      ...plot.lines.map(({ colour, dashed }) => ({
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
  const columns = Array.from(q, (_, j) => Array.from(q, (_, i) => frame[i * q.length + j]));
  const off = columns.flatMap((a, i) => columns.map((b, j) => Math.abs(dot(a, b) - (i === j ? 1 : 0))));
  return [dot(q, q), 1 + Math.max(...off)];
}

/** Return Σ c_k = tr I − (q,Iq) − (q',q'), and the energy. */
function ofRankOne({ q, prime, velocity }: Sample, A: number[]): number[] {
  const form = (x: ArrayLike<number>, y: ArrayLike<number>) => A.reduce((sum, a, i) => sum + a * x[i] * y[i], 0);
  const c = A.reduce((sum, a, i) => sum + (1 - q[i] * q[i]) / a - prime[i] * prime[i], 0);
  return [c, form(velocity, velocity) * form(q, q) - form(q, velocity) ** 2];
}
