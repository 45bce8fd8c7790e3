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

  /** Write a name in the middle of a place, whole, and above or below what is there. */
  write(text: string, x: number, y: number): void {
    const context = this.#context;
    const { width, height } = context.canvas;
    const colours = theme();
    context.font = `${this.#size * this.#ratio}px ${FONT}`;
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.lineWidth = 3 * this.#ratio;
    context.lineJoin = "round";
    context.strokeStyle = colours.background;
    context.fillStyle = colours.text;
    const half = context.measureText(text).width / 2 + 4 * this.#ratio;
    const tall = 0.62 * this.#size * this.#ratio;
    const across = Math.min(Math.max(x, half), width - half);
    const up = this.#free({ left: across - half, right: across + half, top: y - tall, bottom: y + tall });
    const place = [across, Math.min(Math.max(up, tall), height - tall)] as const;
    context.strokeText(text, ...place);
    context.fillText(text, ...place);
    context.textBaseline = "alphabetic";
  }

  /** Move a box up or down until it is free; return its middle. */
  #free(box: Box): number {
    const tall = (box.bottom - box.top) / 2;
    let y = (box.top + box.bottom) / 2;
    for (let tries = 0; tries < 4; tries++) {
      const other = this.#taken.find(
        ({ left, right, top, bottom }) =>
          box.left < right && box.right > left && y - tall < bottom && y + tall > top,
      );
      if (!other) break;
      y = y < (other.top + other.bottom) / 2 ? other.top - tall : other.bottom + tall;
    }
    this.#taken.push({ ...box, top: y - tall, bottom: y + tall });
    return y;
  }
}
