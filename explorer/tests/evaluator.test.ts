/**
 * The evaluator against series that the Python engine made: EVALUATOR_CASES names a JSON file of
 * cases (tests/explorer/test_evaluator.py writes it).
 */
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { convergents, partialQuotients } from "../src/evaluator/continued_fraction.ts";
import * as dd from "../src/evaluator/double_double.ts";
import { requireDocument } from "../src/evaluator/document.ts";
import type { ClosedFormDocument } from "../src/evaluator/document.ts";
import { motionOf } from "../src/evaluator/motion.ts";
import { fromEllipsoidal, toEllipsoidal, toGeodetic, toPoint } from "../src/evaluator/geodetic.ts";
import { spheroconic } from "../src/evaluator/spheroconic.ts";

interface Case {
  name: string;
  document: ClosedFormDocument;
  times: (number | string)[];
  /** Bounds of the deviation, of each time. */
  bounds: number[];
  frame: number[][][];
  position?: number[][];
  velocity?: number[][];
  Omega?: number[][];
  drift?: number[];
}

const file = process.env.EVALUATOR_CASES;
const cases: Case[] = file ? JSON.parse(readFileSync(file, "utf8")) : [];

const largest = (values: number[]): number => Math.max(...values.map(Math.abs));

for (const { name, document, times, bounds, frame, position, velocity, Omega, drift } of cases) {
  test(`${name}: frame, contact point and velocities are those of the engine`, () => {
    requireDocument(document);
    const motion = motionOf(document);
    times.forEach((time, k) => {
      const sample = motion.at(dd.parse(time));
      const deviation = largest(frame[k].flat().map((entry, i) => entry - sample.frame[i]));
      assert.ok(deviation <= bounds[k], `t = ${time}: ${deviation} exceeds ${bounds[k]}`);
      if (position && sample.position) {
        const away = largest(position[k].map((entry, i) => entry - sample.position![i]));
        const scale = 1 + largest(position[k]);
        assert.ok(away <= 10 * bounds[k] * scale, `t = ${time}: contact point ${away}`);
      }
      if (velocity) {
        const off = largest(velocity[k].map((entry, i) => entry - sample.velocity[i]));
        assert.ok(off <= 20 * bounds[k], `t = ${time}: velocity ${off} exceeds ${20 * bounds[k]}`);
      }
      if (Omega) {
        const off = largest(Omega[k].map((entry, i) => entry - sample.Omega[i]));
        assert.ok(off <= 20 * bounds[k], `t = ${time}: Ω ${off} exceeds ${20 * bounds[k]}`);
      }
      if (drift) {
        const off = largest(drift.map((entry, i) => entry - motion.meanVelocity![i]));
        assert.ok(off < 1e-11, `mean velocity ${off}`);
      }
    });
  });
  test(`${name}: a frame takes at most the milliseconds that a picture has for it`, () => {
    const motion = motionOf(document);
    for (let k = 0; k < 300; k++) motion.at(k * 0.37);
    const durations = Array.from({ length: 9 }, (_, block) => {
      // Processor time: other work on the machine does not count.
      const began = process.cpuUsage();
      for (let k = 0; k < 20; k++) motion.at(1000 + block + k * 0.37);
      const { user, system } = process.cpuUsage(began);
      return (user + system) / 20_000;
    }).sort((a, b) => a - b);
    const limit = document.genus <= 2 ? 1 : 4;
    console.log(`${name}: ${(1000 * durations[4]).toFixed(0)} µs a frame`);
    assert.ok(durations[0] < limit, `${durations[0]} ms`); // the least: busy cores are slower
  });
}

test("decimal texts are numbers of 32 digits", () => {
  const tenth = dd.parse("0.1");
  assert.equal(tenth[0], 0.1);
  assert.ok(Math.abs(tenth[1] + 5.551115123125783e-18) < 1e-33);
  const third = dd.parse("1/3");
  const rest = dd.add(dd.multiply(third, [3, 0]), [-1, 0]);
  assert.ok(Math.abs(rest[0]) < 1e-31);
  assert.ok(Math.abs(dd.remainder(dd.multiply(dd.parse("0.1"), dd.parse("1e15")), 2)) < 1e-15);
  assert.ok(Math.abs(dd.remainder(dd.parse("-0.25"), 2) - 1.75) < 1e-15);
  assert.ok(Number.isNaN(dd.parse("x")[0]));
});

test("continued fractions find the ratio of a resonance and the golden section", () => {
  assert.deepEqual(partialQuotients(1.5), [1, 2]);
  assert.deepEqual(partialQuotients((1 + Math.sqrt(5)) / 2, 6), [1, 1, 1, 1, 1, 1]);
  const [, , third] = convergents(Math.PI, 3);
  assert.deepEqual([third.numerator, third.denominator], [333, 106]);
});

test("spheroconic coordinates are zeros of their equation", () => {
  const [q, I] = [[0.6, 0.48, 0.64], [1 / 3, 1 / 2, 1]];
  const { lambda } = spheroconic([I[2], I[0], I[1]]).of([q[2], q[0], q[1]], q);
  assert.equal(lambda.length, 2);
  for (const value of lambda) {
    const sum = q.reduce((total, entry, i) => total + entry ** 2 / (value - I[i]), 0);
    assert.ok(Math.abs(sum) < 1e-12, `${value}`);
  }
});

test("v is fixed in space and its torus has its coordinates, with an area constant", () => {
  const areas = cases.filter(({ document }) => document.area);
  assert.ok(areas.length > 0 || !cases.length);
  for (const { name, document } of areas) {
    const motion = motionOf(document);
    const [first, later] = [0, 37.5].map((t) => motion.at(t));
    const integral = motion.body!.integralOf(first);
    assert.ok(Math.abs(motion.body!.integralOf(later) - integral) < 1e-11 * (1 + Math.abs(integral)), name);
    const inSpace = ({ frame }: typeof later) => {
      const v = motion.body!.axisOf(frame);
      return [0, 1, 2].map((j) => [0, 1, 2].reduce((sum, i) => sum + v[i] * frame[3 * i + j], 0));
    };
    assert.ok(largest(inSpace(first).map((x, i) => x - inSpace(later)[i])) < 1e-12, name);
    if (document.axes || motion.genus < 2) continue;
    // The equation of spheroconic coordinates, with I = 1/A' along the axes of the body.
    const v = motion.body!.axisOf(later.frame);
    const I = document.A.map((A) => 1 / Number(A));
    for (const value of later.lambda) {
      const others = I.map((_, i) => I.reduce((all, x, j) => (j === i ? all : all * (value - x)), 1));
      const sum = others.reduce((total, product, i) => total + v[i] ** 2 * product, 0);
      assert.ok(Math.abs(sum) < 1e-12, `${name}: λ = ${value}`);
    }
  }
});

test("a document of another version is refused in a sentence", () => {
  assert.throws(
    () => requireDocument({ format: "veselova.closed-form/4" }),
    /format veselova.closed-form\/1 or .* or veselova.closed-form\/3; given veselova.closed-form\/4/,
  );
  assert.throws(
    () => requireDocument({ format: "veselova.closed-form/3" }),
    /has the field shell with veselova.closed-form\/3 alone/,
  );
  assert.throws(
    () => requireDocument({ format: "veselova.closed-form/2" }),
    /has the field area with veselova.closed-form\/2 alone; veselova.closed-form\/2 has none/,
  );
});

test("geodetic and ellipsoidal coordinates lead back to the point", () => {
  for (const semiaxes of [[3, 2, 1], [1, 3, 2], [2, 2, 1], [3, 1, 1], [1, 1, 1]] as [number, number, number][]) {
    for (const place of [[10, 20], [-35, 160], [0, 0], [0, 90], [89, -100], [-90, 0]] as [number, number][]) {
      const X = toPoint(place, semiaxes);
      const size = X.reduce((sum, x, i) => sum + (x / semiaxes[i]) ** 2, 0);
      assert.ok(Math.abs(size - 1) < 1e-14);
      for (const again of [
        toPoint(toGeodetic(X, semiaxes), semiaxes),
        fromEllipsoidal(toEllipsoidal(X, semiaxes), semiaxes),
      ]) {
        assert.ok(largest(X.map((x, i) => x - again[i])) < 1e-7, `${semiaxes} ${place} ${X} ${again}`);
      }
    }
  }
});
