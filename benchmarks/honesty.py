"""Do true errors stay below reported ones? Random problems, n = 2…8, |t| ≤ 50, against integration
in binary128.

    python benchmarks/honesty.py [problems per n] [system]      default 40, veselova; needs the
    extra `fast`

Systems: veselova, neumann, ellipsoid-geodesic, rubber-ball. The ball has n = 3, and its truth is
that of its attitude. Prints per n and method the largest and median true error of the frame, the
median reported one, and the largest true error over the reported one at the same time, at most 1.
"""

from __future__ import annotations

import os
import sys
from fractions import Fraction
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

import veselova as vs

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

from truth import true_motion

from draws import random_problem
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.geometry.sphere import exact_cross
from veselova.mechanics.systems.torus_problem import on_torus

METHODS = [
    ("analytic", "theta"),
    ("analytic", "angles"),
    ("numeric", "dop853"),
    ("numeric", "taylor"),
]


def drawn(rng: np.random.Generator, n: int, system: str) -> Problem:
    """Return a problem of the system with the data of a random one of Veselova's."""
    body = random_problem(rng, n, framed=system == "veselova")
    A, q, q_dot = body.exact.A, body.exact.q, body.exact.tangent
    if system == "neumann":
        return vs.NeumannSystem(A, q, q_dot, normalize=True)
    if system == "ellipsoid-geodesic":
        X, X_dot = ([a * x for a, x in zip(A, row, strict=True)] for row in (q, q_dot))
        return vs.EllipsoidGeodesic(A, X, X_dot, normalize=True)
    if system == "rubber-ball":
        moments = [1 / a for a in A]
        radius = Fraction(1, 2)
        mass = min(moments)
        # The attitude is that of the body with I + ma²
        return vs.RubberBall(
            moments, mass, radius, q, exact_cross(q_dot, q), strict=False, normalize=True
        )
    return body


def main(count: int, system: str) -> None:
    print("n   method    largest error   median error   median reported   largest error/reported")
    for n in (3,) if system == "rubber-ball" else range(2, 9):
        rng = np.random.default_rng(100 + n)
        rows: dict[str, list[tuple[float, float, float]]] = {method: [] for _, method in METHODS}
        for _ in range(count):
            problem = drawn(rng, n, system)
            times = np.sort(rng.uniform(-50, 50, 8))
            frame = true_motion(on_torus(problem), times)[0]
            for engine, method in METHODS:
                if method == "theta" and n > 6:
                    continue  # 14 to 25 ms a point, and the same states as by angles
                found = vs.solve(problem, times, engine, method)
                error = np.max(np.abs(found.frame - frame), axis=(1, 2))
                rows[method].append(
                    (
                        float(np.max(error)),
                        float(np.max(found.error)),
                        float(np.max(error / found.error)),
                    )
                )
        for method, values in rows.items():
            if values:
                errors, reported, ratios = np.array(values).T
                figures = (
                    f"{np.max(errors):13.1e}   {np.median(errors):12.1e}   "
                    f"{np.median(reported):15.1e}   {np.max(ratios):12.2f}"
                )
                print(f"{n}   {method:7s}   {figures}", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 40, (*sys.argv[2:], "veselova")[0])
