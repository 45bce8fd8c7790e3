"""Fit the costs of theta functions in balls: ``BALL_THETA`` of ``veselova.tunings``.

    python benchmarks/costs.py [REPEATS]

Prints each constant, the value in the code, and the value measured on this machine: medians of
REPEATS (5) random bodies of each dimension, and least squares of logarithms where a cost grows with
the genus. ``benchmarks/costs_in_balls.py`` compares whole estimates in balls with what is
measured.
"""

from __future__ import annotations

import os
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

from draws import random_problem
from veselova import Veselova, tunings
from veselova.analytic.motion.in_doubles import InDoubles
from veselova.analytic.motion.torus_solution_balls import SolutionInBalls

#: Points evaluated at once, and digits.
_FEW = 10
_DIGITS = 60


def seconds(work: Callable[[], object]) -> float:
    """Return the processor seconds of the second call: the first makes what is kept."""
    work()
    began = time.process_time()
    work()
    return time.process_time() - began


def in_balls(problem: Veselova) -> dict[str, float]:
    """Return the seconds of dt/dτ₁ and of a state by theta functions in balls of 60 digits."""
    found = SolutionInBalls(InDoubles(problem), _DIGITS, False, "theta", 1.0)
    quotients = found.quotients
    assert quotients is not None
    with found.arithmetic as xp:
        z = xp.array(np.random.default_rng(1).uniform(0, 1, (_FEW, problem.n - 1)))
        return {
            "rate": seconds(lambda: quotients.time_rate(z)) / _FEW,
            "state": seconds(lambda: quotients.at(z)) / _FEW,
        }


def fit(by_genus: dict[int, float]) -> tuple[float, float]:
    """Return a cost at genus 1 and its growth from one genus to the next, by least squares."""
    genus = np.array(list(by_genus))
    growth, first = np.polyfit(genus - 1, np.log(list(by_genus.values())), 1)
    return float(np.exp(first)), float(np.exp(growth))


def main() -> None:
    repeats = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    found: dict[str, dict[int, float]] = {}
    for genus in range(1, 5):
        drawn = (np.random.default_rng(seed) for seed in range(repeats))
        rows = [in_balls(random_problem(rng, genus + 1, 5.0)) for rng in drawn]
        for name in rows[0]:
            value = statistics.median(row[name] for row in rows)
            found.setdefault(name, {})[genus] = value
    for name, stated in tunings.BALL_THETA.items():
        show_fit(f"BALL_THETA {name}", stated, found[name])


def show_fit(name: str, stated: tuple[float, float], by_genus: dict[int, float]) -> None:
    """Print the lines of a cost that grows with the genus."""
    for part, of_code, measured in zip(("", ", growth"), stated, fit(by_genus), strict=True):
        show(name + part, of_code, measured)


def show(name: str, stated: float, measured: float) -> None:
    """Print one line of the table."""
    print(f"{name:30}  in the code {stated:10.3g}   measured {measured:10.3g}", flush=True)


if __name__ == "__main__":
    main()
