"""Would a nonuniform FFT serve an orbit better? method="nufft" against what is chosen, windows of
Chebyshev series.

    python benchmarks/nufft.py [TIMES]      needs the extra `fast`; default 10⁶ times in [0, 1000]

Along an orbit every theta function is a sum of waves e^{2πi x·(z⁰+fτ₁)} over a lattice, and those
with the same ε share their frequencies x·f: transforms of type 3 serve all of them at arbitrary τ₁.
Whole trajectories, the problem new to both; "clock" is the part of the former in which t becomes
τ₁, time by time. Processor time, best of three each, one thread, one process.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import veselova as vs
from veselova.analytic.dense_output.output_array import OutputArray
from veselova.analytic.motion.evaluation_plan import EvaluationPlan
from veselova.analytic.motion.torus_solution import Solution


def problem(n: int) -> vs.Veselova:
    rng = np.random.default_rng(n)
    return vs.Veselova(rng.uniform(1, 4, n), rng.normal(size=n), rng.normal(size=n), normalize=True)


def clock(body: vs.Veselova, times: np.ndarray) -> None:
    """Take t to τ₁ as the method does, and nothing else."""
    solution = Solution(body)
    chosen = EvaluationPlan(solution, times, "nufft").time_map()
    OutputArray(
        times, times.size + 1, chosen, solution.in_tau1.rates, lambda tau1, z: (tau1, (tau1,))
    ).complete()


def best(call: Callable[[], Any]) -> tuple[float, Any]:
    seconds, answer = np.inf, None
    for _ in range(3):
        answer = None
        began = time.process_time()
        answer = call()
        seconds = min(seconds, time.process_time() - began)
    return seconds, answer


def main(count: int) -> None:
    times = np.sort(np.random.default_rng(0).uniform(0, 1000, count))
    print("n   nufft     clock     chosen    ratio   without clock   largest difference   reported")
    for n in (2, 3, 4, 5, 6):
        body = problem(n)
        theirs, by_transforms = best(lambda body=body: vs.solve(body, times, method="nufft"))  # type: ignore[misc]
        ours, trajectory = best(lambda body=body: vs.solve(body, times))  # type: ignore[misc]
        of_clock = best(lambda body=body: clock(body, times))[0]  # type: ignore[misc]
        difference, reported = (
            np.max(np.abs(by_transforms.frame - trajectory.frame)),
            np.max(by_transforms.error),
        )
        ratios = f"{theirs / ours:5.1f}   {(theirs - of_clock) / ours:13.1f}"
        print(
            f"{n}   {theirs:5.2f} s   {of_clock:5.2f} s   {ours:5.2f} s   {ratios}   "
            f"{difference:18.1e}   {reported:8.1e}",
            flush=True,
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000)
