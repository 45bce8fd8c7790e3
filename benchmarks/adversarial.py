"""Starts at which closed forms usually fail, against 20 digits, binary128 or integration; of every
system with a closed form.

    python benchmarks/adversarial.py [starts] [seed] [seconds for one truth] [system]      default
    1000, 1, 5, veselova

Closed and nearly closed cuts and gaps (relative widths from 1 to 1e-300, and exactly zero), equal
A's, coordinate subspaces, A's over twelve orders of magnitude, speeds and entries from 1e-300 to
1e300, rest, equilibria, degenerate potentials; n = 2…8. One start in four to ten radians or twenty
cycles of the fastest phase, the others to three tenths of that. Truth of tori has 20 digits, in
balls, within so many seconds of processor time, or 34 from Neumann's equations in binary128, within
a few thousand steps, whichever is tried first (FIRST_INTEGRATED). Where neither serves, with
potentials, the closed form is compared with heyoka's Taylor series: the difference, against the sum
of both errors.
Prints per class how many there were, how many were refused by name and how many failed, the largest
true error of the bounded series, the largest reported one, the median and the largest of reported
over true errors, and the largest true error over the one reported at the same time (at most 1);
then the starts that broke a promise. "Without truth" are those for which none could be had. A true
error counts as half a unit in the last place of the largest number there at least. Ctrl-C prints
what has been seen.
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
from veselova.mechanics.core.problem import Problem

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

from verdict import against_truth, time_unit

from draws import CLASSES, adversarial_start
from system_draws import CLASSES_OF, adversarial_system, pessimism

#: Seconds for one answer, beyond which it is a refusal: theta functions of genus seven beside
#: separatrices take minutes.
BUDGET_S = 30.0

#: What a start ended in besides figures.
REFUSED, NO_TRUTH = "refused", "without truth"


def drawn(rng: np.random.Generator, system: str, n: int) -> tuple[str, Callable[[], Problem]]:
    """Return the class of a start, and what makes it."""
    if system != "veselova":
        return adversarial_system(rng, system, n)
    name, problem = adversarial_start(rng, n)
    return name, lambda: problem


def measured(i: int, seed: int, patience: int, system: str) -> tuple[int, str, int, Any]:
    """Return (i, class, n, answer): (true error, reported error, reported/true, largest
    true/reported), or how it ended.
    """
    rng = np.random.default_rng([seed, i])
    n = 2 + i % 7
    name, make = drawn(rng, system, n)
    try:
        with warnings.catch_warnings(action="error"):
            problem = make()
            parts = np.array([-10, -3, 0, 0.1, 1, 4, 10]) * (1.0 if i % 4 == 0 else 0.3)
            times = parts * time_unit(problem)
            found = vs.solve(problem, times, "analytic", budget_s=BUDGET_S)
    except (vs.InvalidInput, vs.Unsolved, vs.OverBudget) as refusal:
        return i, name, n, (REFUSED, str(refusal))
    except Exception as error:
        return i, name, n, f"{type(error).__name__}: {error}"[:150]
    try:
        off, allowed = against_truth(name, found, patience)
    except (TimeoutError, vs.Unsolved):
        return i, name, n, (NO_TRUTH, "")
    except Exception as error:
        return i, name, n, f"the truth, {type(error).__name__}: {error}"[:150]
    figures = (
        np.max(off),
        np.max(found.error),
        pessimism(found, off),
        np.max(off / allowed),
    )
    return i, name, n, tuple(float(x) for x in figures)


def main(count: int, seed: int, patience: int, system: str) -> None:
    rows: dict[str, list[tuple[float, float, float, float]]] = defaultdict(list)
    ended: dict[tuple[str, str], int] = defaultdict(int)
    broken = []
    task = partial(measured, seed=seed, patience=patience, system=system)
    with multiprocessing.get_context("fork").Pool(
        initializer=signal.signal, initargs=(signal.SIGINT, signal.SIG_IGN)
    ) as pool:
        try:
            for i, name, n, answer in pool.imap_unordered(task, range(count)):
                if isinstance(answer, str):
                    ended[name, "failed"] += 1
                    broken.append((i, name, n, answer))
                elif isinstance(answer[0], str):
                    ended[name, answer[0]] += 1
                else:
                    rows[name].append(answer)
                    if not answer[3] <= 1:
                        broken.append(
                            (i, name, n, f"true/reported {answer[3]:.3g}, error {answer[0]:.3g}")
                        )
        except KeyboardInterrupt:
            pool.terminate()
    print(
        f"{system:28s} starts  refused  failed  without truth  largest error  largest "
        "reported  reported/true        largest  true/reported"
    )
    for name in CLASSES if system == "veselova" else CLASSES_OF[system]:
        others = [ended[name, how] for how in (REFUSED, "failed", NO_TRUTH)]
        errors, reported, pessimism, ratios = (
            np.array(rows[name]).reshape(-1, 4).T if rows[name] else np.zeros((4, 1))
        )
        figures = (
            f"{np.max(errors):13.1e}  {np.max(reported):16.1e}  {np.median(pessimism):13.1f}  "
            f"{np.max(pessimism):13.4g}  {np.max(ratios):13.2f}"
        )
        print(
            f"{name:28s} {len(rows[name]) + sum(others):6d}  {others[0]:7d}  {others[1]:6d}  "
            f"{others[2]:13d}  {figures}"
        )
    for item in broken:
        print(*item)


if __name__ == "__main__":
    starts, first, seconds, chosen = (
        *sys.argv[1:],
        *("1000", "1", "5", "veselova")[len(sys.argv) - 1 :],
    )
    main(int(starts), int(first), int(seconds), chosen)
