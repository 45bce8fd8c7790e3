"""Are the radii of many digits honest? Drawn problems, digits and times, against twelve digits
more.

    python benchmarks/radii.py [SECONDS] [SEED]        default 300 seconds

Problems of n = 2, 3, 4: random, with A's far apart, nearly equal or equal, with a direction at
rest, next to a separatrix; 16 to 104 digits, 3 to 900 times, some of them far out, both routes for
n = 3. Prints every difference above the sum of both radii, what
was refused, and at the end the problems and the largest difference over that sum for each series:
at most one, and near it, since radii are those of the rounding to decimals where nothing else is in
them.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

from draws import random_problem
from veselova import Unsolved, Veselova, VeselovaError, solve

KINDS = ("random", "wide", "near", "equal", "frozen", "separatrix")
SERIES = ("frame", "q_dot", "omega", "spheroconic", "tau1")


def drawn(rng: np.random.Generator, kind: str, n: int) -> Veselova:
    """Return a problem of a kind."""
    if kind in ("random", "wide"):
        return random_problem(rng, n, 5.0 if kind == "random" else 10 ** rng.uniform(2, 6))
    A, q, q_dot = np.sort(rng.uniform(1, 4, n))[::-1], rng.normal(size=n), rng.normal(size=n)
    if kind in ("near", "equal"):
        A[1] = A[0] * (1 - (10 ** rng.uniform(-12, -3) if kind == "near" else 0))
    if kind == "frozen" and n > 2:
        q[-1] = q_dot[-1] = 0
    if kind == "separatrix" and n == 3:
        q, q_dot = np.array([0, 1, 0]), np.array([1, 10 ** rng.uniform(-20, -3), 1])
    return Veselova(*(list(map(repr, values.tolist())) for values in (A, q, q_dot)), normalize=True)


def ratios(rng: np.random.Generator, kind: str) -> dict[str, float]:
    """Return the largest difference over the radii for each series of a problem; raises
    VeselovaError where it is refused.
    """
    n, digits, count = (
        int(rng.choice([2, 3, 3, 3, 4])),
        int(rng.integers(16, 105)),
        int(rng.choice([3, 40, 320, 900])),
    )
    # Far out, time maps near a separatrix, and those of many modes, take minutes.
    far = (
        rng.uniform() < 0.3
        and kind not in ("separatrix", "wide")
        and digits < (70 if n < 4 else 30)
    )
    body, reach = (
        drawn(rng, kind, n),
        10 ** (rng.uniform(1.3, 12) if far else rng.uniform(-2, 1.3 if n < 4 else 0.5)),
    )
    times = np.sort(rng.uniform(-reach * rng.integers(0, 2), reach, count))
    method = [None, "theta", "angles"][rng.integers(3)] if n == 3 else None
    chosen = np.unique(rng.integers(0, count, 3))
    found, finer = (
        solve(body, times, digits=digits, method=method).decimals,
        solve(body, times[chosen], digits=digits + 12).decimals,
    )
    assert found is not None
    assert finer is not None
    result = {}
    for name in SERIES:
        off = np.abs(found.midpoints[name][chosen] - finer.midpoints[name]).ravel()
        radii = (found.radii[name][chosen] + finer.radii[name]).ravel()
        result[name] = max(
            float(a / b) if b else np.inf if a else 0.0 for a, b in zip(off, radii, strict=True)
        )
    if max(result.values()) > 1:
        print(
            f"above: {kind}, n = {n}, {digits} digits, {count} times to {reach:.3g}, "
            f"{method}: {result}",
            flush=True,
        )
    return result


def main(seconds: float, seed: int) -> None:
    rng, end, found = np.random.default_rng(seed), time.monotonic() + seconds, []
    while time.monotonic() < end:
        kind = str(rng.choice(KINDS))
        try:
            found.append(ratios(rng, kind))
        except Unsolved as error:
            print(f"refused: {kind}: {error}", flush=True)
        except VeselovaError:
            pass  # the draw is no problem: q and q_dot nearly parallel, say
    print(
        f"{len(found)} problems:",
        {name: round(max(of[name] for of in found), 3) for name in SERIES},
    )


if __name__ == "__main__":
    main(
        float(sys.argv[1]) if len(sys.argv) > 1 else 300.0,
        int(sys.argv[2]) if len(sys.argv) > 2 else 0,
    )
