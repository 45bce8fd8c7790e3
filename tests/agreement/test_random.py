"""A random problem of every system, drawn by the date: two engines, or two formulations where there
is one engine, agree within their errors. ./check --sweep draws two hundred of each.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import veselova as vs
from conftest import DAY
from draws import random_problem
from lr_draws import random_lr
from problems import BallCaseN, BodyCase
from stiefel_draws import random_flow
from veselova.mechanics.systems import catalogue

Rng = np.random.Generator


def tangent(rng: Rng, n: int) -> tuple[Any, Any]:
    """Return a unit vector, and a vector of length near 1 across it."""
    q, v = rng.normal(size=(2, n))
    q /= np.linalg.norm(q)
    return q, (v - (v @ q) * q) / np.sqrt(n)


def moments(rng: Rng) -> list[float]:
    """Return three moments that a body may have."""
    return [float(x) for x in rng.uniform(1, 2, 3)]


def ball(rng: Rng, system: str) -> Any:
    n = int(rng.integers(3, 6))
    gamma, turning = rng.normal(size=(2, n))
    if n == 3:
        return BodyCase("random", moments(rng), gamma, turning).problem(system)
    A = rng.uniform(0.5, 1.5, n).tolist()
    return BallCaseN("random", A, gamma, turning, share=rng.uniform(0.1, 0.9)).problem(system)


def geodesic(rng: Rng) -> Any:
    A, (X, X_dot) = rng.uniform(0.5, 4, (n := int(rng.integers(3, 6)))), tangent(rng, n)
    return vs.EllipsoidGeodesic(A, X, X_dot, normalize=True)


def separable(rng: Rng) -> Any:
    n = int(rng.integers(3, 6))
    quartic, quadratic = rng.uniform(-0.5, 0.5, 2)
    walls = rng.uniform(0, 0.01, n).tolist()
    potential = {"quartic": quartic, "quadratic": quadratic, "centrifugal": walls}
    return vs.SeparableVeselova(rng.uniform(0.5, 2, n), *tangent(rng, n), potential, normalize=True)


SYSTEMS: dict[str, Callable[[Rng], Any]] = {
    "veselova": lambda rng: random_problem(rng, int(rng.integers(2, 8)), 30.0),
    "neumann": lambda rng: vs.NeumannSystem(
        rng.uniform(0.5, 4, 4), *tangent(rng, 4), normalize=True
    ),
    "ellipsoid-geodesic": geodesic,
    "veselova-so3": lambda rng: vs.VeselovaSO3(
        moments(rng), *tangent(rng, 3), {"clebsch": rng.uniform(-0.5, 0.5)}, normalize=True
    ),
    "rubber-ball": lambda rng: ball(rng, "rubber-ball"),
    "chaplygin-ball": lambda rng: ball(rng, "chaplygin-ball"),
    "separable": separable,
    "euler-poisson": lambda rng: vs.EulerPoisson(
        moments(rng), tangent(rng, 3)[0], rng.normal(size=3), {"clebsch": rng.uniform(-0.5, 0.5)}
    ),
    "lr": lambda rng: random_lr(rng, 4, int(rng.integers(1, 4))),
    "stiefel": lambda rng: random_flow(rng, 4, 2, "special"),
}


@pytest.mark.parametrize(
    "day", [DAY, *(pytest.param(DAY + k, marks=pytest.mark.sweep) for k in range(1, 200))]
)
@pytest.mark.parametrize("system", catalogue.SYSTEMS)
def test_two_ways_to_a_random_motion_agree_within_their_errors(system: str, day: int) -> None:
    rng = np.random.default_rng([day, *system.encode()])
    problem = SYSTEMS[system](rng)
    times = np.sort(rng.uniform(-20, 20, 8)) / problem.turning
    found = vs.compare(problem, times)
    assert found.agrees, problem.as_dict()
    for motion in (found.first, found.second):
        assert np.max(motion.error) < 1e-6, problem.as_dict()
        assert max(motion.drift.values()) < 1e-8, problem.as_dict()
