"""Results that stand for a version: a dozen motions in closed form at three times each, one at two,
with their errors.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from veselova import (
    EllipsoidGeodesic,
    NeumannSystem,
    SeparableVeselova,
    Veselova,
    VeselovaSO3,
    solve,
)
from veselova.mechanics.core.problem import Problem
from veselova.version import __version__

__all__ = ["FILE", "TIMES", "differences", "problems", "results", "text"]

FILE = Path(__file__).parent / "reference" / "fingerprint.json"

#: Nearby, past the first orbit, and far out, on either side of the start.
TIMES = (-7.25, 31.5, 4000.125)

_START = (["3", "2", "1.5"], ["0.6", "0", "0.8"], ["0.3", "1", "-0.225"])
_FOUR = (["3", "2", "1.5", "1"], ["0.5", "0.5", "0.5", "0.5"], ["0.5", "-0.5", "0.3", "-0.3"])


def problems() -> dict[str, Problem]:
    """Return the motions by name: every system with a closed form, regular and special ones."""
    body = Veselova(*_FOUR)
    return {
        "veselova, n = 2": Veselova(["2", "1"], ["0.6", "0.8"], ["0.4", "-0.3"]),
        "veselova, n = 3": Veselova(*_START),
        "veselova, n = 4": body,
        "veselova, n = 5": Veselova(
            [5, 4, 3, 2, 1], [1, 2, 3, 4, 5], [5, -3, 1, 2, -2], normalize=True
        ),
        "veselova, equal A's": Veselova([3, 2, 2, 1], *_FOUR[1:]),
        "veselova, in a subspace": Veselova(
            _FOUR[0], ["0.6", "0", "0.8", "0"], ["0.4", "0", "-0.3", "0"]
        ),
        "neumann, n = 3": NeumannSystem(*_START),
        "neumann, n = 4": NeumannSystem(*_FOUR),
        "ellipsoid-geodesic, n = 3": EllipsoidGeodesic(
            ["3", "2", "1"], [1, 2, -1], [2, 1, 1], normalize=True
        ),
        "ellipsoid-geodesic, n = 4": EllipsoidGeodesic(
            ["4", "3", "2", "1"], [1, 2, -1, 1], [2, 1, 1, -1], normalize=True
        ),
        "veselova-so3": VeselovaSO3(["1", "1.5", "2"], ["0.6", "0", "0.8"], ["0.8", "1", "-0.6"]),
        "veselova-so3, clebsch": VeselovaSO3(
            ["1", "1.5", "2"], ["0.6", "0", "0.8"], ["0.8", "1", "-0.6"], {"clebsch": "0.3"}
        ),
        "separable": SeparableVeselova(*_START, {"quadratic": "0.25"}),
    }


def results() -> dict[str, Any]:
    """Return, by name, the values of the bounded series and the errors at the three times."""
    found = {}
    for name, problem in problems().items():
        # far out the turn of a body in a potential takes a minute
        trajectory = solve(problem, TIMES[:2] if "clebsch" in name else TIMES)
        values = {
            series: trajectory.series(series).reshape(len(trajectory.times), -1).tolist()
            for series in problem.bounded
        }
        found[name] = {"series": values, "error": trajectory.error.tolist()}
    return found


def differences(stored: dict[str, Any], found: dict[str, Any]) -> list[str]:
    """Return one line for each series of ``found`` that leaves the stored one by more than both
    errors together.
    """
    lines = []
    for name in sorted(stored.keys() | found.keys()):
        old, new = (side.get(name, {"series": {}, "error": []}) for side in (stored, found))
        if old["series"].keys() != new["series"].keys():
            lines.append(
                f"{name}: series {sorted(old['series'])} have become {sorted(new['series'])}"
            )
            continue
        allowed = np.add(old["error"], new["error"])
        for series, values in old["series"].items():
            moved = np.max(np.abs(np.subtract(new["series"][series], values)), axis=1)
            if not np.all(moved <= allowed):
                lines.append(
                    f"{name}: {series} moved by {moved.tolist()}, errors together "
                    f"{allowed.tolist()}"
                )
    return lines


def text() -> str:
    """Return the fingerprint as it is stored, with the version that it holds for."""
    return (
        json.dumps({"version": __version__, "times": TIMES, "results": results()}, indent=1) + "\n"
    )
