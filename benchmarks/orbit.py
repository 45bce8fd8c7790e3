"""A whole orbit, full attitude at many times: closed form against heyoka, in one process.

    python benchmarks/orbit.py [times] [span]      needs the extra `fast`

Random problems, A within a factor of 5, unit speed, random frame; sorted random times in [0, span].
The least processor time of five calls each, in turn; the problem is new in every call, the field
already compiled by heyoka. Both yield τ₁, a velocity and the frame; the closed form yields its
error too. "heyoka" is `benchmarks/heyoka_peer.py`: one integration as heyoka's users write it,
with no error estimate. A ratio below one means that heyoka is faster. "Difference" is that of the
frames, "reported" the closed form's error.
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
from heyoka_peer import HeyokaPeer

from veselova import Veselova, solve

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from draws import random_problem

#: Calls of each, in turn.
_CALLS = 5


def row(make: Callable[[], Veselova], times: np.ndarray, label: str) -> str:
    """Return one line of the table, for a problem that is made anew for every call."""
    closed_seconds, heyoka_seconds = list[float](), list[float]()
    for _ in range(_CALLS):
        problem = make()
        began = time.process_time()
        closed = solve(problem, times)
        closed_seconds.append(time.process_time() - began)
        problem = make()
        began = time.process_time()
        integrated = HeyokaPeer(problem)(times)
        heyoka_seconds.append(time.process_time() - began)
    ours, theirs = min(closed_seconds), min(heyoka_seconds)
    difference = np.max(np.abs(integrated[-1] - closed.frame))
    details = closed.provenance.details
    return (
        f"| {problem.n} | {label} | {ours * 1e3:.3g} ms | {theirs * 1e3:.3g} ms | "
        f"{theirs / ours:.2f} | {details['time_map']} | {difference:.1e} | "
        f"{np.max(closed.error):.1e} |"
    )


def main(count: int, span: float) -> None:
    print("| n | times | closed form | heyoka | ratio | time map | difference | reported |")
    print("|" + "---|" * 8)
    for n in range(2, 7):
        make = partial(_problem, n)
        solve(make(), [span])  # what a process loads and compiles once
        HeyokaPeer(make())
        print(
            row(make, np.unique(np.random.default_rng(1).uniform(0, span, count)), "random"),
            flush=True,
        )
        print(row(make, np.linspace(0, span, count), "uniform"), flush=True)


def _problem(n: int) -> Veselova:
    return random_problem(np.random.default_rng(n), n, 5.0)


if __name__ == "__main__":
    main(
        int(float(sys.argv[1])) if len(sys.argv) > 1 else 1_000_000,
        float(sys.argv[2]) if len(sys.argv) > 2 else 1000.0,
    )
