"""Would products of matrices serve an orbit better? Theta functions on a uniform grid of τ₁, and at any phases, against windows.

    python benchmarks/products.py [TIMES]      default 10⁶ times in [0, 1000]

On a uniform grid every wave e^{2πi (x·f)(aB+b)h} is a giant step times a baby step, so the waves of one ε (A: giant steps ×
waves, B: waves × baby steps) give each of their functions as a product (A w) B of complex matrices; two real functions share one.
At any phases the lattice is split in two, Gaussians and waves, and a product of real matrices sums over the former
(analytic.theta, which is how every theta function of this package is summed). "Whole answer": solve at as many uniform times, which
takes theta functions at the nodes of its windows only, and has the clock, q̇ and the frame in it besides. Processor time for each
point, the least of three, one thread, one process. The difference is that of both sums at a thousand points, over the largest value.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import sys
import time
from collections import defaultdict
from collections.abc import Callable
from typing import Any

import numpy as np
from nufft import problem

import veselova as vs
from veselova.analytic.characteristic import Characteristic
from veselova.analytic.lattice import RADIUS, lattice_points, small_norm
from veselova.analytic.solution import Solution


def least(call: Callable[[], Any]) -> tuple[float, Any]:
    seconds, answer = np.inf, None
    for _ in range(3):
        answer = None
        began = time.process_time()
        answer = call()
        seconds = min(seconds, time.process_time() - began)
    return seconds, answer


def on_grid(
    T: np.ndarray, functions: list[Characteristic], origin: np.ndarray, rates: np.ndarray, step: float, side: int
) -> np.ndarray:
    """Return the functions at τ₁ = 0, step … (side²−1)·step, shape (len(functions), side²)."""
    families = defaultdict(list)
    for place, function in enumerate(functions):
        families[function.epsilon].append((place, np.array(function.delta) / 2))
    result = np.empty((len(functions), side, side))
    for epsilon, members in families.items():
        shift = np.array(epsilon) / 2
        x = lattice_points(T, float(np.sqrt(RADIUS**2 + small_norm(T, shift))), shift)
        sizes = np.exp(-np.pi * np.sum((x @ T) * x, axis=1))
        turn = 2j * np.pi * (x @ rates) * step
        baby = np.exp(turn[:, None] * np.arange(side))
        giant = np.exp(turn * side * np.arange(side)[:, None]) * (sizes * np.exp(2j * np.pi * (x @ origin)))
        for first in range(0, len(members), 2):
            pair = members[first : first + 2]
            weights = sum(factor * np.exp(2j * np.pi * (x @ delta)) for factor, (_, delta) in zip((1, 1j), pair, strict=False))
            product = (giant * weights) @ baby
            for part, (place, _) in zip((product.real, product.imag), pair, strict=False):
                result[place] = part
    return result.reshape(len(functions), -1)


def main(count: int) -> None:
    side = round(count**0.5)
    print("n   functions   waves   uniform τ₁   any phases   whole answer   difference")
    for n in (2, 3, 4, 5, 6):
        body = problem(n)
        solution = Solution(body)
        T, functions = np.asarray(solution.periods.riemann_matrix, dtype=float), list(solution.quotients.functions)
        rates, origin = solution.in_tau1.rates, solution.in_tau1.at(0.0) if hasattr(solution.in_tau1, "at") else np.zeros(n - 1)
        step = 1000.0 / (side * side)
        if n == 6:
            side_here = side // 4
        else:
            side_here = side
        grid, values = least(lambda: on_grid(T, functions, origin, rates, step, side_here))
        z = origin + np.outer(np.arange(side_here**2)[:: max(1, side_here**2 // 20_000)] * step, rates)
        single, sums = least(lambda: solution.quotients.theta.values(z, functions))
        whole = least(lambda: vs.solve(body, np.linspace(0, 1000, side * side)))[0]
        there = values[:, :: max(1, side_here**2 // 20_000)].T
        difference = np.max(np.abs(there - sums)) / np.max(np.abs(sums))
        waves = solution.quotients.theta.size
        print(f"{n}   {len(functions):9d}   {waves:5d}   {1e6*grid/side_here**2:7.3f} µs   {1e6*single/len(z):7.3f} µs   {1e6*whole/side**2:9.3f} µs   {difference:.1e}", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000)
