"""How long does a start take in an ensemble, against heyoka's batches?

    python benchmarks/ensembles.py [STARTS]

One body, n = 3, random starts of energy 1/2, the full attitude with q̇ and τ₁ at one time each, or
at 20 times in [0, 10]. "FlowMap" and "solve_many" are calls with arrays, with their error bounds,
by compiled loops where numba is installed, and by NumPy alone; "solve" is one call a start. heyoka
integrates (q, p) in batches of four (AVX2) at full precision, without attitude and error bound: its
field is compiled once, before the first time is taken. Each figure is the median of seven runs in
turn, processor time of one core a start.
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
from veselova.analytic.compiled.compiler import compiled_loops

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


def by_arrays(work: Callable[[], object]) -> None:
    """Do something without compiled loops."""
    with compiled_loops(False):
        work()


def main(count: int) -> None:
    """Print the table."""
    q, v, p = starts(count)
    heyoka = Heyoka()
    began = time.process_time()
    flow = vs.FlowMap(A)
    flow.solve(q[:10], v[:10], [1.0], normalize=True)
    taken = time.process_time() - began
    with compiled_loops(True):  # compile, or load what is compiled
        flow.solve(q[:10], v[:10], [1.0], normalize=True)
    print(f"{count} starts; the tables of FlowMap take {taken:.2f} s\n")
    names = ["times", "FlowMap", "by NumPy", "solve_many", "by NumPy", "solve", "heyoka"]
    print("| " + " | ".join([*names, "FlowMap's ratio", "solve_many's", "error"]) + " |")
    print("|" + "---|" * (len(names) + 3))
    given = {"A": A, "q": q, "q_dot": v, "normalize": True}
    problems = [vs.Veselova(A, q[i], v[i], normalize=True) for i in range(SINGLE)]
    for name, times in TIMES.items():
        # long integrations of a few batches: their time is that of each
        few = max(BATCH, min(count, int(4000 / times[-1]) // BATCH * BATCH))
        of_flow = partial(flow.solve, q, v, times, normalize=True)
        of_many = partial(vs.solve_many, given, times)
        works: list[tuple[int, Callable[[], object]]] = [
            (count, of_flow),
            (count, partial(by_arrays, of_flow)),
            (count, of_many),
            (count, partial(by_arrays, of_many)),
            (SINGLE, partial(solve_each, problems, times)),
            (few, partial(heyoka, q[:few], p[:few], times)),
        ]
        runs = [[seconds(work) / number for number, work in works] for _ in range(RUNS)]
        taken_each = [1e6 * median(column) for column in zip(*runs, strict=True)]
        error = np.median(flow.solve(q, v, times, ["q"], normalize=True).error)
        cells = [name, *(f"{x:.4g} µs" for x in taken_each)]
        cells += [f"{taken_each[-1] / x:.2g}" for x in (taken_each[0], taken_each[2])]
        print("| " + " | ".join(cells) + f" | {error:.0e} |", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000)
