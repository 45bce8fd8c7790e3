"""How many problems does a sweep solve in a second, and how much do two workers give over one?

    python benchmarks/sweeps.py [PROBLEMS [ROUNDS]]

Torus summaries of PROBLEMS (40 000, no fewer than 20 000) bodies with n = 3 and random A, q and
q_dot, by one worker process and by two, in turn, ROUNDS (5) times over. The rate is that of chunks
of 2000 that are done, without the start of the processes.

The peer is a multiprocessing pool of one process and of two that compute the same chunks, and that
neither keep a chunk nor know
of another job: two processors may give less than twice one, or more where somebody else takes part
of them at times, and the pool says what they give. Two loops of Python that do nothing are asked,
too.
"""

from __future__ import annotations

import os
import statistics
import sys
import tempfile
import time
from collections.abc import Iterator
from multiprocessing import get_context

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from veselova.service.api.request_models import read_request
from veselova.service.api.sweep_request import SweepRequest
from veselova.service.cli.local_sweep import local_settings, run_sweep
from veselova.service.sweeps.chunk import compute_chunk
from veselova.version import __version__

BASE = {"system": "veselova", "A": [1, 1, 1], "q": [1, 0, 0], "q_dot": [0, 1, 0], "normalize": True}
VARY = {"/A": {"uniform": [1, 3]}, "/q": {"normal": [0, 1]}, "/q_dot": {"normal": [0, 1]}}


def slope(seen: list[tuple[float, int]]) -> float:
    """Return problems per second: the slope of how many were done against the time.

    From the first chunk to the last would count one chunk too many for processes that go in step.
    """
    times, done = np.array(seen).T
    return float(np.polyfit(times - times[0], done, 1)[0])


def swept(sweep: SweepRequest, workers: int) -> float:
    """Return problems per second of a sweep."""
    seen: list[tuple[float, int]] = []

    def note(done: float, _: float) -> None:
        if done and (not seen or done > seen[-1][1]):
            seen.append((time.perf_counter(), int(done)))

    with tempfile.TemporaryDirectory() as folder:
        run_sweep(sweep, local_settings(folder, workers), note)
    return slope(seen)


def chunk(work: tuple[bytes, int, int]) -> int:
    """Return how many problems were solved: those of one chunk."""
    compute_chunk(*work, __version__)
    return work[2] - work[1]


def pooled(sweep: SweepRequest, processes: int) -> float:
    """Return problems per second of a pool of processes that computes the same chunks."""
    text = sweep.model_dump_json(by_alias=True, exclude_unset=True).encode()
    starts = range(0, sweep.total, sweep.chunk_rows)
    work = [(text, start, min(start + sweep.chunk_rows, sweep.total)) for start in starts]
    seen: list[tuple[float, int]] = []
    with get_context("spawn").Pool(processes) as pool:
        done = 0
        for rows in pool.imap_unordered(chunk, work):
            done += rows
            seen.append((time.perf_counter(), done))
    return slope(seen)


def counted(seconds: float) -> float:
    """Return how often a second a loop of Python ran through."""
    ended, rounds = time.perf_counter() + seconds, 0
    while time.perf_counter() < ended:
        sum(range(10_000))
        rounds += 1
    return rounds / seconds


def looped(processes: int) -> float:
    """Return how often a second processes that do nothing but count went round, together."""
    with get_context("spawn").Pool(processes) as pool:
        return sum(pool.map(counted, [1.0] * processes, chunksize=1))


def rounds(problems: int, count: int) -> Iterator[dict[tuple[str, int], float]]:
    """Yield what each round gave: (who, how many processes) → problems or loops per second."""
    for k in range(count):
        sweep = read_request(
            SweepRequest, {"problem": BASE, "vary": VARY, "samples": problems, "seed": k}
        )
        found: dict[tuple[str, int], float] = {}
        for processes in (1, 2) if k % 2 else (2, 1):
            found["sweep", processes] = swept(sweep, processes)
            found["pool", processes] = pooled(sweep, processes)
            found["loop", processes] = looped(processes)
        yield found


def main() -> None:
    problems = max(20_000, int(sys.argv[1]) if len(sys.argv) > 1 else 40_000)
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 5
    ratios: dict[str, list[float]] = {"sweep": [], "pool": [], "loop": []}
    for found in rounds(problems, count):
        for who, ratio in ratios.items():
            ratio.append(found[who, 2] / found[who, 1])
        rates = ", ".join(
            f"{who} {found[who, 1]:.0f} and {found[who, 2]:.0f}" for who in ("sweep", "pool")
        )
        print(
            f"problems per second by one and by two: {rates}; two over one: "
            + ", ".join(f"{w} {r[-1]:.2f}" for w, r in ratios.items())
        )
    print(
        "two over one, medians: "
        + ", ".join(f"{who} {statistics.median(ratio):.2f}" for who, ratio in ratios.items())
    )


if __name__ == "__main__":
    main()
