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

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from veselova import Unsolved, solve
from veselova.analytic.solve import solve as solve_analytic

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

from draws import near_resonance


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
