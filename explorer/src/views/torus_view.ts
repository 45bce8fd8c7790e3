/** The invariant torus: phases z on T² as a ring, on T³ as a cube, on T¹ as a circle. */
import { BoxGeometry, EdgesGeometry, LineBasicMaterial, LineSegments, TorusGeometry } from "three";
import { convergents, partialQuotients } from "../evaluator/continued_fraction.ts";
import type { Sample } from "../evaluator/motion.ts";
import { ball, line, type Point, surface } from "./shapes.ts";
import { type Label, View3D } from "./stage.ts";
import { GREEN, ORANGE, PINK, theme, VERMILION } from "./theme.ts";
import { TrailLine } from "./trail_line.ts";
import { list, type Loaded, short, type Torus, WITHOUT_TORUS } from "./view.ts";

/** Dots of the section z_1 = 0. */
const SECTION = 40;

const NOW = "Large dot: this moment.";

export class TorusView extends View3D {
  #genus = 2;
  #ratio = "";

  constructor() {
    super("torus", "Torus", [2.75, -3.3, 2.5]);
  }

  refusal({ motion, torus, cause }: Loaded): string | null {
    if (!torus || !motion.genus) return cause ?? WITHOUT_TORUS;
    return motion.genus <= 3 ? null : "A torus of more than three phases is not drawn.";
  }

  build({ motion, torus }: Loaded): void {
    this.clear();
    const { dim, skin, trail } = theme();
    this.#genus = motion.genus;
    if (this.#genus === 3) this.#buildCube(dim);
    else if (this.#genus === 2) this.#buildRing(torus!, skin);
    else this.world.add(line(Array.from({ length: 129 }, (_, k) => this.#place([k / 128], 0)), dim));
    const looks = [{ points: 3 }, { opacity: 0.7 }, { opacity: 0.8, points: 2.4 }];
    this.follow({
      trail: new TrailLine(trail, looks[this.#genus - 1]),
      place: ({ z }, row) => this.#place(z, row * this.#genus),
      dot: ball(VERMILION, 0.045),
    });
    const ratios = torus!.rotation_numbers.slice(1);
    this.#ratio = ratios.map(fractionText).join(" ");
    const texts: [string, string][] = [
      ["One angle z₁ gives the attitude, which repeats after one turn of it or two.", NOW],
      [
        "Two angles give the attitude: z₁ runs around the ring, z₂ through it, at a fixed ratio of speeds.",
        `Green: z₁. Pink: z₂. ${this.#ratio} Orange dots: z₂ whenever z₁ is whole. ${NOW}`,
      ],
      [
        "Three angles give the attitude; each runs from side to side of a cube, at fixed ratios of speed.",
        `Green: z₁. Pink: z₂. Orange: z₃. ${NOW}`,
      ],
    ];
    this.say(...texts[this.#genus - 1]);
  }

  #buildRing(torus: Torus, skin: string): void {
    this.world.add(surface(new TorusGeometry(0.85, 0.4 * 0.985, 48, 112), skin, { opacity: 0.62 }));
    const circle = (f: (x: number) => Point) => Array.from({ length: 97 }, (_, k) => f(k / 96));
    this.world.add(
      line(circle((x) => onRing(x, 0, 1.012)), GREEN),
      line(circle((x) => onRing(0, x, 1.12)), PINK),
    );
    const [z, f] = [torus.phases, torus.frequencies_tau1];
    for (let k = 0; k < SECTION; k++) {
      this.world.add(ball(ORANGE, 0.013, onRing(0, z[1] + ((k - z[0]) * f[1]) / f[0], 1.02)));
    }
  }

  #buildCube(dim: string): void {
    const box = new EdgesGeometry(new BoxGeometry(1.5, 1.5, 1.5));
    this.world.add(new LineSegments(box, new LineBasicMaterial({ color: dim })));
    const corner: Point = [-0.75, -0.75, -0.75];
    [GREEN, PINK, ORANGE].forEach((colour, axis) => {
      this.world.add(line([corner, corner.with(axis, 0.75) as Point], colour));
    });
  }

  #place(z: ArrayLike<number>, from: number): Point {
    if (this.#genus === 2) return onRing(z[from], z[from + 1], 1.004);
    if (this.#genus === 3) {
      const inCube = (x: number) => 1.5 * (x - Math.floor(x)) - 0.75;
      return [inCube(z[from]), inCube(z[from + 1]), inCube(z[from + 2])];
    }
    const angle = 2 * Math.PI * z[from];
    return [Math.cos(angle), Math.sin(angle), 0];
  }

  protected override labels(): Label[] {
    if (this.#genus === 2) {
      return [
        { text: "z₁", at: onRing(0.87, 0, 1.16) },
        { text: "z₂", at: onRing(0, 0.2, 1.2) },
      ];
    }
    if (this.#genus < 3) return [];
    return ["z₁", "z₂", "z₃"].map((text, axis) => ({
      text,
      at: [-0.75, -0.75, -0.75].with(axis, 0.87) as Point,
    }));
  }

  describe({ z }: Sample): string {
    const phases = Array.from(z, (entry) => entry - Math.floor(entry));
    return `The phases z are ${list(phases)} cycles. ${this.#ratio}`;
  }
}

function onRing(a: number, b: number, lift: number): Point {
  const [u, v] = [2 * Math.PI * a, 2 * Math.PI * b];
  const r = 0.4 * lift;
  return [(0.85 + r * Math.cos(v)) * Math.cos(u), (0.85 + r * Math.cos(v)) * Math.sin(u), r * Math.sin(v)];
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
