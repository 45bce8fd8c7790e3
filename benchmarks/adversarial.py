"""Starts at which closed forms usually fail, n = 2…8, against integration in binary128.

    python benchmarks/adversarial.py [starts] [seed]      default 1000, 1; needs the extra `fast`

Closed and nearly closed cuts and gaps (relative widths from 1 to 1e-290, and exactly zero), equal A's, coordinate subspaces, A's
over twelve orders of magnitude, speeds from 1e-140 to 1e140; to ten radians or twenty cycles of the fastest phase. Prints per
class how many there were and how many could not be solved, the largest true error of the frame, the largest reported one, and
the largest true error over the one reported at the same time (the stated slack is 2); then the starts that broke a promise. Wide
A's can make the integration endless; such starts are counted as "without truth".
"""

from __future__ import annotations

import sys
import warnings
from collections import defaultdict
from pathlib import Path

import numpy as np

import veselova as vs
from veselova.analytic.solution import Solution

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

from draws import CLASSES, adversarial_start
from truth import true_motion


def time_unit(problem: vs.Veselova) -> float:
    """Return the time of a radian of turning, or of two cycles of the fastest phase where that is shorter."""
    fastest = float(np.max(np.abs(Solution(problem).in_time.rates)))
    return min(1 / float(np.max(np.abs(problem.q_dot))), 2 / fastest)


def main(count: int, seed: int) -> None:
    rows: dict[str, list[tuple[float, float, float]]] = defaultdict(list)
    failures: dict[str, int] = defaultdict(int)
    unverified: dict[str, int] = defaultdict(int)
    broken = []
    for i in range(count):
        rng = np.random.default_rng([seed, i])
        n = 2 + i % 7
        name, problem = adversarial_start(rng, n)
        try:
            with warnings.catch_warnings(action="error"):
                times = np.array([-10, -3, 0, 0.1, 1, 4, 10]) * time_unit(problem)
                found = vs.solve(problem, times)
        except Exception as error:
            failures[name] += 1
            broken.append((i, name, n, f"{type(error).__name__}: {error}"[:150]))
            continue
        try:
            with np.errstate(all="ignore"):
                frame = true_motion(problem, times)[0]
        except TimeoutError:
            unverified[name] += 1
            continue
        error = np.max(np.abs(found.frame - frame), axis=(1, 2))
        ratio = float(np.max(error / found.error))
        rows[name].append((float(np.max(error)), float(np.max(found.error)), ratio))
        if ratio > 2:
            broken.append((i, name, n, f"error/reported {ratio:.3g}, error {np.max(error):.3g}"))
    print(
        "class                    starts   failures   without truth   largest error   largest reported   largest error/reported"
    )
    for name in CLASSES:
        errors, reported, ratios = np.array(rows[name]).reshape(-1, 3).T if rows[name] else np.zeros((3, 1))
        total = len(rows[name]) + failures[name] + unverified[name]
        figures = f"{np.max(errors):13.1e}   {np.max(reported):16.1e}   {np.max(ratios):22.2f}"
        print(f"{name:22s}   {total:6d}   {failures[name]:8d}   {unverified[name]:13d}   {figures}")
    for item in broken:
        print(*item)


if __name__ == "__main__":
    main(*(int(x) for x in (*sys.argv[1:], *("1000", "1")[len(sys.argv) - 1 :])))
