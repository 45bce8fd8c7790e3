/** Names that are written into pictures: with a rim, and none over another. */
import { FONT, theme } from "./theme.ts";

interface Box {
  left: number;
  right: number;
  top: number;
  bottom: number;
}

export class Names {
  readonly #context: CanvasRenderingContext2D;
  readonly #ratio: number;
  readonly #size: number;
  readonly #taken: Box[] = [];

  /** `ratio` is the pixels of one unit of length, `size` the height of letters in such units. */
  constructor(context: CanvasRenderingContext2D, ratio: number, size = 13) {
    this.#context = context;
    this.#ratio = ratio;
    this.#size = size;
  }

  /** Keep a square free of names, such as that of a point. */
  keepFree(x: number, y: number, half: number): void {
    this.#taken.push({ left: x - half, right: x + half, top: y - half, bottom: y + half });
  }

  /** Write a name, whole, in the middle of a place or as near below or above it as there is room. */
  write(text: string, x: number, y: number, align: "center" | "right" = "center"): void {
    const context = this.#context;
    const { width } = context.canvas;
    const colours = theme();
    context.font = `${this.#size * this.#ratio}px ${FONT}`;
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.lineWidth = 3 * this.#ratio;
    context.lineJoin = "round";
    context.strokeStyle = colours.background;
    context.fillStyle = colours.text;
    const wide = context.measureText(text).width / 2;
    const half = wide + 4 * this.#ratio;
    const tall = 0.62 * this.#size * this.#ratio;
    const middle = align === "right" ? x - wide : x;
    const across = Math.min(Math.max(middle, half), width - half);
    const up = this.#free({ left: across - half, right: across + half, top: y - tall, bottom: y + tall });
    if (up !== undefined) {
      context.strokeText(text, across, up);
      context.fillText(text, across, up);
    }
    context.textBaseline = "alphabetic";
  }

  /** Move a box up or down until it is free; return its middle, undefined where there is no room. */
  #free(box: Box): number | undefined {
    const tall = (box.bottom - box.top) / 2;
    const { height } = this.#context.canvas;
    const wanted = Math.min(Math.max((box.top + box.bottom) / 2, tall), height - tall);
    const beside = this.#taken.filter(({ left, right }) => box.left < right && box.right > left);
    const apart = (y: number, { top, bottom }: Box) =>
      y - tall > bottom - 0.1 || y + tall < top + 0.1;
    const y = [wanted, ...beside.flatMap(({ top, bottom }) => [bottom + tall, top - tall])]
      .filter((place) => place >= tall && place <= height - tall)
      .filter((place) => beside.every((other) => apart(place, other)))
      .sort((a, b) => Math.abs(a - wanted) - Math.abs(b - wanted))[0];
    if (y !== undefined) this.#taken.push({ ...box, top: y - tall, bottom: y + tall });
    return y;
  }
}
