/** The invariant torus: phases z on T² as a ring, on T³ as a cube, on T¹ as a circle. */
import { BoxGeometry, EdgesGeometry, LineBasicMaterial, LineSegments, type Object3D, TorusGeometry } from "three";
import { convergents, partialQuotients } from "../evaluator/continued_fraction.ts";
import { ball, curve, line, onCircle, type Point, surface } from "./shapes.ts";
import { type Label, type Scenery, View3D } from "./stage.ts";
import { GREEN, ORANGE, PINK, theme, VERMILION } from "./theme.ts";
import { TrailLine } from "./trail_line.ts";
import { list, type Loaded, short, type Torus, WITHOUT_TORUS } from "./view.ts";

/** Dots of the section z_1 = 0. */
const SECTION = 40;

/** How phases are drawn. */
interface Shape {
  objects: Object3D[];
  /** Return the point of the phases at a place of a column. */
  place: (z: ArrayLike<number>, from: number) => Point;
  look: { opacity?: number; points?: number };
  labels: Label[];
  lead: string;
  details: string;
}

export class TorusView extends View3D {
  constructor() {
    super("torus", "Torus", [2.75, -3.3, 2.5]);
  }

  override refusal({ motion, torus, cause }: Loaded): string | null {
    if (!torus || !motion.genus) return cause ?? WITHOUT_TORUS;
    return motion.genus <= 3 ? null : "A torus of more than three phases is not drawn.";
  }

  build({ motion, torus }: Loaded): Scenery {
    const { genus } = motion;
    const ratio = torus!.rotation_numbers.slice(1).map(fractionText).join(" ");
    const { objects, place, look, labels, lead, details } = [circle, ring, cube][genus - 1](torus!, ratio);
    this.world.add(...objects);
    this.follow({
      trail: new TrailLine(theme().trail, look),
      place: ({ z }, row) => place(z, row * genus),
      dot: ball(VERMILION, 0.045),
    });
    this.say(lead, `${details}Large dot: this moment.`);
    return {
      labels: () => labels,
      describe: ({ z }) => `The phases z are ${list(z.map((entry) => entry - Math.floor(entry)))} cycles. ${ratio}`,
    };
  }
}

const circle = (): Shape => ({
  objects: [line(curve(128, onCircle), theme().dim)],
  place: (z, from) => onCircle(z[from]),
  look: { points: 3 },
  labels: [],
  lead: "One angle z₁ gives the attitude, which repeats after one turn of it or two.",
  details: "",
});

const ring = ({ phases: z, frequencies_tau1: f }: Torus, ratio: string): Shape => ({
  objects: [
    surface(new TorusGeometry(0.85, 0.4 * 0.985, 48, 112), theme().skin, { opacity: 0.62 }),
    line(curve(96, (x) => onRing(x, 0, 1.012)), GREEN),
    line(curve(96, (x) => onRing(0, x, 1.12)), PINK),
    ...Array.from({ length: SECTION }, (_, k) =>
      ball(ORANGE, 0.013, onRing(0, z[1] + ((k - z[0]) * f[1]) / f[0], 1.02)),
    ),
  ],
  place: (now, from) => onRing(now[from], now[from + 1], 1.004),
  look: { opacity: 0.7 },
  labels: [
    { text: "z₁", at: onRing(0.87, 0, 1.16) },
    { text: "z₂", at: onRing(0, 0.2, 1.2) },
  ],
  lead: "Two angles give the attitude: z₁ runs around the ring, z₂ through it, at a fixed ratio of speeds.",
  details: `Green: z₁. Pink: z₂. ${ratio} Orange dots: z₂ whenever z₁ is whole. `,
});

function cube(): Shape {
  const corner: Point = [-0.75, -0.75, -0.75];
  const along = (axis: number, end: number) => corner.with(axis, end) as Point;
  const inCube = (x: number) => 1.5 * (x - Math.floor(x)) - 0.75;
  const box = new EdgesGeometry(new BoxGeometry(1.5, 1.5, 1.5));
  const sides = [GREEN, PINK, ORANGE].map((colour, axis) => line([corner, along(axis, 0.75)], colour));
  return {
    objects: [new LineSegments(box, new LineBasicMaterial({ color: theme().dim })), ...sides],
    place: (z, from) => [inCube(z[from]), inCube(z[from + 1]), inCube(z[from + 2])],
    look: { opacity: 0.8, points: 2.4 },
    labels: ["z₁", "z₂", "z₃"].map((text, axis) => ({ text, at: along(axis, 0.87) })),
    lead: "Three angles give the attitude; each runs from side to side of a cube, at fixed ratios of speed.",
    details: "Green: z₁. Pink: z₂. Orange: z₃. ",
  };
}

function onRing(a: number, b: number, lift: number): Point {
  const [[x, y], [across, up]] = [onCircle(a), onCircle(b)];
  const out = 0.85 + 0.4 * lift * across;
  return [out * x, out * y, 0.4 * lift * up];
}

/** Return a rotation number with its continued fraction and the best fraction of two digits. */
export function fractionText(ratio: number): string {
  const [whole, ...rest] = partialQuotients(ratio);
  const near = convergents(ratio).filter(({ denominator }) => denominator < 100).at(-1);
  const expansion = rest.length ? `[${whole}; ${rest.join(", ")}]` : `[${whole}]`;
  const exact = near && near.error < 1e-12;
  const fraction = near ? ` ${exact ? "=" : "≈"} ${near.numerator}/${near.denominator}` : "";
  return `Rotation number ${short(ratio, 7)} = ${expansion}${fraction}.`;
}
