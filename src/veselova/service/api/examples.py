"""Worked examples: the body of the first run, of ``veselova demo`` and of the OpenAPI document."""

from __future__ import annotations

from typing import Any

from veselova.mechanics.core.names import require_name

__all__ = [
    "BODY4",
    "BODY4_PROBLEM",
    "CURVE",
    "ENSEMBLE",
    "PROBLEMS",
    "THETA",
    "example_request",
]

#: A four-dimensional body with distinct A's, thrown so that no phase is slow (examples/body4.json
#: is this document).
BODY4_PROBLEM: dict[str, Any] = {
    "system": "veselova",
    "A": [3, 2, "1.5", 1],
    "q": ["0.5", "0.5", "0.5", "0.5"],
    "q_dot": ["1.1", "-0.7", "0.3", "-0.7"],
}

BODY4: dict[str, Any] = {"problem": BODY4_PROBLEM, "times": {"start": 0, "stop": 60, "count": 601}}

_SO3: dict[str, Any] = {
    "inertia": [1, 2, 3],
    "gamma": ["0.6", 0, "0.8"],
    "Omega": ["0.8", 1, "-0.6"],
}
_BALL: dict[str, Any] = {
    "inertia": ["0.4", "0.6", "0.9"],
    "mass": 1,
    "radius": 1,
    "gamma": ["0.6", 0, "0.8"],
}
_SPHERE: dict[str, Any] = {"A": [3, 2, 1], "q": ["0.6", 0, "0.8"]}

#: System → fields of a problem that ``veselova example`` prints and examples/ has.
PROBLEMS: dict[str, dict[str, Any]] = {
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

#: A curve of genus 2 with one point over a cut and one in a gap, and theta functions of its matrix.
CURVE: dict[str, Any] = {
    "branch_points": [0, 1, "1.7", 3, "4.5"],
    "points": ["1.2", 2],
    "w": [1, [0, 1]],
}
THETA: dict[str, Any] = {
    "z": [[0.1, [0, 0.2]], [0, 0]],
    "tau": [[[0.3, 0.9], 0.2], [0.2, [0, 1.1]]],
    "characteristic": [[0.5, 0], [0, 0.5]],
}

#: Two starts of one body.
ENSEMBLE: dict[str, Any] = {
    "A": [3, 2, 1],
    "starts": {
        "q": [[0.6, 0.48, 0.64], [0, 0.6, 0.8]],
        "q_dot": [[0.8, -0.36, -0.48], [1, 0.4, -0.3]],
    },
    "times": [0, 1000],
    "outputs": ["q", "tau1"],
}


def example_request(system: str) -> dict[str, Any]:
    """Return a request of a system for ``veselova solve``; raises InvalidInput for another name."""
    require_name(system, ("SYSTEM",), list(PROBLEMS))
    return {
        "problem": {"system": system, **PROBLEMS[system]},
        "times": {"start": 0, "stop": 20, "count": 201},
    }
