"""Would a nonuniform FFT serve an orbit better? Theta functions by finufft's type 3 against windows of Chebyshev series.

    python benchmarks/nufft.py [TIMES]      needs finufft (pip install finufft); default 10⁶ times in [0, 1000]

Along an orbit every theta function is a sum of waves e^{2πi x·(z⁰+fτ₁)} over a lattice, and those with the same ε share their
frequencies x·f: one transform of type 3 serves all of them at arbitrary τ₁. That side is given τ₁ and ends with the quotients;
ours starts from t, inverts the clock, and gives the whole trajectory with its error. Best of three each, one thread, one process.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import sys
import time
from collections import defaultdict
from collections.abc import Callable
from typing import Any

import finufft
import numpy as np

import veselova as vs
from veselova.analytic.characteristic import Characteristic
from veselova.analytic.lattice import RADIUS, lattice_points, small_norm
from veselova.analytic.solution import Solution

#: Relative error asked of the transform; it gives no less in double precision.
EPSILON = 1e-14


def problem(n: int) -> vs.Veselova:
    rng = np.random.default_rng(n)
    return vs.Veselova(rng.uniform(1, 4, n), rng.normal(size=n), rng.normal(size=n), normalize=True)


def transforms(solution: Solution, tau1: np.ndarray) -> np.ndarray:
    """Return q_i, v_k and (n_k)_i as theta quotients at Neumann times, (N, K), by one transform for each ε."""
    T, start, rates = solution.quotients.theta.T, solution.in_tau1.start, solution.in_tau1.rates
    distinct, places = solution.quotients._distinct
    functions = [Characteristic.zero(len(T)), *distinct]
    values = np.empty((len(functions), tau1.size))
    families: dict[tuple[int, ...], list[int]] = defaultdict(list)
    for place, characteristic in enumerate(functions):
        families[characteristic.epsilon].append(place)
    for epsilon, members in families.items():
        shift = np.array(epsilon) / 2
        x = lattice_points(T, float(np.sqrt(RADIUS**2 + small_norm(T, shift))), shift)
        weights = np.exp(-np.pi * np.sum((x @ T) * x, axis=1))
        phases = np.array([start + np.array(functions[place].delta) / 2 for place in members]) @ x.T
        coefficients = weights * np.exp(2j * np.pi * phases)
        answer = finufft.nufft1d3(2 * np.pi * (x @ rates), coefficients, tau1, eps=EPSILON, isign=1, nthreads=1)
        values[members] = np.atleast_2d(answer).real
    return np.asarray((values[1:] / values[0])[places].T * solution.quotients.constants)


def best(call: Callable[[], Any]) -> tuple[float, Any]:
    seconds, answer = np.inf, None
    for _ in range(3):
        answer = None
        began = time.perf_counter()
        answer = call()
        seconds = min(seconds, time.perf_counter() - began)
    return seconds, answer


def main(count: int) -> None:
    times = np.sort(np.random.default_rng(0).uniform(0, 1000, count))
    print("n   functions   type 3 and quotients   whole trajectory by windows   ratio   largest difference of q")
    for n in (3, 4, 5):
        body = problem(n)
        solution = Solution(body)
        ours, trajectory = best(lambda body=body: vs.solve(body, times))  # type: ignore[misc]
        tau1 = trajectory.tau1 / solution.tau1_unit
        theirs, quotients = best(lambda solution=solution, tau1=tau1: transforms(solution, tau1))  # type: ignore[misc]
        q = quotients[:, :n] @ solution.moving.directions.T
        difference = np.max(np.abs(q - trajectory.q))
        functions = len(solution.quotients._distinct[0]) + 1
        print(f"{n}   {functions:9d}   {theirs:18.2f} s   {ours:25.2f} s   {theirs / ours:5.1f}   {difference:23.1e}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000)
