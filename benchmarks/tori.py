"""How many tori a second and core, computed together, and by how much is that faster than one by
one?

    python benchmarks/tori.py [PROBLEMS]

Random A within a factor of 5, random q and q_dot, all new; processor seconds. "together" is
analytic.closed.many.tori on arrays, in parts of 2000 problems as a sweep takes them;
"one by one" is the problem and ``torus``, for the first 50. The difference is the largest of any
number relative to itself (for phases: of a cycle).
"""

from __future__ import annotations

import os
import sys
import time
from dataclasses import fields

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from veselova import Torus, Veselova, torus
from veselova.analytic.closed.many import KnownTori, tori

PART, SINGLE = 2000, 50
NAMES = [field.name for field in fields(KnownTori) if field.name not in ("known", "origins")]


def starts(
    rng: np.random.Generator, count: int, n: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return (
        np.exp(rng.uniform(0, np.log(5), (count, n))),
        rng.normal(size=(count, n)),
        rng.normal(size=(count, n)),
    )


def deviation(found: KnownTori, i: int, single: Torus) -> float:
    """Return the largest difference of any number."""
    worst = 0.0
    for name in NAMES:
        there, here = np.atleast_1d(getattr(single, name)), np.atleast_1d(getattr(found, name)[i])
        apart = (
            np.abs(np.mod(here - there + 0.5, 1) - 0.5)
            if name == "phases"
            else np.abs(here - there)
        )
        size = np.where((there == 0) | (name == "phases"), 1, np.abs(there))
        worst = max(worst, float(np.max(apart / size, initial=0)))
    return worst


def main(count: int) -> None:
    print(
        "| n | together, a second | one by one | ratio | computed together | largest "
        "difference |\n|---|---|---|---|---|---|"
    )
    for n in range(2, 8):
        rng = np.random.default_rng(n)
        tori(*starts(rng, PART, n))
        A, q, q_dot = starts(rng, count, n)
        began = time.process_time()
        parts = [tori(*(x[i : i + PART] for x in (A, q, q_dot))) for i in range(0, count, PART)]
        together = count / (time.process_time() - began)
        torus(Veselova(A[-1], q[-1], q_dot[-1], normalize=True))
        began = time.process_time()
        singles = [torus(Veselova(A[i], q[i], q_dot[i], normalize=True)) for i in range(SINGLE)]
        one = SINGLE / (time.process_time() - began)
        worst = max(
            deviation(parts[0], i, single) for i, single in enumerate(singles) if parts[0].known[i]
        )
        known = np.mean(np.concatenate([part.known for part in parts]))
        print(
            f"| {n} | {together:.0f} | {one:.0f} | {together / one:.0f} | {known:.2%} | "
            f"{worst:.0e} |",
            flush=True,
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000)
