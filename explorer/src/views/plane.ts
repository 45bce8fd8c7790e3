/** Two dimensions: views that are drawn with a pen. */
import { Names } from "./names.ts";
import { theme } from "./theme.ts";
import { View } from "./view.ts";

export type Place = [number, number];

/** Draws on a canvas; widths and radii are in units of length, of which each has `ratio` pixels. */
export class Pen {
  readonly context: CanvasRenderingContext2D;
  readonly ratio: number;
  readonly names: Names;

  constructor(context: CanvasRenderingContext2D, ratio: number) {
    this.context = context;
    this.ratio = ratio;
    this.names = new Names(context, ratio, 12);
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
}

export abstract class View2D extends View {
  draw(): void {
    const ratio = this.fit();
    const context = this.canvas.getContext("2d");
    if (!context) return;
    context.fillStyle = theme().background;
    context.fillRect(0, 0, this.canvas.width, this.canvas.height);
    this.paint(new Pen(context, ratio));
  }

  /** Draw what is shown on an empty canvas. */
  protected abstract paint(pen: Pen): void;
}
