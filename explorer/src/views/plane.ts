/** Two dimensions: views that are drawn with a pen, and names that are written into pictures. */
import { FONT, theme } from "./theme.ts";
import { type Picture, View } from "./view.ts";

export type Place = [number, number];

/** Draws on a canvas; widths and radii are in units of length, of which each has `ratio` pixels. */
export class Pen {
  readonly context: CanvasRenderingContext2D;
  readonly ratio: number;
  /** The height of letters. */
  readonly #size: number;
  /** Boxes where no name is written, by their middles and half sides. */
  readonly #taken: { x: number; y: number; wide: number; tall: number }[] = [];

  constructor(context: CanvasRenderingContext2D, ratio: number, size = 12) {
    this.context = context;
    this.ratio = ratio;
    this.#size = size * ratio;
  }

  /** Draw the line through points. */
  stroke(points: Place[], colour: string, width = 1): void {
    const { context, ratio } = this;
    context.strokeStyle = colour;
    context.lineWidth = width * ratio;
    context.beginPath();
    for (const point of points) context.lineTo(...point);
    context.stroke();
  }

  /** Shade a polygon. */
  shade(corners: Place[], colour: string): void {
    const { context } = this;
    context.globalAlpha = 0.38;
    context.fillStyle = colour;
    context.beginPath();
    for (const corner of corners) context.lineTo(...corner);
    context.fill();
    context.globalAlpha = 1;
  }

  /** Mark a point of the motion. */
  mark([x, y]: Place, colour: string): void {
    const { context, ratio } = this;
    for (const [radius, fill] of [[6.5, theme().text], [4.5, colour]] as const) {
      context.fillStyle = fill;
      context.beginPath();
      context.arc(x, y, radius * ratio, 0, 2 * Math.PI);
      context.fill();
    }
  }

  /** Keep a box free of names, such as the square of a point. */
  keepFree(x: number, y: number, wide: number, tall = wide): void {
    this.#taken.push({ x, y, wide, tall });
  }

  /** Write a name with a rim, in the middle of a place or as near below or above it as there is room. */
  write(text: string, x: number, y: number, align: "center" | "right" = "center"): void {
    const { context, ratio } = this;
    const { width, height } = context.canvas;
    const colours = theme();
    context.font = `${this.#size}px ${FONT}`;
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.lineWidth = 3 * ratio;
    context.lineJoin = "round";
    context.strokeStyle = colours.background;
    context.fillStyle = colours.text;
    const half = context.measureText(text).width / 2;
    const [wide, tall] = [half + 4 * ratio, 0.62 * this.#size];
    const inside = (at: number, margin: number, end: number) => Math.min(Math.max(at, margin), end - margin);
    const across = inside(align === "right" ? x - half : x, wide, width);
    const wanted = inside(y, tall, height);
    const beside = this.#taken.filter((box) => Math.abs(box.x - across) < box.wide + wide);
    const up = [wanted, ...beside.flatMap((box) => [1, -1].map((side) => box.y + side * (box.tall + tall)))]
      .filter((at) => at >= tall && at <= height - tall)
      .filter((at) => beside.every((box) => Math.abs(box.y - at) > box.tall + tall - 0.1))
      .sort((a, b) => Math.abs(a - wanted) - Math.abs(b - wanted))[0];
    if (up === undefined) return;
    this.keepFree(across, up, wide, tall);
    context.strokeText(text, across, up);
    context.fillText(text, across, up);
  }
}

/** A picture that a pen draws on an empty canvas. */
export interface Drawing extends Picture {
  paint: (pen: Pen) => void;
}

export abstract class View2D<P extends Drawing = Drawing> extends View<P> {
  draw(): void {
    const ratio = this.fit();
    const context = this.canvas.getContext("2d");
    if (!context) return;
    context.fillStyle = theme().background;
    context.fillRect(0, 0, this.canvas.width, this.canvas.height);
    this.picture?.paint(new Pen(context, ratio));
  }
}
