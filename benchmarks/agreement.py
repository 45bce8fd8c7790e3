"""Do the engines agree on random problems? n = 2…8, A log-uniform up to a ratio of 100, |t| ≤ 50,
closed form against heyoka.

    python benchmarks/agreement.py [problems per n]      default 200; needs the extra `fast`

Prints per n: the largest difference of q and frame, the largest difference over the sum of the two
errors, the narrowest gap or cut drawn (relative to the largest branch point), seconds per problem
of each engine, and every failure.
Nothing is dropped: a draw that an engine refuses is listed.
"""

from __future__ import annotations

import os
import sys
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

import veselova as vs


def random_problem(rng: np.random.Generator, n: int) -> vs.Veselova:
    A = np.exp(rng.uniform(0, np.log(100), n))
    q, q_dot = rng.normal(size=n), rng.normal(size=n)
    q /= np.linalg.norm(q)
    q_dot -= (q_dot @ q) * q
    frame = np.linalg.qr(np.column_stack([q, rng.normal(size=(n, n - 1))]))[0]
    frame[:, 0] = q
    return vs.Veselova(A, q, q_dot / np.linalg.norm(q_dot), frame, normalize=True)


def main(count: int) -> None:
    print(
        "n   problems  failures   largest difference   over errors      narrowest interval   "
        "s analytic   s heyoka"
    )
    for n in range(2, 9):
        rng = np.random.default_rng(n)
        worst = ratio = 0.0
        narrowest, seconds, failures = 1.0, [0.0, 0.0], []
        for index in range(count):
            problem = random_problem(rng, n)
            times = np.sort(rng.uniform(-50, 50, 20))
            try:
                began = time.perf_counter()
                analytic = vs.solve(problem, times)
                between = time.perf_counter()
                numeric = vs.solve(problem, times, "numeric", "taylor")
                seconds[0] += between - began
                seconds[1] += time.perf_counter() - between
            except vs.VeselovaError as error:
                failures.append(f"    n = {n}, problem {index}: {error}")
                continue
            difference = np.max(np.abs(analytic.frame - numeric.frame), axis=(1, 2))
            worst = max(worst, float(np.max(difference)))
            ratio = max(ratio, float(np.max(difference / (analytic.error + numeric.error))))
            points = vs.torus(problem).branch_points
            narrowest = min(narrowest, float(np.min(np.diff(points)) / points[-1]))
        print(
            f"{n}   {count:8d}  {len(failures):8d}   {worst:18.1e}   {ratio:14.2f}   "
            f"{narrowest:18.1e}"
            f"   {seconds[0] / count:10.4f}   {seconds[1] / count:8.4f}",
            flush=True,
        )
        print(*failures, sep="\n", end="\n" if failures else "")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
