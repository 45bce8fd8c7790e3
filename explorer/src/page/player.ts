/** The time that is shown: any value in two doubles, played at a speed. */
import * as dd from "../evaluator/double_double.ts";
import type { DoubleDouble } from "../evaluator/double_double.ts";

/** Times beyond this are refused. */
export const LATEST = 1e12;

export class Player {
  time: DoubleDouble = [0, 0];
  playing = true;
  speed = 1;
  #before = 0;
  /** The text of a time that was asked for, until it is played on. */
  #exact: string | null = null;

  /** Advance to the instant of a picture, in milliseconds. */
  advance(instant: number): void {
    // A page that was hidden does not jump.
    const seconds = Math.min(0.1, (instant - this.#before) / 1000);
    this.#before = instant;
    if (!this.playing) return;
    this.#exact = null;
    const moved = dd.add(this.time, [seconds * this.speed, 0]);
    if (Math.abs(moved[0]) <= LATEST) this.time = moved;
    else this.playing = false;
  }

  /** Go to the time that a text states; return why it cannot. */
  go(text: string): string | null {
    const time = dd.parse(text.trim().replace("−", "-"));
    if (!Number.isFinite(time[0])) {
      return `t: required a number such as 12.5, 1e12 or 7/10; given ${text.trim() || "nothing"}.`;
    }
    if (Math.abs(time[0]) > LATEST) return `t: required at most 10¹² in size; given ${text.trim()}.`;
    this.time = time;
    this.#exact = text.trim().replace("−", "-");
    return null;
  }

  /** Return the time as text: as it was asked for, or in the digits that can be seen. */
  text(): string {
    if (this.#exact !== null) return this.#exact;
    const [t] = this.time;
    const places = Math.abs(t) < 1e6 ? 3 : Math.abs(t) < 1e9 ? 2 : 1;
    return t.toFixed(places).replace(/\.?0+$/, "").replace(/^-0$/, "0");
  }
}
