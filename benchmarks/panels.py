"""What a time map by panels costs for a cycle of the fastest phase, dt/dτ₁ by theta functions and
in angles, and how both agree.

    python benchmarks/panels.py [problems per n]

Random problems, A within a factor of 5, unit speed, 60 cycles; microseconds are the median over the
problems of the least of three runs in turn. "apart" is the largest relative difference of both
rates at 200 drawn phases, "shared" the mean difference, of which an orbit makes a drift of t; both
are roots of the mean square over the problems, in ε.
"""

from __future__ import annotations

import os
import sys
import time
from functools import partial
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

from draws import random_problem
from veselova.analytic.motion.torus_solution import Solution
from veselova.analytic.time_map.panels import ChebyshevTimeMap

RUNS, CYCLES, PHASES = 3, 60, 200


def costs(solution: Solution) -> list[float]:
    """Return the microseconds of a cycle by theta functions and in angles."""
    seconds, span = np.full((RUNS, 2), np.inf), CYCLES / solution.fastest
    rates = [partial(solution.rate_at, in_angles=in_angles) for in_angles in (False, True)]
    for rate in rates:
        rate(np.zeros((1, solution.curve.genus)))  # what is made once
    for run in range(RUNS):
        for k, rate in enumerate(rates):
            began = time.process_time()
            assert ChebyshevTimeMap(rate, solution.mean_rate, solution.in_tau1, 0.0, span).panels
            seconds[run, k] = time.process_time() - began
    return [1e6 / CYCLES * float(least) for least in seconds.min(axis=0)]


def agreement(solution: Solution, rng: np.random.Generator) -> list[float]:
    """Return by how much the rates differ at most, and on average, in ε."""
    z = rng.uniform(0, 2, (PHASES, solution.curve.genus))
    off = (
        solution.rate_at(z, in_angles=False) / solution.rate_at(z, in_angles=True) - 1
    ) / np.finfo(float).eps
    return [float(np.max(np.abs(off))), float(np.mean(off))]


def main(count: int) -> None:
    print(
        "| n | by theta functions | in angles | ratio | apart | shared |\n|---|---|---|---|---|---|"
    )
    for n in range(2, 9):
        rng = np.random.default_rng(n)
        solutions = [Solution(random_problem(rng, n, 5.0)) for _ in range(count)]
        theta, angles = np.median([costs(solution) for solution in solutions], axis=0)
        apart, shared = np.sqrt(
            np.mean(np.square([agreement(solution, rng) for solution in solutions]), axis=0)
        )
        print(
            f"| {n} | {theta:.0f} µs | {angles:.0f} µs | {angles / theta:.1f} | {apart:.1f} "
            f"ε | {shared:.1f} ε |",
            flush=True,
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
