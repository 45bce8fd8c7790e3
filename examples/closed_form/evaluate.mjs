// Evaluate a closed-form document in JavaScript: node evaluate.mjs [document.json values.json]
// The plain theta series; documents beside a separatrix (field "reduction") need the sum of evaluate.py.
import { readFileSync } from "node:fs";

const { PI, sin, cos, exp, abs, sqrt, ceil } = Math;
const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
const times = (A, x) => A.map((row) => dot(row, x));

function thetaTerms(document) { // for each characteristic: [weight, 2π(m+ε)] of every term that counts
  const T = document.riemann_matrix, g = document.genus, least = leastEigenvalue(T);
  return document.characteristics.map(([epsilon]) => {
    const norm = dot(epsilon, times(T, epsilon)), R = ceil(sqrt((39 / PI + norm) / least));
    let points = [[]];
    for (let i = 0; i < g; i++)
      points = points.flatMap((p) => Array.from({ length: 2 * R + 1 }, (_, k) => [...p, k - R + epsilon[i]]));
    return points.map((x) => [exp(-PI * dot(x, times(T, x))), x.map((v) => 2 * PI * v)]).filter(([w]) => w > 1e-17 * exp(-PI * norm));
  });
}

function leastEigenvalue(T) { // by power iteration on trace·1 − T
  const trace = T.reduce((sum, row, i) => sum + row[i], 0);
  let x = T.map((_, i) => 1 + i / 7), size = 1;
  for (let k = 0; k < 500; k++) {
    x = times(T, x).map((y, i) => trace * x[i] - y);
    size = sqrt(dot(x, x));
    x = x.map((y) => y / (size || 1)); // all zero where T is a number
  }
  return trace - size;
}

function frame(document, terms, t) { // rows of [e_1 … e_n]
  const { frequencies: f, phases: z0, mean_rate: mean, area } = document, odd = area?.odd ?? { modes: [], coefficients: [], turn: 0 };
  const modes = [...document.modes, ...odd.modes.map((m) => m.map((x) => x / 2))], F = [...document.coefficients, ...odd.coefficients];
  const pace = modes.map((m) => PI * dot(m, f)), turn = modes.map((m, j) => 2 * PI * (dot(m, z0) + (j < document.modes.length ? 0 : odd.turn)));
  let tau = t / mean;
  for (let k = 0, step = 1; k < 100 && abs(step) > 1e-15 * (1 + abs(tau)); k++) { // Newton's method for t(tau) = t
    let time = mean * tau, slope = mean;
    pace.forEach((p, j) => {
      const h = p * tau;
      time += 2 * F[j] * cos(turn[j] + h) * (h === 0 ? tau : sin(h) / p);
      slope += 2 * F[j] * cos(turn[j] + 2 * h);
    });
    step = (time - t) / slope;
    tau -= step;
  }
  const z = z0.map((start, s) => start + f[s] * tau);
  const theta = terms.map((list, j) => {
    const y = z.map((x, s) => x + document.characteristics[j][1][s]);
    return list.reduce((sum, [weight, x]) => sum + weight * cos(dot(x, y)), 0);
  });
  const entries = (pairs) => pairs.map(([place, constant]) => (constant * theta[place]) / theta[0]);
  const q = entries(document.q), normals = [...document.normals, document.gamma].map(entries);
  const rows = document.directions.map((D, i) => [dot(D, q), ...document.frozen[i].map((rest, j) =>
    rest + normals.reduce((sum, n, k) => sum + dot(D, n) * document.rotation[k][j], 0))]);
  return area ? rows.map((row) => row.map((_, j) => row.reduce((sum, x, k) => sum + x * area.attitude[k][j], 0))) : rows;
}

const [document, stored] = (process.argv.length > 3 ? process.argv.slice(2) : ["body3.json", "body3.values.json"])
  .map((file) => JSON.parse(readFileSync(file, "utf8")));
if (document.shell) throw new Error("a shell: its frame is another sum, in section Shells of docs/closed-form.md");
const terms = thetaTerms(document);
const errors = stored.times.flatMap((t, i) => frame(document, terms, t).flatMap((row, a) => row.map((x, b) => abs(x - stored.frame[i][a][b]))));
console.log(`largest deviation ${Math.max(...errors).toExponential(1)}`);
