"""Does a tuning still choose the faster way? Its work with half of it, with itself, with twice it.

    python benchmarks/tunings.py [NAME ...]      default: all that have a row in WORK

A process sets the tuning before anything reads it, does its work once, then RUNS times anew, and
prints the median of the processor's milliseconds. Small numbers take their neighbours in place of
half and double. Columns within a tenth of each other mean that the choice hardly matters there.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

from veselova import tunings

RUNS = 7


def motion(n: int, times: int, end: float, **options: Any) -> Callable[[], object]:
    """Return the work of solving a new random body at so many times."""

    def work() -> object:
        from draws import random_problem
        from veselova.analytic.solve import solve

        problem = random_problem(np.random.default_rng(n), n, 5.0)
        grid = np.linspace(0.0, end, times) if times > 1 else end
        return solve(problem, grid, **options)

    return work


#: Tuning → work that it decides about.
WORK: dict[str, Callable[[], object]] = {
    "THETA_GENUS": motion(4, 1, 1.0, digits=40),
    "BALL_MODE": motion(3, 1, 40.0, digits=40),
    "BALL_MODE_TERMS": motion(3, 1, 40.0, digits=100),
}


def others(value: Any) -> tuple[Any, Any]:
    """Return what stands below and above a tuning."""
    if isinstance(value, int):
        return (value - 1, value + 1) if value < 10 else (value // 2, 2 * value)
    return value / 2, 2 * value


def milliseconds(name: str, value: Any) -> float:
    """Return the median of the work in this process, with the tuning as told."""
    setattr(tunings, name, value)
    work = WORK[name]
    work()
    spent = []
    for _ in range(RUNS):
        began = time.process_time()
        work()
        spent.append(1000 * (time.process_time() - began))
    return statistics.median(spent)


def main() -> None:
    if len(sys.argv) == 4 and sys.argv[1] == "--one":
        print(milliseconds(sys.argv[2], eval(sys.argv[3])))
        return
    print(f"{'tuning':26} {'value':>12}   below    as is    above   (ms)")
    for name in sys.argv[1:] or WORK:
        value = getattr(tunings, name)
        below, above = others(value)
        row = []
        for taken in (below, value, above):
            command = [sys.executable, __file__, "--one", name, repr(taken)]
            done = subprocess.run(command, capture_output=True, text=True, check=True)
            row.append(float(done.stdout))
        print(f"{name:26} {value:>12g} " + " ".join(f"{x:8.2f}" for x in row), flush=True)


if __name__ == "__main__":
    main()
