"""Are the estimates that refuse work beyond 15 digits honest?

    python benchmarks/costs_in_balls.py [SECONDS]

Random bodies (A from 1 to 100, unit speed) at one time, so many radians of turning away, or at many
times up to there: seconds of the processor, as estimated and as measured. What is estimated at more
than SECONDS (60) is not begun.
"""

from __future__ import annotations

import math
import os
import sys
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

import veselova as vs
from veselova.analytic.time_map import cost_model_balls
from veselova.analytic.time_map.cost_model_balls import CostsInBalls

#: Seconds that a call may take on a machine that is busy with other work.
_BUDGET_S = 3600.0

#: n, digits, turning, number of times, whether certified.
ROWS = [
    (2, 1000, 1, 1, False),
    (2, 200, 1000, 1, False),
    (3, 100, 1000, 1, False),
    (3, 1000, 1, 1, False),
    (4, 40, 10, 1, False),
    (4, 40, 8461, 1, False),
    (4, 300, 1, 1, False),
    (5, 20, 1000, 1, False),
    (6, 60, 3, 1, False),
    (8, 200, 1, 1, False),
    (3, 40, 30, 1, True),
    (6, 30, 1, 1, True),
    (3, 30, 10, 100_000, False),
    (4, 60, 5, 20_000, False),
]


def random_problem(n: int) -> vs.Veselova:
    """Return a problem with A log-uniform up to 100, a uniform start and unit speed."""
    rng = np.random.default_rng(n)
    A = np.exp(rng.uniform(0, np.log(100), n))
    q, q_dot = rng.normal(size=(2, n))
    q /= np.linalg.norm(q)
    q_dot -= (q_dot @ q) * q
    return vs.Veselova(A, q, q_dot / np.linalg.norm(q_dot), normalize=True)


def main() -> None:
    allowed = float(sys.argv[1]) if len(sys.argv) > 1 else 60.0
    estimates: list[float] = []
    is_affordable = CostsInBalls.is_affordable

    def record(costs: CostsInBalls, seconds: float) -> bool:
        if math.isfinite(seconds):
            estimates.append(seconds)
        return is_affordable(costs, seconds)

    CostsInBalls.is_affordable = record  # type: ignore[assignment,method-assign]
    cost_model_balls._SLACK = allowed / _BUDGET_S
    print("n  digits  turning    times  certified   time map   estimated   measured")
    for n, digits, turning, count, certified in ROWS:
        problem = random_problem(n)
        end = turning / problem.turning
        times = [end] if count == 1 else np.linspace(0, end, count)
        estimates.clear()
        began = time.process_time()
        row = f"{n}  {digits:6}  {turning:7}  {count:7}  {certified!s:9}"
        try:
            found = vs.solve(problem, times, digits=digits, certified=certified, budget_s=_BUDGET_S)
        except vs.VeselovaError as error:
            print(f"{row}  {'':9}  {estimates[-1]:10.3g}   {type(error).__name__}", flush=True)
            continue
        seconds = time.process_time() - began
        name = found.provenance.details["time_map"]
        print(f"{row}  {name:9}  {estimates[-1]:10.3g}   {seconds:8.3g}", flush=True)


if __name__ == "__main__":
    main()
