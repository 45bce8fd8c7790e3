/** The page of geodesics: an ellipsoid, two points, and what the service says of them. */
import "./style.css";
import { type Degrees, fromEllipsoidal, toEllipsoidal, toPoint } from "./evaluator/geodetic.ts";
import { addressWriter, copy, find, markRefused, oneAtATime, onFragment, onKey, onTheme } from "./page/common.ts";
import { type Entry, entry } from "./page/entry.ts";
import { post } from "./page/service.ts";
import type { Point } from "./views/shapes.ts";
import { type Drawn, GeodesicView } from "./views/geodesic_view.ts";
import { element, short } from "./views/view.ts";

interface Line {
  ellipsoid: Point;
  s12: number;
  azi1: number;
  azi2: number;
  m12: number | null;
  error: number;
  unique: boolean;
}

interface Lines {
  P2: Degrees[];
  /** Null where the service has no number. */
  m12: (number | null)[];
  unique: boolean[];
}

/** Ellipsoids that the service knows by name. */
const NAMES = ["Haumea", "WGS84", "Earth", "Moon", "Mars"];

const LINK = { ellipsoid: "Haumea", P: "10,20", Q: "-35,160" };

/** Points of a line up to Q, and up to where its conjugate point is at the latest. */
const [STEPS, FURTHER] = [120, 360];

/** Points on one side of the middle of the curve that holds the cut locus; they crowd there. */
const SIDE = 120;

const chooser = find<HTMLSelectElement>("ellipsoid");
const semiaxes = find<HTMLInputElement>("semiaxes");
const message = find("message");

/** Return the name of an ellipsoid, or its semiaxes. */
const ellipsoidOf = (text: string) => (NAMES.includes(text) ? text : text.trim().split(/[\s,]+/));

const points: Record<"P" | "Q", Degrees> = { P: [10, 20], Q: [-35, 160] };
let ellipsoid: string | string[] = "Haumea";
let drawn: Drawn | null = null;

const view = new GeodesicView((name, [latitude, longitude]) => {
  points[name] = [Number(latitude.toFixed(2)), Number(longitude.toFixed(2))];
  change();
});

const plain = (x: number): string => String(Number(x.toPrecision(10))).replace("-", "−");

/** Return what the service says of a request. */
const ask = <T>(body: object): Promise<T> => post<T>("v1/geodesics", { ellipsoid, ...body });

/** Return what is drawn of a line: itself, the rest up to the conjugate point, the cut locus. */
async function linesOf(line: Line, { P, Q }: typeof points): Promise<Drawn> {
  const axes = line.ellipsoid;
  const [longest, shortest] = [Math.max(...axes), Math.min(...axes)];
  // The curvature is c²/a⁴ at least (Bonnet): no geodesic is without a conjugate point for longer.
  const last = Math.max((Math.PI * longest ** 2) / shortest, line.s12);
  const lengths = Array.from({ length: STEPS + FURTHER + 1 }, (_, k) =>
    k < STEPS ? (line.s12 * k) / STEPS : line.s12 + ((last - line.s12) * (k - STEPS)) / FURTHER,
  );
  // It is on the line of curvature opposite to P, around the antipode (Itoh and Kiyohara).
  const [beta, omega] = toEllipsoidal(toPoint(P, axes), axes);
  const opposite = Array.from({ length: 2 * SIDE + 1 }, (_, k): Degrees => {
    const part = (k - SIDE) / SIDE;
    return [-beta, omega + 180 * (1 + part ** 3)];
  });
  const [way, across] = await Promise.all([
    ask<Lines>({ P, azi1: line.azi1, s12: lengths }),
    ask<Lines>({ P: [beta, omega], Q: opposite, coordinates: "ellipsoidal" }),
  ]);
  const places = way.P2.map((place) => toPoint(place, axes));
  const end = way.m12.findIndex((m, k) => k >= STEPS && m !== null && m <= 0);
  const cut = opposite.filter((_, k) => !across.unique[k]);
  let conjugate: Point | null = null;
  if (end > 0) {
    const [before, after] = [way.m12[end - 1] ?? 0, way.m12[end] ?? 0];
    const part = before > after ? before / (before - after) : 0;
    conjugate = places[end].map((x, i) => part * x + (1 - part) * places[end - 1][i]) as Point;
  }
  return {
    semiaxes: axes,
    P,
    Q,
    way: places.slice(0, STEPS + 1),
    beyond: conjugate ? [...places.slice(STEPS, end), conjugate] : [],
    conjugate,
    cut: cut.map((place) => fromEllipsoidal(place, axes)),
  };
}

const load = oneAtATime(async () => {
  const now = { P: points.P, Q: points.Q };
  try {
    const line = await ask<Line>(now);
    drawn = await linesOf(line, now);
    markRefused(null);
    view.begin(drawn);
    show(line, now);
  } catch (error) {
    if (!markRefused(error)) message.textContent = (error as Error).message;
  }
});

function show(line: Line, { P, Q }: typeof points): void {
  message.textContent = "";
  const rows = [
    ["s12", plain(line.s12), "length of the shortest way"],
    ["azi1", `${plain(line.azi1)}°`, "azimuth at P, from growing β to growing ω"],
    ["azi2", `${plain(line.azi2)}°`, "azimuth at Q of the way ahead"],
    ["m12", line.m12 === null ? "none" : plain(line.m12), "reduced length"],
    ["error", short(line.error, 2), "bound of the error of s12"],
    ["unique", line.unique ? "yes" : "no", "whether no other way is as short"],
  ].map(([name, value, title]) =>
    element("tr", { title }, element("th", { scope: "row" }, name), element("td", {}, value)),
  );
  find("facts").replaceChildren(...rows);
  semiaxes.value = line.ellipsoid.join(", ");
  const other = line.unique ? "" : " Another way is as short.";
  view.twin.textContent = `From P (${P.join("°, ")}°) to Q (${Q.join("°, ")}°) the shortest way has length ${plain(line.s12)}.${other}`;
  find("status").textContent = "Units are those of the semiaxes, metres for the named bodies.";
}

/** Show the points at once, ask for their line, and write the address when they rest. */
function change(): void {
  for (const [name, i, most, { show }] of entries) show(points[name][i], String(points[name][i]), [-most, most]);
  chooser.value = typeof ellipsoid === "string" ? ellipsoid : "";
  // With the lines before, until the answer comes.
  if (drawn) view.begin({ ...drawn, ...points });
  void load();
  writeAddress();
}

const writeAddress = addressWriter(() => {
  const { P, Q } = points;
  return `#${new URLSearchParams({ ellipsoid: String(ellipsoid), P: String(P), Q: String(Q) })}`;
});

/** Take the state of the address; what it lacks, or says wrongly, is as at first. */
function adopt(fragment: string): void {
  const fields = { ...LINK, ...Object.fromEntries(new URLSearchParams(fragment.slice(1))) };
  ellipsoid = ellipsoidOf(fields.ellipsoid);
  for (const name of ["P", "Q"] as const) {
    const [latitude, longitude] = fields[name].split(",").map(Number);
    const good = Math.abs(latitude) <= 90 && Number.isFinite(longitude);
    points[name] = good ? [latitude, longitude] : (LINK[name].split(",").map(Number) as Degrees);
  }
  change();
}

/** Take a coordinate that was entered. */
function enter(name: "P" | "Q", i: number, most: number, title: string, text: string): void {
  const value = Number(text);
  const good = text.trim() !== "" && Math.abs(value) <= (i ? 1e6 : most);
  find(`text-${name}-${i}`).toggleAttribute("aria-invalid", !good);
  message.textContent = good ? "" : `${title} of ${name}: required −${most} to ${most}.`;
  if (!good) return;
  points[name] = points[name].with(i, value) as Degrees;
  change();
}

/** The entries: which coordinate of which point, its largest size, and what shows it. */
const entries = (["P", "Q"] as const).flatMap((name) => {
  const made = ([["φ", "latitude", 90], ["λ", "longitude", 180]] as const).map(([letter, title, most], i) => {
    const spoken = `${title} of ${name} in degrees`;
    const one = entry({ id: `${name}-${i}`, letter, spoken, step: "0.1" }, ({ value }) => {
      enter(name, i, most, title, value);
    });
    return [name, i, most, one] as [typeof name, number, number, Entry];
  });
  find("fields").append(element("fieldset", {}, element("legend", {}, name), ...made.map(([, , , { row }]) => row)));
  return made;
});

const option = (value: string, text: string) => element("option", { value }, text);
chooser.append(...NAMES.map((name) => option(name, name)), option("", "three semiaxes"));
find("views").append(view.card);
view.card.classList.add("large");
for (const input of [chooser, semiaxes]) {
  input.addEventListener("change", () => {
    ellipsoid = ellipsoidOf(input.value || semiaxes.value);
    change();
  });
}
onKey(change);
onTheme(() => drawn && view.begin(drawn));
onFragment(adopt);
find("link").addEventListener("click", () => {
  writeAddress(true);
  void copy("link", location.href);
});
adopt(location.hash);

(function picture(): void {
  requestAnimationFrame(picture);
  if (!view.stale) return;
  view.stale = false;
  view.draw();
})();
