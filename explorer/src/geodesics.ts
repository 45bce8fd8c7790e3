/** The page of geodesics: an ellipsoid, two points, and what the service says of them. */
import "./style.css";
import { type Degrees, fromEllipsoidal, toEllipsoidal, toPoint } from "./evaluator/geodetic.ts";
import { entryRow } from "./page/entry.ts";
import { apiKey, post, Refusal } from "./page/service.ts";
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

/** The entries: which coordinate of which point, and what is written before them. */
const ENTRIES = [
  ["P", 0, "φ", "latitude", 90],
  ["P", 1, "λ", "longitude", 180],
  ["Q", 0, "φ", "latitude", 90],
  ["Q", 1, "λ", "longitude", 180],
] as const;

const find = <T extends HTMLElement>(id: string): T => document.getElementById(id) as T;
const chooser = find<HTMLSelectElement>("ellipsoid");
const semiaxes = find<HTMLInputElement>("semiaxes");
const facts = find<HTMLTableElement>("facts");
const [message, status, keyForm] = ["message", "status", "key"].map((id) => find(id));

const points: Record<"P" | "Q", Degrees> = { P: [10, 20], Q: [-35, 160] };
let ellipsoid: string | string[] = "Haumea";
let drawn: Drawn | null = null;
let [busy, wanted, addressTimer] = [false, false, 0];

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

/** Ask for what is wanted; one request at a time, the newest last. */
async function load(): Promise<void> {
  if (busy) return;
  busy = true;
  while (wanted) {
    wanted = false;
    const now = { P: points.P, Q: points.Q };
    try {
      const line = await ask<Line>(now);
      drawn = await linesOf(line, now);
      view.render(drawn);
      show(line, now);
    } catch (error) {
      const locked = error instanceof Refusal && error.status === 401;
      keyForm.hidden = !locked;
      message.textContent = locked ? "" : (error as Error).message;
      document.documentElement.dataset.refused = "";
    }
  }
  busy = false;
}

function show(line: Line, { P, Q }: typeof points): void {
  delete document.documentElement.dataset.refused;
  keyForm.hidden = true;
  message.textContent = "";
  const rows = [
    ["s12", plain(line.s12), "length of the shortest way"],
    ["azi1", `${plain(line.azi1)}°`, "azimuth at P, from growing β to growing ω"],
    ["azi2", `${plain(line.azi2)}°`, "azimuth at Q of the way ahead"],
    ["m12", line.m12 === null ? "none" : plain(line.m12), "reduced length"],
    ["error", short(line.error, 2), "bound of the error of s12"],
    ["unique", line.unique ? "yes" : "no", "whether no other way is as short"],
  ];
  facts.replaceChildren(
    ...rows.map(([name, value, title]) => {
      const row = element("tr", { title });
      row.append(element("th", { scope: "row" }, name), element("td", {}, value));
      return row;
    }),
  );
  semiaxes.value = line.ellipsoid.join(", ");
  const other = line.unique ? "" : " Another way is as short.";
  view.twin.textContent = `From P (${P.join("°, ")}°) to Q (${Q.join("°, ")}°) the shortest way has length ${plain(line.s12)}.${other}`;
  status.textContent = "Units are those of the semiaxes, metres for the named bodies.";
}

/** Show the points at once, ask for their line, and write the address when they rest. */
function change(): void {
  for (const [name, i] of ENTRIES) {
    const text = find<HTMLInputElement>(`text-${name}-${i}`);
    if (document.activeElement !== text) text.value = String(points[name][i]);
    find<HTMLInputElement>(`slider-${name}-${i}`).value = String(points[name][i]);
  }
  chooser.value = typeof ellipsoid === "string" ? ellipsoid : "";
  // With the lines before, until the answer comes.
  if (drawn) view.render({ ...drawn, ...points });
  wanted = true;
  void load();
  clearTimeout(addressTimer);
  addressTimer = window.setTimeout(() => history.replaceState(null, "", fragment()), 300);
}

function fragment(): string {
  const { P, Q } = points;
  return `#${new URLSearchParams({ ellipsoid: String(ellipsoid), P: String(P), Q: String(Q) })}`;
}

/** Take the state of the address; what it lacks, or says wrongly, is as at first. */
function adopt(): void {
  const fields = { ...LINK, ...Object.fromEntries(new URLSearchParams(location.hash.slice(1))) };
  ellipsoid = NAMES.includes(fields.ellipsoid) ? fields.ellipsoid : fields.ellipsoid.split(/[\s,]+/);
  for (const name of ["P", "Q"] as const) {
    const [latitude, longitude] = fields[name].split(",").map(Number);
    const good = Math.abs(latitude) <= 90 && Number.isFinite(longitude);
    points[name] = good ? [latitude, longitude] : (LINK[name].split(",").map(Number) as Degrees);
  }
  change();
}

function entry([name, i, letter, title, most]: (typeof ENTRIES)[number]): HTMLElement {
  const text = `${title} of ${name} in degrees`;
  const ends = { min: String(-most), max: String(most) };
  return entryRow({ id: `${name}-${i}`, letter, slider: `${text}, slider`, text, step: "0.1", ends }, (input) => {
    const value = Number(input.value);
    const good = input.value.trim() !== "" && Math.abs(value) <= (i ? 1e6 : most);
    input.toggleAttribute("aria-invalid", !good);
    message.textContent = good ? "" : `${title} of ${name}: required −${most} to ${most}.`;
    if (!good) return;
    points[name] = points[name].with(i, value) as Degrees;
    change();
  });
}

function setTheme(light: boolean): void {
  document.documentElement.dataset.theme = light ? "light" : "dark";
  find("theme").textContent = light ? "Dark" : "Light";
  if (drawn) view.render(drawn);
}

for (const name of NAMES) chooser.append(element("option", { value: name }, name));
chooser.append(element("option", { value: "" }, "three semiaxes"));
for (const name of ["P", "Q"]) {
  const set = element("fieldset");
  set.append(element("legend", {}, name), ...ENTRIES.filter((one) => one[0] === name).map(entry));
  find("fields").append(set);
}
find("views").append(view.card);
view.card.classList.add("large");
setTheme(matchMedia("(prefers-color-scheme: light)").matches);
chooser.addEventListener("change", () => {
  ellipsoid = chooser.value || semiaxes.value.split(/[\s,]+/);
  change();
});
semiaxes.addEventListener("change", () => {
  ellipsoid = semiaxes.value.trim().split(/[\s,]+/);
  change();
});
keyForm.addEventListener("submit", (event) => {
  event.preventDefault();
  apiKey.set(find<HTMLInputElement>("key-text").value);
  change();
});
find("theme").addEventListener("click", () => {
  setTheme(document.documentElement.dataset.theme !== "light");
});
find("link").addEventListener("click", () => {
  history.replaceState(null, "", fragment());
  void navigator.clipboard.writeText(location.href).catch(() => undefined);
});
window.addEventListener("hashchange", adopt);
adopt();

(function picture(): void {
  requestAnimationFrame(picture);
  if (!view.stale) return;
  view.stale = false;
  view.draw();
})();
