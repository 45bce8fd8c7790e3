"""How long does one motion take, against heyoka?

    python benchmarks/motions.py      needs the extra `fast`; three minutes of processor time

Random problems, A within a factor of 5, unit speed, random frame, uniform times; each problem is
new to everybody. heyoka is called as its users call it (`benchmarks/heyoka_peer.py`), its field
compiled before. Each figure is the median of seven rounds in turn, and so is each ratio; processor
time of one core. A ratio above one means that heyoka takes longer.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from heyoka_peer import HeyokaPeer

import veselova as vs

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from draws import random_problem

RUNS, PROBLEMS = 7, 6
#: n, the last time, the number of times.
ROWS = [
    (2, 10.0, 50),
    (3, 10.0, 50),
    (3, 100.0, 100),
    (3, 1000.0, 1000),
    (3, 1000.0, 10_000),
    (3, 1000.0, 1_000_000),
    (3, 1e6, 1),
    (4, 10.0, 50),
    (4, 100.0, 100),
    (4, 1000.0, 1000),
    (4, 1000.0, 10_000),
    (4, 1000.0, 1_000_000),
    (4, 1e6, 1),
    (5, 10.0, 50),
    (6, 10.0, 50),
]
#: heyoka is asked up to here.
FARTHEST = 1000.0

Solver = Callable[[vs.Veselova, np.ndarray], object]


def by_heyoka(problem: vs.Veselova, times: np.ndarray) -> object:
    return HeyokaPeer(problem)(times)


def milliseconds(solver: Solver, n: int, times: np.ndarray, rng: np.random.Generator) -> float:
    """Return the median over some new problems."""
    spent = []
    for _ in range(PROBLEMS):
        problem = random_problem(rng, n, 5.0)
        began = time.process_time()
        solver(problem, times)
        spent.append(1000 * (time.process_time() - began))
    return median(spent)


def main() -> None:
    """Print the table."""
    rng = np.random.default_rng(0)
    solvers: list[Solver] = [vs.solve, by_heyoka]
    print("| n | times | closed form | heyoka | ratio |\n|---|---|---|---|---|")
    for n, last, count in ROWS:
        times = np.linspace(last / count, last, count)
        for solver in solvers:  # what a process loads and compiles once
            solver(random_problem(rng, n, 5.0), times[:2] / last)
        asked = solvers[: 2 if last <= FARTHEST else 1]
        rounds = [[milliseconds(solver, n, times, rng) for solver in asked] for _ in range(RUNS)]
        cells = [f"{median(row[0] for row in rounds):.3g} ms"]
        for k in range(1, len(asked)):
            cells.append(f"{median(row[k] for row in rounds):.3g} ms")
            cells.append(f"{median(row[k] / row[0] for row in rounds):.2g}")
        print(f"| {n} | {count} in [0, {last:g}] | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
