"""Processor time from a problem to its first attitude, to its torus, and to one more attitude at t
= 10⁶ once that is set up.

    python benchmarks/setup.py [problems per n]

Random problems, A within a factor of 5, unit speed; "first" is ``solve`` at one time of order one
with nothing kept from before. Each figure is the median over the problems of the least of five
runs; a run at t = 10⁶ is fifty calls, each at another time.

What is measured is mostly the interpreter: one built with profile-guided optimisation, as those of
Debian and of the container are, takes a tenth less than one built without.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

from draws import random_problem
from veselova import Veselova, solve, torus

RUNS = 5

#: Calls of one run at t = 10⁶.
CALLS = 50


def least(action: Callable[[], object]) -> float:
    """Return the least processor time of some runs, in milliseconds."""
    seconds = []
    for _ in range(RUNS):
        began = time.process_time()
        action()
        seconds.append(time.process_time() - began)
    return 1e3 * min(seconds)


def figures(problem: Veselova) -> tuple[float, float, float]:
    """Return the three times of one problem; the last is infinite beyond n = 5."""
    fresh = [Veselova(problem.A, problem.q, problem.q_dot) for _ in range(2 * RUNS)]
    first = least(lambda: solve(fresh.pop(), [1.0]))
    summary = least(lambda: torus(fresh.pop()))
    if problem.n > 5:
        return first, summary, np.inf
    trajectory = solve(problem, [1e6])

    def at_other_times() -> None:
        for k in range(CALLS):
            trajectory.at([1e6 - k])

    return first, summary, least(at_other_times) / CALLS


def main(count: int) -> None:
    print("| n | first attitude | torus | attitude at t = 10⁶, set up |\n|---|---|---|---|")
    for n in range(2, 7):
        rng = np.random.default_rng(n)
        first, summary, later = np.median(
            [figures(random_problem(rng, n, 5.0)) for _ in range(count)], axis=0
        )
        print(
            f"| {n} | {first:.1f} ms | {summary:.1f} ms | "
            f"{f'{later:.2f} ms' if later < np.inf else ''} |",
            flush=True,
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
