"""Do true errors stay below reported ones near a resonance, where a combination m·f of the
frequencies nearly vanishes?

    python benchmarks/resonances.py [problems per n] [farthest time]      default 12 and 1000

Random problems, n = 3 and 4, tuned to a relative distance of 1e-9 to 1e-2 from a resonance with
|m_k| ≤ 4; truth by balls of 25 digits, which takes seconds for each. Prints per n and time map the
largest true error of the frame, the largest reported one, and the largest true error over the
reported one at the same time, at most 1.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from scipy.optimize import brentq

from veselova import Unsolved, Veselova, solve
from veselova.analytic.solve import solve as solve_analytic

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

from generic_torus import GenericTorus


def near_resonance(rng: np.random.Generator, n: int, distance: float) -> tuple[Any, Veselova]:
    """Return (m, problem): m·f is about ``distance`` times the fastest frequency for integers |m_k|
    ≤ 4, two of them not zero.

    A_1 is tuned until the combination vanishes, and moved on by a relative ``distance``.
    """
    while True:
        A, start, m = (
            np.exp(rng.uniform(0, np.log(30), n)),
            rng.normal(size=(2, n)),
            rng.integers(-4, 5, n - 1),
        )

        def moved(by: float, A: Any = A, start: Any = start) -> Veselova:
            return Veselova([A[0] * (1 + by), *A[1:]], *start, normalize=True)

        def pace(by: float, m: Any = m, moved: Any = moved) -> float:
            rates = GenericTorus(moved(by)).in_tau1.rates
            return float(m @ rates / np.max(np.abs(rates)))

        tried = np.linspace(-0.5, 0.5, 9)
        signs = np.sign([pace(by) for by in tried]) if np.count_nonzero(m) > 1 else np.ones(9)
        for k in np.flatnonzero(signs[1:] * signs[:-1] < 0):
            at = brentq(pace, tried[k], tried[k + 1], xtol=1e-15)
            if abs(pace(at)) < 1e-9:  # neither a jump nor where A's change places
                return m, moved(at + distance)


def main(count: int, farthest: float) -> None:
    print("n   time map  problems   largest error   largest reported   largest error/reported")
    for n, far in ((3, farthest), (4, farthest / 10)):
        rng = np.random.default_rng(1000 + n)
        rows: dict[str, list[tuple[float, float, float]]] = {"fourier": [], "panels": []}
        for _ in range(count):
            _, problem = near_resonance(rng, n, 10 ** rng.uniform(-9, -2))
            times = np.sort(rng.uniform(-far, far, 5))
            truth = solve(problem, times, digits=25)
            for time_map, found in rows.items():
                try:
                    closed = solve_analytic(problem, times, time_map=time_map)
                except Unsolved as refused:
                    print(f"{n}   {time_map}: {refused}")
                    continue
                error = np.max(np.abs(closed.frame - truth.frame), axis=(1, 2))
                found.append(
                    (
                        float(np.max(error)),
                        float(np.max(closed.error)),
                        float(np.max(error / closed.error)),
                    )
                )
        for time_map, found in rows.items():
            largest, reported, ratio = np.max(found, axis=0)
            print(
                f"{n}   {time_map:8s}   {len(found):8d}   {largest:13.1e}   {reported:16.1e}   "
                f"{ratio:13.2f}",
                flush=True,
            )


if __name__ == "__main__":
    main(
        int(sys.argv[1]) if len(sys.argv) > 1 else 12,
        float(sys.argv[2]) if len(sys.argv) > 2 else 1000.0,
    )
