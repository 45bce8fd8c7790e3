"""How long does a start take in an ensemble, against heyoka's batches?

    python benchmarks/ensembles.py [STARTS]

One body, n = 3, random starts of energy 1/2, the full attitude with q̇ and τ₁ at one time each, or
at 20 times in [0, 10]. "solve_many" is a call with arrays, with its error bounds; "solve" is one
call a start. heyoka integrates (q, p) in batches of four (AVX2) at full precision, without attitude
and error bound. Both are compiled before the first time is taken. Each figure is the median of
seven runs in turn, processor time of all cores a start.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from functools import partial
from statistics import median
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

import veselova as vs
from veselova.analytic.kernel.__main__ import main as compile_ahead

A = np.linspace(1.6, 0.5, 3)
RUNS, SINGLE, BATCH = 7, 10, 4
TIMES: dict[str, Any] = {
    "1": [1.0],
    "10": [10.0],
    "100": [100.0],
    "10⁵": [1e5],
    "20 in [0, 10]": np.linspace(0.5, 10, 20),
}

Array = np.ndarray[Any, Any]


def starts(count: int) -> tuple[Array, Array, Array]:
    """Return q, q̇ and p of random starts of energy 1/2."""
    rng = np.random.default_rng(0)
    q, v = rng.normal(size=(2, count, 3))
    q /= np.linalg.norm(q, axis=1)[:, None]
    v -= np.sum(v * q, axis=1)[:, None] * q
    qq, vv, qv = (np.sum(A * x * y, axis=1) for x, y in ((q, q), (v, v), (q, v)))
    v /= np.sqrt((vv * qq - qv * qv) / A.prod())[:, None]
    qv = np.sum(A * q * v, axis=1)
    p = (qq[:, None] * A * v - qv[:, None] * A * q) / A.prod()
    return q, v, p


class Heyoka:
    """Batches of heyoka's adaptive Taylor integrator for (q, p)."""

    def __init__(self) -> None:
        import heyoka as hy

        q = hy.make_vars("q0", "q1", "q2")
        p = hy.make_vars("p0", "p1", "p2")

        def total(*factors: Any) -> Any:
            return hy.sum([np.prod(list(terms)) for terms in zip(*factors, strict=True)])

        det = A.prod()
        inverse = (1 / A).tolist()
        qAq, qq, pq = total(A.tolist(), q, q), total(q, q), total(p, q)
        pIq, pIp = total(inverse, p, q), total(inverse, p, p)
        equations = [
            (x, det / qAq * (i * y - pIq / qq * x)) for x, y, i in zip(q, p, inverse, strict=True)
        ]
        equations += [
            (y, -det * (pIp * qq - pq * pIq) / (qAq * qq * qq) * x)
            for x, y in zip(q, p, strict=True)
        ]
        self._integrator = hy.taylor_adaptive_batch(equations, np.ones((6, BATCH)))

    def __call__(self, q: Array, p: Array, times: Any) -> None:
        """Integrate all starts to the times."""
        integrator = self._integrator
        grid = np.repeat(np.append(0.0, times)[:, None], BATCH, axis=1)
        for first in range(0, len(q), BATCH):
            integrator.set_time(0.0)
            integrator.state[:3] = q[first : first + BATCH].T
            integrator.state[3:] = p[first : first + BATCH].T
            if len(times) == 1:
                integrator.propagate_until([times[0]] * BATCH)
            else:
                integrator.propagate_grid(grid)


def seconds(work: Callable[[], object]) -> float:
    """Return the processor time of a call."""
    began = time.process_time()
    work()
    return time.process_time() - began


def solve_each(problems: list[vs.Veselova], times: Any) -> None:
    """Solve one problem after the other."""
    for problem in problems:
        vs.solve(problem, times)


def main(count: int) -> None:
    """Print the table."""
    q, v, p = starts(count)
    heyoka = Heyoka()
    compile_ahead()
    print(f"{count} starts\n")
    print("| times | solve_many | solve | heyoka | ratio | error |\n" + "|---" * 6 + "|")
    given = {"A": A, "q": q, "q_dot": v, "normalize": True}
    problems = [vs.Veselova(A, q[i], v[i], normalize=True) for i in range(SINGLE)]
    for name, times in TIMES.items():
        # long integrations of a few batches: their time is that of each
        few = max(BATCH, min(count, int(4000 / times[-1]) // BATCH * BATCH))
        works: list[tuple[int, Callable[[], object]]] = [
            (count, partial(vs.solve_many, given, times)),
            (SINGLE, partial(solve_each, problems, times)),
            (few, partial(heyoka, q[:few], p[:few], times)),
        ]
        runs = [[seconds(work) / number for number, work in works] for _ in range(RUNS)]
        taken = [1e6 * median(column) for column in zip(*runs, strict=True)]
        error = np.median(vs.solve_many(given, times, ["q"]).error)
        cells = [name, *(f"{x:.4g} µs" for x in taken), f"{taken[-1] / taken[0]:.2g}"]
        print("| " + " | ".join(cells) + f" | {error:.0e} |", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000)
