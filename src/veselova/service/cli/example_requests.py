"""A request of every system that runs, for ``veselova example``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from veselova.mechanics.core.names import require_name
from veselova.service.api.examples import BODY4_PROBLEM

__all__ = ["PROBLEMS", "example_request"]

_SO3 = {"inertia": [1, 2, 3], "gamma": ["0.6", 0, "0.8"], "Omega": ["0.8", 1, "-0.6"]}
_BALL = {"inertia": ["0.4", "0.6", "0.9"], "mass": 1, "radius": 1, "gamma": ["0.6", 0, "0.8"]}
_SPHERE = {"A": [3, 2, 1], "q": ["0.6", 0, "0.8"]}

#: System → fields of a problem.
PROBLEMS: Mapping[str, Mapping[str, Any]] = {
    "veselova": BODY4_PROBLEM,
    "neumann": {**_SPHERE, "q_prime": ["0.8", "0.5", "-0.6"]},
    "ellipsoid-geodesic": {
        "A": [3, 2, 1],
        "X": [1, 1, 1],
        "X_dot": [1, -1, "0.2"],
        "normalize": True,
    },
    "veselova-so3": {**_SO3, "potential": {"clebsch": "0.5"}},
    "rubber-ball": {**_BALL, "Omega": ["0.8", 1, "-0.6"]},
    "chaplygin-ball": {**_BALL, "Omega": ["0.8", 1, "-0.3"]},
    "stiefel": {
        "inertia": {"special": [3, 2, "1.5", 1]},
        "X": [[1, 0], [0, 1], [0, 0], [0, 0]],
        "X_dot": [[0, -1], [1, 0], ["0.5", "-0.3"], [-1, "0.7"]],
    },
    "euler-poisson": {**_SO3, "potential": {"clebsch": "0.5"}},
    "lr": {
        "n": 4,
        "rank": 2,
        "inertia": {"special": [3, 2, "1.5", 1]},
        "omega": [
            [0, 1, "0.5", -1],
            [-1, 0, "0.3", "0.7"],
            ["-0.5", "-0.3", 0, 0],
            [1, "-0.7", 0, 0],
        ],
        "homogeneous": True,
    },
    "separable": {
        **_SPHERE,
        "q_dot": ["0.8", "0.5", "-0.6"],
        "potential": {"quadratic": "0.5"},
    },
}


def example_request(system: str) -> dict[str, Any]:
    """Return a request of a system for ``veselova solve``; raises InvalidInput for another name."""
    require_name(system, ("SYSTEM",), list(PROBLEMS))
    return {
        "problem": {"system": system, **PROBLEMS[system]},
        "times": {"start": 0, "stop": 20, "count": 201},
    }
