"""Starts at which closed forms usually fail, n = 2…8, against the same chain in ball arithmetic.

    python benchmarks/adversarial.py [starts] [seed] [seconds for one truth]      default 1000, 1, 5

Closed and nearly closed cuts and gaps (relative widths from 1 to 1e-300, and exactly zero), equal A's, coordinate subspaces, A's
over twelve orders of magnitude, speeds from 1e-150 to 1e150; one start in four to ten radians or twenty cycles of the fastest
phase, the others to three tenths of that. Truth has 20 digits, in balls, within so many seconds of processor time, or 34
from Neumann's equations in binary128, within a few thousand steps, whichever is tried first (FIRST_INTEGRATED). Prints
per class how many there were and how many could not be solved, the largest true error of the frame, the largest reported one,
and the largest true error over the one reported at the same time (at most 1); then the starts that broke a promise.
"Without truth" are those for which neither truth could be had. Ctrl-C prints what has been seen.
"""

from __future__ import annotations

import multiprocessing
import signal
import sys
import warnings
from collections import defaultdict
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import veselova as vs
from veselova.analytic.solution import Solution

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

from draws import CLASSES, adversarial_start
from truth import true_motion

DIGITS = 20

#: Steps of an integration in binary128: half a minute at n = 8.
STEPS = 3000

#: Classes at which balls need longer than integration.
FIRST_INTEGRATED = ("near a separatrix", "separatrix", "wide A's")


def time_unit(problem: vs.Veselova) -> float:
    """Return the time of a radian of turning, or of two cycles of the fastest phase where that is shorter."""
    fastest = float(np.max(np.abs(Solution(problem).in_time.rates)))
    return min(1 / float(np.max(np.abs(problem.q_dot))), 2 / fastest)


def measured(i: int, seed: int, patience: int) -> tuple[int, str, int, Any]:
    """Return (i, class, n, answer): (true error, reported error, largest ratio), None without truth, or what failed."""
    rng = np.random.default_rng([seed, i])
    n = 2 + i % 7
    name, problem = adversarial_start(rng, n)
    try:
        with warnings.catch_warnings(action="error"):
            times = np.array([-10, -3, 0, 0.1, 1, 4, 10]) * time_unit(problem) * (1.0 if i % 4 == 0 else 0.3)
            found = vs.solve(problem, times)
    except Exception as error:
        return i, name, n, f"{type(error).__name__}: {error}"[:150]
    try:
        frame = true_frame(name, problem, times, patience)
    except Exception as error:
        return i, name, n, f"the truth, {type(error).__name__}: {error}"[:150]
    if frame is None:
        return i, name, n, None
    off = np.max(np.abs(found.frame - frame), axis=(1, 2))
    return i, name, n, (float(np.max(off)), float(np.max(found.error)), float(np.max(off / found.error)))


def true_frame(name: str, problem: vs.Veselova, times: Any, patience: int) -> Any:
    """Return the frames in balls or in binary128, whichever can be had, or None."""
    ways: list[Callable[[], Any]] = [
        lambda: _within(patience, lambda: vs.solve(problem, times, digits=DIGITS).frame),
        lambda: true_motion(problem, times, most_steps=STEPS)[0],
    ]
    for way in reversed(ways) if name in FIRST_INTEGRATED else ways:
        try:
            return way()
        except (TimeoutError, vs.Unsolved):
            continue
    return None


def _within(seconds: int, call: Callable[[], Any]) -> Any:
    signal.signal(signal.SIGPROF, _give_up)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        return call()
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)


def _give_up(*_: object) -> None:
    raise TimeoutError


def main(count: int, seed: int, patience: int) -> None:
    rows: dict[str, list[tuple[float, float, float]]] = defaultdict(list)
    failures: dict[str, int] = defaultdict(int)
    unverified: dict[str, int] = defaultdict(int)
    broken = []
    with multiprocessing.get_context("fork").Pool(initializer=signal.signal, initargs=(signal.SIGINT, signal.SIG_IGN)) as pool:
        try:
            for i, name, n, answer in pool.imap_unordered(partial(measured, seed=seed, patience=patience), range(count)):
                if answer is None:
                    unverified[name] += 1
                elif isinstance(answer, str):
                    failures[name] += 1
                    broken.append((i, name, n, answer))
                else:
                    rows[name].append(answer)
                    if answer[2] > 1:
                        broken.append((i, name, n, f"error/reported {answer[2]:.3g}, error {answer[0]:.3g}"))
        except KeyboardInterrupt:
            pool.terminate()
    print("class                    starts   failures   without truth   largest error   largest reported   error/reported")
    for name in CLASSES:
        errors, reported, ratios = np.array(rows[name]).reshape(-1, 3).T if rows[name] else np.zeros((3, 1))
        total = len(rows[name]) + failures[name] + unverified[name]
        figures = f"{np.max(errors):13.1e}   {np.max(reported):16.1e}   {np.max(ratios):14.2f}"
        print(f"{name:22s}   {total:6d}   {failures[name]:8d}   {unverified[name]:13d}   {figures}")
    for item in broken:
        print(*item)


if __name__ == "__main__":
    main(*(int(x) for x in (*sys.argv[1:], *("1000", "1", "5")[len(sys.argv) - 1 :])))
