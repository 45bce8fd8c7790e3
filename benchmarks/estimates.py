"""How far below the measured seconds are the estimates that refuse hopeless requests?

    python benchmarks/estimates.py

For random bodies (A from 1 to 3, unit speed) the least of two runs over two numbers of times, in
one process: the seconds for each time and n² in both engines, by n; and beyond double precision
those, and of the set-up, by digits too. The last column is measured over estimated
(``workers.cost_floor.cost``), which has no business below 1 on the machine of the figures.
"""

from __future__ import annotations

import os
import time
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

import veselova as vs
from veselova.service.api.request_models import TrajectoryRequest, read_request
from veselova.service.workers.cost_floor import cost


def request_of(n: int, count: int, **options: Any) -> TrajectoryRequest:
    rng = np.random.default_rng(n)
    A, q, q_dot = rng.uniform(1, 3, n), rng.normal(size=n), rng.normal(size=n)
    q, q_dot = q / np.linalg.norm(q), q_dot / np.linalg.norm(q_dot)
    problem = {
        "system": "veselova",
        "A": A.tolist(),
        "q": q.tolist(),
        "q_dot": q_dot.tolist(),
        "normalize": True,
    }
    return read_request(
        TrajectoryRequest,
        {"problem": problem, "times": {"start": 0, "stop": 1, "count": count}, **options},
    )


def seconds(request: TrajectoryRequest) -> float:
    """Return the least of two measurements."""
    measured = []
    for _ in range(2):
        began = time.perf_counter()
        problem = request.problem.problem()
        vs.solve(
            problem,
            request.time_grid(),
            request.engine,
            digits=request.digits,
            certified=request.certified,
        )
        measured.append(time.perf_counter() - began)
    return min(measured)


def main() -> None:
    seconds(request_of(3, 2, engine="analytic"))
    print(
        "engine    digits     n    times    seconds   set-up s   µs per time and n²   "
        "measured / estimated"
    )
    dimensions, engines = (2, 3, 4, 6, 8, 16, 32, 64), ("analytic", "numeric")
    rows = [
        (engine, 15, False, n, 20_000 if n < 20 else 2000) for engine in engines for n in dimensions
    ]
    rows += [
        ("analytic", digits, digits == 15, n, 100)
        for digits in (15, 30, 50, 100, 200)
        for n in (2, 3, 4, 6)
    ]
    for engine, digits, certified, n, count in rows:
        options = {"engine": engine, "digits": digits, "certified": certified}
        few, many = request_of(n, 2, **options), request_of(n, count, **options)
        set_up, whole = seconds(few), seconds(many)
        each = (whole - set_up) / (count - 2) / n**2 * 1e6
        ratio = whole / cost(many).seconds
        print(
            f"{engine:8}  {digits:6}  {n:4}  {count:7}   {whole:8.3f}   {set_up:8.3f}   "
            f"{each:18.3f}   {ratio:20.2f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
