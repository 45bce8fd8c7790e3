"""A whole orbit, full attitude at many times: closed form against heyoka, in one process.

    python benchmarks/orbit.py [times] [span]      needs the extra `fast`

Random problems, A within a factor of 5, unit speed, random frame; sorted random times in [0, span]. The least processor seconds
of five calls each, in turn, the problem new to the closed form every time, the field already compiled by heyoka. Both yield τ₁, a
velocity and the frame, in one array of n² + n + 1 numbers a time; the closed form its error besides. "heyoka" is one integration
with the state put back on the manifold every ten radians and dense output at all times, without any error estimate. The
difference is that of the frames, "reported" the closed form's error.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from veselova import Veselova, solve
from veselova.numeric.solve import _integrate
from veselova.numeric.taylor import Taylor

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from draws import random_problem

#: Calls of each, in turn.
_CALLS = 5


def row(make: Callable[[], Veselova], times: np.ndarray, label: str) -> str:
    """Return one line of the table, for a problem that is made anew for every call."""
    closed_seconds, heyoka_seconds = [], []
    for _ in range(_CALLS):
        problem = make()
        began = time.process_time()
        closed = solve(problem, times)
        closed_seconds.append(time.process_time() - began)
        flow = problem.flow()
        _integrate(flow, np.array([1.0]), Taylor(flow, Taylor.tolerances[0]))
        began = time.process_time()
        states = _integrate(flow, times / flow.time_unit, Taylor(flow, Taylor.tolerances[0]))
        heyoka_seconds.append(time.process_time() - began)
    ours, theirs = min(closed_seconds), min(heyoka_seconds)
    difference = np.max(np.abs(flow.unpack(states)["frame"] - closed.frame))
    details = closed.provenance.details
    return (
        f"| {problem.n} | {label} | {ours:.2f} s | {theirs:.2f} s | {theirs / ours:.1f} | {details['clock']} | "
        f"{details['evaluations']} | {difference:.1e} | {np.max(closed.error):.1e} |"
    )


def main(count: int, span: float) -> None:
    print("| n | times | closed form | heyoka | ratio | clock | evaluations | difference | reported |")
    print("|---|---|---|---|---|---|---|---|---|")
    for n in range(2, 7):
        make = partial(_problem, n)
        solve(make(), [span])  # what a process loads once
        print(row(make, np.unique(np.random.default_rng(1).uniform(0, span, count)), "random"), flush=True)
        print(row(make, np.linspace(0, span, count), "uniform"), flush=True)


def _problem(n: int) -> Veselova:
    return random_problem(np.random.default_rng(n), n, 5.0)


if __name__ == "__main__":
    main(int(float(sys.argv[1])) if len(sys.argv) > 1 else 1_000_000, float(sys.argv[2]) if len(sys.argv) > 2 else 1000.0)
