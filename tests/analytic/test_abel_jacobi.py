"""The Abel–Jacobi map in real angles, both ways, and the start of a motion on its torus."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from draws import random_problem
from problems import tagged
from veselova.analytic.arithmetic.balls import balls
from veselova.analytic.closed.start import start_of
from veselova.analytic.curve.branch_points import spectrum
from veselova.analytic.curve.hyperelliptic import Curve
from veselova.analytic.curve.moving_part import moving_part
from veselova.analytic.curve.periods import AbelInDoubles, AbelJacobi, Periods

DIMENSIONS = (2, 3, 5, 8)


def map_in_balls(problem: Any, digits: int) -> AbelJacobi:
    xp, start = balls(digits, False), start_of(spectrum(moving_part(problem), digits))
    return AbelJacobi(Periods(Curve(xp, start.points, start.d)))


def map_of(problem: Any) -> AbelInDoubles:
    inversion = map_in_balls(problem, 18)
    with inversion.arithmetic:
        return inversion.in_doubles


@pytest.mark.parametrize("n", DIMENSIONS)
def test_inversion_undoes_the_map(n: int, rng: np.random.Generator) -> None:
    for _ in range(5):
        inversion = map_of(random_problem(rng, n))
        psi = rng.uniform(-10, 10, (40, n - 1))
        assert np.max(np.abs(inversion.invert(inversion.at(psi)[0]) - psi)) < 1e-12
        z = rng.uniform(-3, 3, (40, n - 1))
        assert np.max(np.abs(inversion.at(inversion.invert(z))[0] - z)) < 2e-14


@pytest.mark.parametrize("n", [3, 5])
def test_the_jacobian_is_the_derivative_of_the_map(n: int, rng: np.random.Generator) -> None:
    inversion = map_of(random_problem(rng, n))
    psi, step = rng.uniform(0, 6, (10, n - 1)), 1e-6
    jacobian = inversion.at(psi)[1]
    for s in range(n - 1):
        e = np.eye(n - 1)[s] * step
        difference = (inversion.at(psi + e)[0] - inversion.at(psi - e)[0]) / (2 * step)
        assert np.allclose(jacobian[:, :, s], difference, atol=1e-8)


@pytest.mark.parametrize("n", DIMENSIONS)
def test_branch_points_lie_at_half_periods(n: int, rng: np.random.Generator) -> None:
    inversion = map_of(random_problem(rng, n))
    psi = np.pi * rng.integers(-3, 4, (20, n - 1))
    assert np.allclose(inversion.at(psi)[0], psi / (2 * np.pi), atol=1e-14)


def test_the_map_is_quasi_periodic_and_odd(rng: np.random.Generator) -> None:
    inversion = map_of(random_problem(rng, 4))
    psi = rng.uniform(0, 6, (20, 3))
    assert np.allclose(
        inversion.at(psi + 2 * np.pi * np.array([1, 0, -2]))[0],
        inversion.at(psi)[0] + np.array([1, 0, -2]),
        atol=1e-13,
    )
    assert np.allclose(inversion.at(-psi)[0], -inversion.at(psi)[0], atol=1e-14)


def test_an_inversion_in_balls_starts_from_the_double_one(rng: np.random.Generator) -> None:
    problem = tagged("generic")[1].problem()
    precise = map_in_balls(problem, 40)
    with precise.arithmetic as xp:
        z = xp.array(rng.uniform(-1, 1, (3, 2)))
        rest = precise.map(precise.invert(z)) - z
    assert all(x.contains(0) for x in rest.ravel())
    # boxes shrink from those of half the digits
    assert max(float(abs(x).upper()) for x in rest.ravel()) < 1e-22


@pytest.mark.parametrize("signs", [(1, 1, 1), (-1, 1, 1), (1, -1, 1), (-1, -1, -1)])
@pytest.mark.parametrize("q_dot", [[0, 1, 0.5], [0, -1, 0.5], [0, 1, -0.5]])
def test_a_start_on_an_axis_takes_its_signs_from_the_velocity(signs: Any, q_dot: Any) -> None:
    from veselova import Veselova, solve

    problem = Veselova([3, 2, 1], np.array([1, 0, 0]) * signs[0], np.array(q_dot) * signs)
    step = 1e-4
    q = solve(problem, [step]).q[0]
    assert np.allclose(q, problem.q + step * problem.q_dot, atol=1e-7)
