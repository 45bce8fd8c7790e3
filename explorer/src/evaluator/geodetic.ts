/** Points of an ellipsoid by geodetic latitude and longitude, and by ellipsoidal ones, in degrees. */
export type Degrees = [number, number];
type Point = [number, number, number];

const DEGREE = Math.PI / 180;

/** Return X = Aq/√(q,Aq) of the normal q, with A the squares of the semiaxes. */
export function toPoint([latitude, longitude]: Degrees, semiaxes: Point): Point {
  const [phi, lambda] = [latitude * DEGREE, longitude * DEGREE];
  const q = [Math.cos(phi) * Math.cos(lambda), Math.cos(phi) * Math.sin(lambda), Math.sin(phi)];
  const size = Math.hypot(...q.map((x, i) => x * semiaxes[i]));
  return q.map((x, i) => (x * semiaxes[i] ** 2) / size) as Point;
}

/** Return latitude and longitude of the normal at a point of any unit. */
export function toGeodetic(X: ArrayLike<number>, semiaxes: Point): Degrees {
  const [x, y, z] = semiaxes.map((a, i) => X[i] / a ** 2);
  return [Math.atan2(z, Math.hypot(x, y)) / DEGREE, Math.atan2(y, x) / DEGREE];
}

/** The axes of an ellipsoid from the longest to the shortest, and k², k'² of Jacobi's coordinates. */
function sorted(semiaxes: Point): { order: number[]; k2: number; rest: number } {
  const order = [0, 1, 2].sort((i, j) => semiaxes[j] - semiaxes[i]);
  const [a, b, c] = order.map((i) => semiaxes[i]);
  const whole = (a - c) * (a + c);
  if (whole === 0) return { order, k2: 1, rest: 0 };
  return { order, k2: ((b - c) * (b + c)) / whole, rest: ((a - b) * (a + b)) / whole };
}

/**
 * Return β and ω of a point: k² cos²β and −k'² sin²ω are the roots of t² − gt − (kk'η)² = 0 with
 * η = cos β sin ω.
 */
export function toEllipsoidal(X: Point, semiaxes: Point): Degrees {
  const { order, k2, rest } = sorted(semiaxes);
  const [xi, eta, zeta] = order.map((i) => X[i] / semiaxes[i]);
  const g = k2 * xi ** 2 + (k2 - rest) * eta ** 2 - rest * zeta ** 2;
  const h = Math.hypot(g, 2 * Math.sqrt(k2 * rest) * eta);
  let cosine = k2 ? Math.sqrt((h + g) / 2 / k2) : 0;
  let sine = rest ? (eta < 0 ? -1 : 1) * Math.sqrt((h - g) / 2 / rest) : 0;
  if (g >= 0) sine = cosine ? eta / cosine : 0;
  else cosine = sine ? eta / sine : 0;
  // At the poles of a spheroid both are 0.
  const x = Math.sqrt(k2 * cosine ** 2 + rest) || 1;
  const z = Math.sqrt(k2 + rest * sine ** 2) || 1;
  return [Math.atan2(zeta / z, cosine) / DEGREE, Math.atan2(sine, xi / x) / DEGREE];
}

/** Return X = (a cos ω √(k²cos²β+k'²), b cos β sin ω, c sin β √(k²+k'²sin²ω)), axes as they stand. */
export function fromEllipsoidal([beta, omega]: Degrees, semiaxes: Point): Point {
  const { order, k2, rest } = sorted(semiaxes);
  const [sb, cb] = [Math.sin(beta * DEGREE), Math.cos(beta * DEGREE)];
  const [so, co] = [Math.sin(omega * DEGREE), Math.cos(omega * DEGREE)];
  const U = [co * Math.sqrt(k2 * cb ** 2 + rest), cb * so, sb * Math.sqrt(k2 + rest * so ** 2)];
  const X: Point = [0, 0, 0];
  order.forEach((i, k) => (X[i] = semiaxes[i] * U[k]));
  return X;
}
