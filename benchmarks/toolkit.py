"""The toolkit against its peers, in one run: theta values and period matrices, ours and
python-flint's and mpmath's.

    python benchmarks/toolkit.py [ROUNDS]      default 5; medians of ROUNDS

Theta: one function at 10⁴ scattered points, ours, and python-flint's ``acb_mat.theta`` at 53 bits,
which gives all 4^g functions of one point at once; the first ratio is for one function, the second
for all of them, at 10⁴ points too (2000 for g = 4).
Periods: a new curve with random branch points to its Riemann matrix, warm. python-flint integrates
the same 2g² monomial forms by ``acb.integral`` in the angle of λ = middle − radius·cos, in which
the ends of an interval are no singularities.
"""

from __future__ import annotations

import itertools
import statistics
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from flint import acb, acb_mat, ctx

from veselova import curves, theta

POINTS = 10_000


def median_seconds(rounds: int, call: Callable[[], Any]) -> float:
    """Return the median of the processor seconds of a call."""
    call()
    found = []
    for _ in range(rounds):
        began = time.process_time()
        call()
        found.append(time.process_time() - began)
    return statistics.median(found)


def random_tau(random: np.random.Generator, genus: int) -> Any:
    """Return a matrix of the half space with entries of order one."""
    X, M = random.normal(size=(genus, genus)), random.normal(size=(genus, genus))
    return (X + X.T) / 2 + 1j * (M @ M.T / genus + 0.3 * np.eye(genus))


def theta_row(rounds: int, genus: int, random: np.random.Generator) -> str:
    """Return microseconds a point of both, and what they differ by."""
    tau = random_tau(random, genus)
    z = random.normal(size=(POINTS, genus)) + 0.1j * random.normal(size=(POINTS, genus))
    ours = median_seconds(rounds, lambda: theta.riemann_theta(z, tau)) / POINTS
    ctx.prec = 53
    matrix = acb_mat([[acb(x.real, x.imag) for x in row] for row in tau.tolist()])
    columns = [
        acb_mat([[acb(x.real, x.imag)] for x in point])
        for point in z[: 200 // 4**genus + 2].tolist()
    ]
    theirs = median_seconds(rounds, lambda: [matrix.theta(column) for column in columns]) / len(
        columns
    )
    rows = list(itertools.product((0, 0.5), repeat=genus))
    halves = [[list(e), list(d)] for e in rows for d in rows]
    some = z[: POINTS if genus < 4 else 2000]
    every = median_seconds(rounds, lambda: theta.riemann_theta(some, tau, halves)) / len(some)
    first = np.array([complex(matrix.theta(columns[0])[0, i]) for i in range(4**genus)])
    found = theta.riemann_theta(z[0], tau, halves)
    off = np.max(np.abs(first - found)) / np.max(np.abs(first))
    first_half = f"{genus:5d} {ours * 1e6:10.2f} {theirs * 1e6:12.1f} {theirs / ours:9.0f}"
    return f"{first_half} {every * 1e6:12.1f} {theirs / every:9.0f}   {off:.1e}"


def integral_of(points: list[float], low: float, high: float, power: int) -> Any:
    """Return ∫ λ^power dλ/√|Π(λ−b)| over a cut by python-flint, in the angle of its ends."""
    others = [acb(b) for b in points if b not in (low, high)]
    middle, radius = acb((low + high) / 2), acb((high - low) / 2)

    def density(angle: Any, _: bool) -> Any:
        x = middle - radius * angle.cos()
        product = acb(1)
        for b in others:
            product *= (x - b) if b.real < x.real else (b - x)
        return x**power / product.sqrt()

    return acb.integral(density, acb(0), acb.pi())


def periods_row(rounds: int, genus: int, random: np.random.Generator) -> str:
    """Return milliseconds of a Riemann matrix, and by python-flint's integration."""
    points = np.cumsum(random.uniform(0.1, 2, 2 * genus + 1)).tolist()
    ours = median_seconds(20 * rounds, lambda: curves.RealHyperelliptic(points).riemann_matrix)
    ctx.prec = 53

    def integrated() -> None:
        for k in range(genus):
            for j in range(2 * genus):
                integral_of(points, points[j], points[j + 1], k)

    theirs = median_seconds(max(1, rounds // 2), integrated)
    return f"{genus:5d} {ours * 1e3:10.3f} {theirs * 1e3:12.2f} {theirs / ours:9.0f}"


def main() -> None:
    """Print both tables."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    random = np.random.default_rng(1)
    print(
        "Theta functions, microseconds a point: one function; python-flint's call, which "
        "gives 4^g; and 4^g of ours"
    )
    print(
        f"{'genus':>5} {'ours':>10} {'python-flint':>12} {'ratio':>9} {'4^g of ours':>12} "
        f"{'ratio':>9}   difference"
    )
    for genus in (1, 2, 3, 4):
        print(theta_row(rounds, genus, random))
    print("\nRiemann matrices of new curves, milliseconds of processor time")
    print(f"{'genus':>5} {'ours':>10} {'python-flint':>12} {'ratio':>9}")
    for genus in (1, 2, 4, 8):
        print(periods_row(rounds, genus, random))


if __name__ == "__main__":
    main()
