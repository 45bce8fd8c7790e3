"""What digits cost: the closed form in ball arithmetic, plain and certified, against the same with
more digits.

    python benchmarks/digits.py [most digits]        default 100

Prints, per dimension and number of digits, the seconds of a whole call (set-up included), those
until the frame is there in decimals, and those until all series are (decimals are made when they
are asked for), the working digits, the time map and its evaluations, the largest error reported,
and the largest difference of the frame from a run with ten digits more (decimals are rounded to
three digits beyond those asked for). The last bodies are next to a separatrix, with relative gaps
of 1e-6 and 1e-17.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

import veselova as vs
from draws import near_unstable_circle


def problem(n: int) -> vs.Veselova:
    rng = np.random.default_rng(n)
    A, q, q_dot = (
        [f"{x:.3f}" for x in values]
        for values in (rng.uniform(1, 4, n), rng.normal(size=n), rng.normal(size=n))
    )
    return vs.Veselova(A, q, q_dot, normalize=True)


def main(most: int) -> None:
    print(
        "n   times               digits   certified   seconds   frame     all       working  "
        " time map   evaluations   "
        "reported   difference"
    )
    near, many, far = np.linspace(0, 10, 10), np.linspace(0, 100, 100), np.array([1e6, 1e12])
    orbits = [np.linspace(0, reach, 10_000) for reach in (10, 100, 1000)]
    table = [(n, near, 15, True) for n in (2, 3, 4, 6)]
    table += [(3, near, d, False) for d in (30, 100, 300, 990) if d <= most]
    table += [(n, many, 50, False) for n in (3, 4)] + [(3, far, 30, False), (2, far, 50, False)]
    table += [(3, orbit, 50, False) for orbit in orbits] + [
        (4, orbit, 50, False) for orbit in orbits[:2]
    ]
    rows = [(problem(n), times, digits, certified) for n, times, digits, certified in table]
    rows += [
        (near_unstable_circle(*start), far[:1], 20, False)
        for start in (("1e-3", "1e-4"), ("3.735e-9", "3.758e-11"))
    ]
    for body, times, digits, certified in rows:
        began = time.perf_counter()
        found = vs.solve(body, times, digits=digits, certified=certified, budget_s=600)
        seconds = [time.perf_counter() - began]
        assert found.decimals is not None
        frame = found.decimals.midpoints["frame"]
        seconds.append(time.perf_counter() - began)
        dict(found.decimals.midpoints)
        seconds.append(time.perf_counter() - began)
        finer = vs.solve(body, times, digits=digits + 10, budget_s=600)
        assert finer.decimals is not None
        difference = np.max(np.abs(frame - finer.decimals.midpoints["frame"]))
        details, span = found.provenance.details, f"{times.size} to {times[-1]:g}"
        spent = "   ".join(f"{x:7.2f}" for x in seconds)
        figures = (
            f"{spent}   {details['working_digits']:7d}   {details['time_map']:8s}   "
            f"{details['time_map_size']:11d}"
        )
        errors = f"{max(found.decimals.error):8.1e}   {difference:8.1e}"
        print(f"{body.n}   {span:17s}   {digits:6d}   {certified!s:9s}   {figures}   {errors}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100)
