"""Chaplygin's ball: two formulations against its own equations, its integrals, every door."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import veselova as vs
from conftest import slow
from deviations import apart
from rolling_truth import roll
from veselova import ChaplyginBall

TIMES = np.linspace(0, 20, 9)
DATA: dict[str, Any] = {
    "inertia": [1, 1.5, 2],
    "mass": 0.7,
    "radius": 0.6,
    "gamma": [0.6, 0, 0.8],
    "Omega": [0.8, 1, -0.3],
}


@pytest.mark.parametrize("formulation", ChaplyginBall.formulations)
@pytest.mark.parametrize(
    "inertia", [[1, 1.5, 2], [1, 1, 1.5], [[2, 0.3, 0], [0.3, 1.5, 0.1], [0, 0.1, 1.7]]]
)
@pytest.mark.parametrize("seed", [0, slow(1), slow(2)])
def test_it_rolls_as_the_ball_itself_does(formulation: str, inertia: Any, seed: int) -> None:
    gamma, Omega = np.random.default_rng(seed).normal(size=(2, 3))
    problem = ChaplyginBall(inertia, 0.7, 0.6, gamma, Omega, position=(1, -2), normalize=True)
    true = roll(problem, TIMES)
    found = vs.solve(problem, TIMES, "numeric", formulation=formulation)
    assert found.provenance.engine == "numeric"
    assert np.all(apart(found, true, ("frame", "position", "velocity", "force")) < 1e-10)
    assert np.all(apart(found, true, problem.bounded) <= found.error + 1e-11)
    assert max(found.drift.values()) < 1e-12


def test_across_its_horizontal_momentum_it_goes_on_uniformly_in_the_mean() -> None:
    """With (K,γ) = 0 the motion across the horizontal momentum is a·2h/|K|, exactly."""
    gamma = np.array(DATA["gamma"])
    Omega = np.array([0.8, 1, -0.3])
    inertia = np.diag(DATA["inertia"])
    Omega -= (gamma @ inertia @ Omega) / (gamma @ inertia @ gamma) * gamma
    problem = ChaplyginBall(**{**DATA, "Omega": Omega})
    found = vs.solve(problem, np.linspace(0, 50, 101))
    momentum = found.integrals["space_momentum"][0]
    across = np.cross(momentum, [1, 0, 0])[1:] / np.linalg.norm(momentum)
    speed = 0.6 * 2 * found.integrals["energy"][0] / np.linalg.norm(momentum)
    assert abs(found.integrals["area"][0]) < 1e-15
    assert np.max(np.abs(found.position @ across - speed * found.times)) < 1e-10


@pytest.mark.daily(3)
@pytest.mark.parametrize("mass", ["1e-6", "1e4", "1e8", "1e12"])
def test_a_heavy_ball_loses_no_digit_and_its_errors_say_so(mass: str) -> None:
    """One with ma² far above its moments, or below: (BK,γ) and integrals over τ₁ are small."""
    problem = ChaplyginBall(
        ["1", "1.4", "2"], mass, "1", ["2/7", "3/7", "6/7"], ["0.3", "-0.7", "0.9"]
    )
    times = np.linspace(0, 50, 3001)
    some = [0, 60, 600, 3000]
    exact = vs.solve(problem, times[some], digits=30)
    answers = [
        (vs.solve(problem, times), some, 1e-12),
        (vs.solve(problem, times[some]), ..., 1e-12),
    ]
    for formulation in problem.formulations:
        found = vs.solve(problem, times[some], "numeric", formulation=formulation)
        answers.append((found, ..., 1.5e-11))
    for found, rows, pace in answers:
        off = np.max(np.abs(found.frame[rows] - exact.frame), axis=(1, 2))
        off = np.maximum(off, np.max(np.abs(found.position[rows] - exact.position), axis=1))
        assert np.all(off <= found.error[rows])
        assert np.all(found.error[rows] < 1e-12 + pace * times[some])
        assert np.max(np.abs(found.Omega[rows] - exact.Omega)) < 1e-12
    written = vs.closed_form(problem).at(times[some])
    assert np.max(np.abs(written.Omega - exact.Omega)) < 1e-12
