"""What integrals of motion along 10⁶ times cost, beside the motion itself, and how near the
constants are to those of 40 digits.

python benchmarks/integrals.py [times]
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import mpmath
import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

from draws import random_problem
from veselova import solve
from veselova.mechanics.geometry.integrals_of_motion import moser_eigenvalues

RUNS, STATES = 3, 40


def costs(n: int, count: int) -> tuple[float, float]:
    """Return the seconds of a motion at random times in [0, 1000], and of its integrals, the least
    of some runs.
    """
    problem, rng = random_problem(np.random.default_rng(3), n, 5.0), np.random.default_rng(1)
    times, motion, integrals = np.unique(rng.uniform(0, 1000, count)), [], []
    for _ in range(RUNS):
        began = time.perf_counter()
        trajectory = solve(problem, times)
        solved = time.perf_counter()
        assert trajectory.integrals
        motion.append(solved - began)
        integrals.append(time.perf_counter() - solved)
    return min(motion), min(integrals)


def error(rng: np.random.Generator, n: int, decades: float, speed: float) -> float:
    """Return the error of c_1 … c_{n−1} at a drawn state, in ε·max(I_i, |q'|²)."""
    A, q, v = (
        10 ** rng.uniform(-decades, decades, n),
        rng.normal(size=n),
        speed * rng.normal(size=n),
    )
    q /= np.linalg.norm(q)
    v -= (v @ q) * q
    columns = mpmath.matrix(np.column_stack([q, rng.normal(size=(n, n - 1))]).tolist())
    basis = mpmath.qr(columns)[0][:, 1:]
    velocity = mpmath.matrix(v.tolist())
    form = mpmath.diag([1 / mpmath.mpf(a) for a in A.tolist()]) - velocity * velocity.T
    exact = sorted(mpmath.eigsy(basis.T * form * basis, eigvals_only=True))
    found = moser_eigenvalues(A, q, v).tolist()
    off = max(abs(c - e) for c, e in zip(found, exact, strict=True))
    return float(off) / (np.finfo(float).eps * max(float(np.max(1 / A)), float(v @ v)))


def main(count: int) -> None:
    print(f"| n | motion at {count:.0e} times | its integrals | ratio |\n|---|---|---|---|")
    for n in (3, 4, 6):
        motion, integrals = costs(n, count)
        print(
            f"| {n} | {motion:.2f} s | {integrals:.2f} s | {integrals / motion:.1f} |", flush=True
        )
    rng = np.random.default_rng(5)
    with mpmath.workdps(40):
        kinds = [
            (n, decades, speed)
            for n in (2, 3, 4, 6)
            for decades in (0.3, 6.0)
            for speed in (1e-8, 1.0, 1e8)
        ]
        worst = max(error(rng, *kind) for kind in kinds for _ in range(STATES))
    print(
        f"constants of {len(kinds) * STATES} states: off by at most {worst:.1f} ε of the "
        "largest I_i or |q'|²"
    )


if __name__ == "__main__":
    main(int(float(sys.argv[1])) if len(sys.argv) > 1 else 1_000_000)
