"""Neumann's system for any value of F_0, in theta functions and integrated."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from conftest import slow
from deviations import agree
from veselova import NeumannSystem, solve

Generator = np.random.Generator

TIMES = np.array([-30.0, -2.0, 0.0, 0.7, 11.0, 30.0])

SPECIAL: dict[str, tuple[Any, Any, Any]] = {
    "turning-everywhere": ([1, 2, 3, 4], [0.5] * 4, [0] * 4),
    "through-the-pole": ([3, 2, 1], [1, 0, 0], [0, 0.5, 0.3]),
    "from-the-unstable-pole": ([3, 2, 1], [0, 0, 1], [0.5, 0.5, 0]),
    "planar": ([3, 2, 1], [0.6, 0, 0.8], [0, 0, 0]),
    "symmetric": ([2, 2, 1], [0.48, 0.6, 0.64], [0.1, 0.3, 0.2]),
    "isotropic": ([2, 2, 2], [0.48, 0.6, 0.64], [0.1, 0.3, 0.2]),
    "fast": ([1, 2, 3, 4], [0.5] * 4, [30, -30, 10, -10]),
    "slow": ([1, 2, 3, 4], [0.5] * 4, [1e-9, -1e-9, 0, 0]),
    "wide": ([1e-3, 1, 1e3], [0.6, 0.48, 0.64], [1, 1, 1]),
    "circle": ([2, 1], [0.8, 0.6], [-0.9, 1.2]),
}


def drawn(rng: Generator, n: int) -> NeumannSystem:
    """Velocities from slow to fast: c_1 < I_1, c_1 > I_1 and c_1 < 0 all occur."""
    A = np.exp(rng.uniform(0, np.log(5), n))
    return NeumannSystem(
        A, rng.normal(size=n), rng.normal(size=n) * rng.choice([0.1, 0.6, 3.0]), normalize=True
    )


@pytest.mark.parametrize("n", [2, 3, 4, *map(slow, range(5, 8))])
@pytest.mark.parametrize("method", ["theta", "angles"])
def test_the_closed_form_agrees_with_integration(n: int, method: str, rng: Generator) -> None:
    for _ in range(5):
        problem = drawn(rng, n)
        closed = solve(problem, TIMES, method=method)
        found = solve(problem, TIMES, "numeric", "taylor")
        agree(closed, found, "frame")
        assert np.max(closed.error) <= 1e-11 * max(1.0, problem.turning)
        assert np.allclose(closed.q_prime, found.q_prime, atol=1e-10 * problem.turning)
        assert np.allclose(closed.spheroconic, found.spheroconic, atol=1e-10)


@pytest.mark.parametrize("name", sorted(SPECIAL))
def test_special_starts_are_served(name: str) -> None:
    A, q, v = SPECIAL[name]
    problem = NeumannSystem(A, q, v, normalize=True)
    closed, found = solve(problem, TIMES / 3), solve(problem, TIMES / 3, "numeric", "taylor")
    agree(closed, found, "frame")
    assert np.max(closed.error) < 1e-11


def test_a_point_at_an_eigenvector_rests() -> None:
    for engine in ("analytic", "numeric"):
        found = solve(NeumannSystem([3, 2, 1], [0, 1, 0], [0, 0, 0]), TIMES, engine)
        assert np.array_equal(found.q, np.tile([0.0, 1, 0], (TIMES.size, 1)))


def test_neumann_time_costs_the_same_anywhere(rng: Generator) -> None:
    problem = drawn(rng, 3)
    far = solve(problem, [1e9])
    assert far.provenance.details["time_map"] == "uniform"
    assert far.error[0] < 1e-6
    near = solve(problem, [10.0])
    turned = NeumannSystem(problem.A, near.q[0], near.q_prime[0], normalize=True)
    assert np.allclose(solve(turned, [-10.0]).q[0], problem.q, atol=1e-13)


@pytest.mark.daily(3)
@pytest.mark.parametrize("n", [2, 4, 6])
def test_integrals_are_conserved(n: int, rng: Generator) -> None:
    times = np.linspace(0, 100, 21)
    problem = drawn(rng, n)
    assert max(solve(problem, times).drift.values()) <= 1e-13
    assert max(solve(problem, times, "numeric", "taylor").drift.values()) <= 1e-12
    assert max(solve(problem, times, "numeric").drift.values()) <= 1e-10


@pytest.mark.parametrize("n", [2, 3, 4])
def test_a_far_time_beside_it_does_not_change_a_near_one(n: int) -> None:
    """Beyond 200 cycles frequencies have guard digits; c_1 may be negative here, and had lost its
    sign on the way to them.
    """
    rng = np.random.default_rng(n)
    for _ in range(4):
        problem = NeumannSystem(
            rng.uniform(1, 4, n), rng.normal(size=n), rng.normal(size=n), normalize=True
        )
        far, near = solve(problem, [10.0, 1e4]), solve(problem, [10.0])
        assert np.max(np.abs(far.q[0] - near.q[0])) <= far.error[0] + near.error[0]
        integrated = solve(problem, [10.0], engine="numeric")
        assert np.max(np.abs(far.q[0] - integrated.q[0])) <= far.error[0] + integrated.error[0]
