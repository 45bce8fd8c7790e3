/** The time that is shown: any value in two doubles, played at a speed. */
import * as dd from "../evaluator/double_double.ts";
import type { DoubleDouble } from "../evaluator/double_double.ts";
import { tidy } from "./systems.ts";

/** Times beyond this are refused. */
export const LATEST = 1e12;

export class Player {
  time: DoubleDouble = [0, 0];
  playing = true;
  speed = 1;
  /** The first and last time that can be shown. */
  range: [number, number] = [-LATEST, LATEST];
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
    this.playing = moved[0] < this.range[1];
    this.time = this.playing ? moved : [this.range[1], 0];
  }

  /** Play or pause; at the last time, play from the first one. */
  toggle(): void {
    this.playing = !this.playing;
    const [first, last] = this.range;
    if (!this.playing || last >= LATEST || this.time[0] < last) return;
    this.time = [first, 0];
    this.#exact = null;
  }

  /** Keep to the times that are known. */
  limit(range: [number, number] | null): void {
    this.range = range ?? [-LATEST, LATEST];
    const kept = Math.min(Math.max(this.time[0], this.range[0]), this.range[1]);
    if (kept === this.time[0]) return;
    this.time = [kept, 0];
    this.#exact = null;
  }

  /** Go to the time that a text states; return why it cannot. */
  go(given: string): string | null {
    const text = tidy(given);
    const time = dd.parse(text);
    if (Math.abs(time[0]) > LATEST || Math.abs(Number(text)) > LATEST) {
      return `t: required at most 10¹² in size; given ${text}.`;
    }
    if (Number.isNaN(time[0])) return `t: required a number such as 7/10; given ${text || "nothing"}.`;
    const [first, last] = this.range;
    if (time[0] < first || time[0] > last) {
      return `t: known from ${first} to ${last}; given ${text}.`;
    }
    this.time = time;
    this.#exact = text;
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
