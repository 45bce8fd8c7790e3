/* Evaluate a closed-form document in C: cc evaluate.c -lm && ./a.out [document.json values.json]
   The plain theta series; documents beside a separatrix (field "reduction") need the sum of evaluate.py. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#define PI 3.14159265358979323846
#define FOR(i, n) for (int i = 0; i < (n); i++)
static char *text(const char *name) { /* the file as a string */
  FILE *f = fopen(name, "rb"); char *s = calloc(1 << 24, 1);
  if (!f || !fread(s, 1, (1 << 24) - 1, f)) { fprintf(stderr, "cannot read %s\n", name); exit(2); }
  fclose(f); return s; }
static double *get(const char *s, const char *key, int *n) { /* the numbers of a field, nested lists one after the other */
  char mark[64], *end; int depth = 0; double *x = malloc((strlen(s) / 2 + 1) * sizeof *x);
  snprintf(mark, sizeof mark, "\"%s\":", key); const char *p = strstr(s, mark) + strlen(mark);
  for (*n = 0; *p; p++) {
    if (*p == '[') depth++; else if (*p == ']') { if (--depth == 0) break; }
    else if (strchr("-0123456789", *p)) { x[(*n)++] = strtod(p, &end); p = end - 1; if (!depth) break; }
    else if (*p == '}') break;
  } return x; }
static double theta(int g, const double *T, const double *c, const double *z) { /* c: ε, then δ */
  double e[8] = {0}, least = 1e9, norm = 0, sum = 0; int R, m[8];
  FOR(i, g) { /* the sum over the box |m_i| ≤ R, from Gershgorin's bound of the least eigenvalue of T, or the document's, 0.2 */
    double off = 0; FOR(j, g) norm += c[i] * T[i * g + j] * c[j], off += j == i ? 0 : fabs(T[i * g + j]);
    least = fmin(least, T[i * g + i] - off); }
  R = (int)ceil(sqrt((39 / PI + norm) / fmax(least, 0.2))); FOR(i, g) m[i] = -R;
  for (int i = 0; i >= 0;) {
    double form = 0, angle = 0;
    FOR(a, g) e[a] = m[a] + c[a], angle += e[a] * (z[a] + c[g + a]);
    FOR(a, g) FOR(b, g) form += e[a] * T[a * g + b] * e[b];
    sum += exp(-PI * form) * cos(2 * PI * angle);
    for (i = g - 1; i >= 0 && ++m[i] > R; i--) m[i] = -R;
  } return sum; }
int main(int argc, char **argv) {
  char *d = text(argc > 2 ? argv[1] : "body3.json"), *v = text(argc > 2 ? argv[2] : "body3.values.json"); int n, g, M, K, N, k;
  if (strstr(d, "\"shell\":")) { fputs("a shell: its frame is another sum, in section Shells of docs/closed-form.md\n", stderr); return 2; }
  double *T = get(d, "riemann_matrix", &k), *f = get(d, "frequencies", &g), *z0 = get(d, "phases", &k), *F0 = get(d, "mean_rate", &k),
    *m = get(d, "modes", &k), *F = get(d, "coefficients", &M), *c = get(d, "characteristics", &K), *q = get(d, "q", &k),
    *nk = get(d, "normals", &k), *ga = get(d, "gamma", &k), *D = get(d, "directions", &k), *R = get(d, "rotation", &k),
    *fr = (get(d, "A", &n), get(d, "frozen", &k)), *t = get(v, "times", &N), *E = get(v, "frame", &k), worst = 0;
  char *area = strstr(d, "\"area\":"); int O = 0; double *om = 0, *oF = 0, turn = 0, I[64] = {0}, *Q = I; FOR(s, n) I[s * n + s] = 1;
  if (area) /* a body with an area constant: half-integer modes and a rotation */
    om = get(area, "modes", &k), oF = get(area, "coefficients", &O), turn = *get(area, "turn", &k), Q = get(area, "attitude", &k);
  FOR(i, N) {
    double x = t[i] / *F0, step = 1, z[8], th[256], e[8][8], y[8][8];
    for (int it = 0; it < 100 && fabs(step) > 1e-15 * (1 + fabs(x)); it++, x -= step) { /* Newton's method for t(x) = t */
      double time = *F0 * x, slope = *F0;
      FOR(j, M + O) {
        double p = 0, w = j < M ? 0 : 2 * PI * turn, c = j < M ? F[j] : oF[j - M];
        FOR(s, g) { double o = j < M ? m[j * g + s] : om[(j - M) * g + s] / 2; p += PI * o * f[s], w += 2 * PI * o * z0[s]; }
        time += 2 * c * cos(w + p * x) * (p * x == 0 ? x : sin(p * x) / p); slope += 2 * c * cos(w + 2 * p * x);
      } step = (time - t[i]) / slope; }
    FOR(s, g) z[s] = z0[s] + f[s] * x;
    FOR(j, K / (2 * g)) th[j] = theta(g, T, c + 2 * g * j, z);
    FOR(a, g + 1) FOR(b, g + 1) { /* columns q, n_2 … γ along the directions that move */
      double *pair = b == 0 ? q : b == g ? ga : nk + (b - 1) * 2 * (g + 1); e[a][b] = pair[2 * a + 1] * th[(int)pair[2 * a]] / th[0]; }
    FOR(a, n) FOR(b, n) {
      y[a][b] = b ? fr[a * (n - 1) + b - 1] : 0;
      FOR(r, g + 1) FOR(s, g + 1) y[a][b] += D[a * (g + 1) + r] * e[r][s] * (b ? (s ? R[(s - 1) * (n - 1) + b - 1] : 0) : !s); }
    FOR(a, n) FOR(b, n) { x = 0; FOR(s, n) x += y[a][s] * Q[s * n + b]; worst = fmax(worst, fabs(x - E[(i * n + a) * n + b])); }
  } printf("largest deviation %.1e\n", worst); return 0;
}
