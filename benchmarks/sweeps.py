"""How many problems does a sweep solve in a second, and how much do two workers give over one?

    python benchmarks/sweeps.py [PROBLEMS]

Torus summaries of bodies with n = 3 and random A, q and q_dot, by one worker process and by two, in one run. The time is that
from the first chunk to the last, so the start of the processes does not count. Default: 10 000 problems for each.
"""

from __future__ import annotations

import sys
import tempfile
import time

from veselova.service.local_sweep import local_settings, run_sweep
from veselova.service.schemas import read_request
from veselova.service.sweep_request import SweepRequest

BASE = {"system": "veselova", "A": [1, 1, 1], "q": [1, 0, 0], "q_dot": [0, 1, 0], "normalize": True}
VARY = {"/A": {"uniform": [1, 3]}, "/q": {"normal": [0, 1]}, "/q_dot": {"normal": [0, 1]}}


def rate(problems: int, workers: int) -> float:
    """Return problems per second."""
    sweep = read_request(SweepRequest, {"problem": BASE, "vary": VARY, "samples": problems, "seed": workers})
    seen: list[tuple[float, int]] = []

    def note(done: int, _: int) -> None:
        if done and (not seen or done > seen[-1][1]):
            seen.append((time.perf_counter(), done))

    with tempfile.TemporaryDirectory() as folder:
        run_sweep(sweep, local_settings(folder, workers), note)
    (began, first), (ended, last) = seen[0], seen[-2 if len(seen) > 2 else -1]
    return (last - first) / (ended - began)


def main() -> None:
    problems = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000
    rates = {}
    for workers in (1, 2):
        rates[workers] = rate(problems, workers)
        print(f"{workers} worker(s): {rates[workers]:.0f} problems per second")
    print(f"two over one: {rates[2] / rates[1]:.2f}")


if __name__ == "__main__":
    main()
