"""Do the errors of starts that are computed side by side stay above the true ones?

    python benchmarks/honesty_of_starts.py [starts] [seed]      default 2000, 1; takes half an hour
    of processor time, and needs the extra `fast`

Starts at which closed forms usually fail (tests/draws.py), n = 2 and 3, rounded to doubles. Times
of both signs go up to ten radians, for one start in four a hundred times as far. `solve_many` takes
them by its compiled loop. The truth has 20 digits, in balls, or 34, by integration in
binary128, whichever can be had in a few seconds. Prints per class how many starts there were, how
many have no truth, how many were computed side by side, and the largest true error over the one
reported at the same time, at most 1. The other starts go through `solve`: see adversarial.py.
"""

from __future__ import annotations

import os
import sys
from collections import defaultdict
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

import veselova as vs
from veselova.analytic.kernel.__main__ import main as compile_ahead
from veselova.tunings import FEW_STARTS

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

from verdict import time_unit, true_frame

from draws import CLASSES, adversarial_start

#: Times in radians or cycles, and seconds for one truth.
PARTS = np.array([-10.0, -3.0, 0.0, 0.1, 1.0, 4.0, 10.0])
FAR = 100.0
PATIENCE = 2


def ratio(name: str, problem: vs.Veselova, times: np.ndarray) -> float | None:
    """Return the largest true over reported error; NaN where a start is not computed side by side,
    None where there is no truth.
    """
    found = vs.solve_many([problem] * (FEW_STARTS + 1), times)
    if not found.together[0]:
        return np.nan
    try:
        truth = true_frame(name, problem, times, PATIENCE)
    except (TimeoutError, vs.Unsolved):
        return None
    return float(np.max(np.abs(found.frame[0] - truth).max(axis=(1, 2)) / found.error[0]))


def main(count: int, seed: int) -> None:
    compile_ahead()
    seen: dict[str, list[float]] = defaultdict(list)
    without: dict[str, int] = defaultdict(int)
    for i in range(count):
        name, drawn = adversarial_start(np.random.default_rng([seed, i]), 2 + i % 2)
        try:
            problem = vs.Veselova(drawn.A, drawn.q, drawn.q_dot, normalize=True)
            times = PARTS * time_unit(problem) * (FAR if i % 4 == 0 else 1.0)
        except (vs.InvalidInput, vs.Unsolved):
            seen[name].append(np.nan)
            continue
        row = ratio(name, problem, times)
        if row is None:
            without[name] += 1
        else:
            seen[name].append(row)
        if (i + 1) % 50 == 0:
            print(f"{i + 1} starts", file=sys.stderr, flush=True)
    print(f"{'class':24s} starts  without truth  side by side  largest")
    for name in CLASSES:
        column = np.array(seen[name])
        served, total = np.count_nonzero(~np.isnan(column)), column.size + without[name]
        largest = np.nanmax([*column, 0.0])
        print(f"{name:24s} {total:6d}  {without[name]:13d}  {served:12d}  {largest:7.2f}")


if __name__ == "__main__":
    main(*(int(x) for x in [*sys.argv[1:], *("2000", "1")[len(sys.argv) - 1 :]]))
