"""Fit the costs that evaluation plans weigh: the tunings of ``veselova.tunings``.

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
from functools import partial
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

from draws import random_problem
from veselova import tunings
from veselova.analytic.motion.torus_solution import Solution
from veselova.analytic.motion.torus_solution_balls import SolutionInBalls
from veselova.analytic.time_map.fourier import FourierTimeMap
from veselova.analytic.time_map.panels import ChebyshevTimeMap

#: Points evaluated at once in doubles, and in balls; cycles on panels; and digits in balls.
_POINTS = 3000
_CYCLES = 40
_FEW = 10
_DIGITS = 60


def seconds(work: Callable[[], object]) -> float:
    """Return the processor seconds of the second call: the first makes what is kept."""
    work()
    began = time.process_time()
    work()
    return time.process_time() - began


def in_doubles(solution: Solution) -> dict[str, float]:
    """Return the seconds of the parts of one motion in doubles."""
    times = np.sort(np.random.default_rng(1).uniform(0, 5 / solution.fastest, _POINTS))
    began = time.process_time()
    flows = solution.in_tau1, solution.in_time, solution.mean_rate
    fourier = FourierTimeMap(solution.rate, *flows)
    modes = max(fourier.size, 1)
    made = time.process_time() - began

    def on_panels(in_angles: bool) -> ChebyshevTimeMap:
        rate = partial(solution.rate_at, in_angles=in_angles)
        end = _CYCLES / solution.fastest
        panels = ChebyshevTimeMap(rate, solution.mean_rate, solution.in_tau1, 0.0, end)
        assert panels.size
        return panels

    panels = on_panels(False)
    return {
        "PANEL_CYCLE": seconds(lambda: on_panels(False)) / _CYCLES,
        "PANEL_CYCLE_IN_ANGLES": seconds(lambda: on_panels(True)) / _CYCLES,
        "MODE": made / modes,
        "MODE_INVERTED": seconds(lambda: fourier.tau1(times)) / (_POINTS * modes),
        "PANEL_INVERSION": seconds(lambda: panels.tau1(times)) / _POINTS,
    }


def in_balls(solution: Solution) -> dict[str, float]:
    """Return the seconds of dt/dτ₁ and of a state by theta functions in balls of 60 digits."""
    found = SolutionInBalls(solution, _DIGITS, False, "theta", 1.0)
    quotients = found.quotients
    assert quotients is not None
    with found.arithmetic as xp:
        z = xp.array(np.random.default_rng(1).uniform(0, 1, (_FEW, solution.curve.genus)))
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
        rows = []
        for seed in range(repeats):
            solution = Solution(random_problem(np.random.default_rng(seed), genus + 1, 5.0))
            rows.append({**in_doubles(solution), **in_balls(solution)})
        for name in rows[0]:
            value = statistics.median(row[name] for row in rows)
            found.setdefault(name, {})[genus] = value
    show_fit("PANEL_CYCLE", tunings.PANEL_CYCLE, found["PANEL_CYCLE"])
    in_angles = list(found["PANEL_CYCLE_IN_ANGLES"].items())[1:]
    per_genus = statistics.median(x / genus for genus, x in in_angles)
    show("PANEL_CYCLE_IN_ANGLES", tunings.PANEL_CYCLE_IN_ANGLES, per_genus)
    for name in ("MODE", "MODE_INVERTED", "PANEL_INVERSION"):
        # Where modes are few, what a time map begins with counts for more than they do.
        show(name, getattr(tunings, name), statistics.median(list(found[name].values())[1:]))
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
