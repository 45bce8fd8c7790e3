"""Would products of matrices serve an orbit better? Theta functions on a uniform grid of τ₁, and at
any phases, against windows.

    python benchmarks/products.py [TIMES]      default 10⁶ times in [0, 1000]

On a uniform grid every wave e^{2πi (x·f)(aB+b)h} is a giant step times a baby step, so the waves of
one ε (A: giant steps ×
waves, B: waves × baby steps) give each of their functions as a product (A w) B of complex matrices;
two real functions share one.
At any phases the lattice is split in two, Gaussians and waves, and a product of real matrices sums
over the former: so analytic.theta sums every theta function. Both are of the functions alone.
"Products": solve with method="products", which sums them at every time, a tenth of so many;
"chosen": solve at as many uniform times, which sums them at the nodes of its windows. Processor
time for each point, the least of three, one thread, one process. The difference is that of the
first two, over the largest value.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import sys
from collections import defaultdict
from collections.abc import Sequence

import numpy as np
from nufft import best, problem

import veselova as vs
from veselova.analytic.motion.torus_solution import Solution
from veselova.analytic.theta.characteristic import Characteristic
from veselova.analytic.theta.lattice import RADIUS, lattice_points, small_norm

#: Points at which functions are summed one by one.
_SCATTERED = 20_000


def on_grid(
    T: np.ndarray,
    functions: Sequence[Characteristic],
    origin: np.ndarray,
    rates: np.ndarray,
    step: float,
    side: int,
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
        giant = np.exp(turn * side * np.arange(side)[:, None]) * (
            sizes * np.exp(2j * np.pi * (x @ origin))
        )
        for first in range(0, len(members), 2):
            pair = members[first : first + 2]
            weights = sum(
                factor * np.exp(2j * np.pi * (x @ delta))
                for factor, (_, delta) in zip((1, 1j), pair, strict=False)
            )
            product = (giant * weights) @ baby
            for part, (place, _) in zip((product.real, product.imag), pair, strict=False):
                result[place] = part
    return result.reshape(len(functions), -1)


def compare(n: int, count: int) -> str:
    """Return a row of the table; n = 6 makes do with a sixteenth of the points of a grid, whose
    products take seconds.
    """
    body = problem(n)
    solution = Solution(body)
    T, functions, flow = (
        np.asarray(solution.periods.riemann_matrix, float),
        solution.quotients.functions,
        solution.in_tau1,
    )
    side, step = round(count**0.5) // (4 if n == 6 else 1), 1000 / count
    of_grid, values = best(lambda: on_grid(T, functions, flow.start, flow.rates, step, side))
    some = np.arange(0, side * side, max(1, side * side // _SCATTERED))
    of_sums, sums = best(
        lambda: solution.quotients.theta.values(
            flow.start + np.outer(some * step, flow.rates), functions
        )
    )
    of_products = best(lambda: vs.solve(body, np.linspace(0, 100, count // 10), method="products"))[
        0
    ]
    chosen = best(lambda: vs.solve(body, np.linspace(0, 1000, count)))[0]
    difference = np.max(np.abs(values[:, some].T - sums)) / np.max(np.abs(sums))
    taken = (of_grid / side**2, of_sums / some.size, of_products / (count // 10), chosen / count)
    return (
        f"{n}   {len(functions):9d}   "
        f"{'   '.join(f'{1e6 * seconds:8.3f} µs' for seconds in taken)}   {difference:.1e}"
    )


def main(count: int) -> None:
    print("n   functions    uniform τ₁    any phases      products        chosen   difference")
    for n in (2, 3, 4, 5, 6):
        print(compare(n, count), flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000)
