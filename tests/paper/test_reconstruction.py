"""Theorem recon0: every motion over one q(t), the rotation ℜ that tells them apart, and the
integrals on the distribution D.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from draws import random_problem
from paper.reconstruction import (
    frames_over,
    linear_integrals,
    natural_frames,
    rotation,
    with_rotation,
)
from veselova import Veselova, solve
from veselova.mechanics.geometry import integrals_of_motion as integrals
from veselova.mechanics.geometry.natural_frame import natural_frame

DIMENSIONS = range(2, 8)
TIMES = np.array([-7.0, -0.5, 0.0, 2.0, 9.0])


def random_rotation(rng: np.random.Generator, size: int) -> Any:
    return np.linalg.qr(rng.normal(size=(size, size)))[0]


@pytest.mark.parametrize("engine", ["analytic", "numeric"])
@pytest.mark.parametrize("n", range(2, 6))
def test_every_motion_over_a_trajectory_solves_the_poisson_equations(
    n: int, engine: str, rng: np.random.Generator
) -> None:
    """(orth): the turned frames are what either engine finds when it starts from the turned frame,
    determinant −1 included.
    """
    problem, matrix = random_problem(rng, n, 10.0), random_rotation(rng, n - 1)
    for R in (matrix, matrix @ np.diag([-1.0] + [1.0] * (n - 2))):
        found = frames_over(solve(problem, TIMES), R)
        turned = with_rotation(problem, R)
        expected = solve(turned, TIMES, engine)
        assert np.max(np.abs(found - expected.frame)) < 1e-10
        assert np.allclose(rotation(turned), R, atol=1e-12)
        assert np.allclose(turned.q_dot, problem.q_dot, atol=1e-15)


@pytest.mark.parametrize("n", range(2, 6))
def test_the_natural_frame_is_carried_on_and_is_that_of_the_state_up_to_signs(
    n: int, rng: np.random.Generator
) -> None:
    """Theorem recon0 itself: the eigenvectors of A⁻¹ − q'q'ᵀ on q⊥ at any time, and (norms) ṅ_k =
    −ωn_k.
    """
    problem = random_problem(rng, n, 10.0)
    trajectory = solve(problem, TIMES)
    carried = natural_frames(trajectory)
    for E, q, q_dot in zip(carried, trajectory.q, trajectory.q_dot, strict=True):
        signs = np.diag(natural_frame(problem.A, q, q_dot).T @ E)
        assert np.allclose(np.abs(signs), 1.0, atol=1e-9)
    step = 1e-5
    near = natural_frames(solve(problem, [-step, 0.0, step]))
    omega = np.outer(problem.q, problem.q_dot) - np.outer(problem.q_dot, problem.q)
    assert np.allclose((near[2] - near[0]) / (2 * step), -omega @ near[1], atol=1e-7)


@pytest.mark.parametrize("n", DIMENSIONS)
def test_linear_integrals_are_constant_and_their_squares_add_up_to_those_of_the_momentum(
    n: int, rng: np.random.Generator
) -> None:
    """l_k = ⟨𝓘ω,e_1∧e_k⟩ = (p,γ)ℜ_{n−1,k}, Σ l_k² = (p,p) = 2h c_2⋯c_{n−1}."""
    problem = random_problem(rng, n, 10.0)
    found = linear_integrals(solve(problem, TIMES))
    p = integrals.momentum(problem.A, problem.q, problem.q_dot)
    assert np.allclose(found, found[2], rtol=1e-9, atol=1e-11 * np.linalg.norm(p))
    assert np.allclose(np.sum(found**2, axis=1), p @ p, rtol=1e-10)
    assert np.isclose(p @ p, 2 * problem.energy * np.prod(problem.constants), rtol=1e-9)
    gamma = natural_frames(solve(problem, [0.0]))[0, :, -1]
    assert np.isclose(abs(p @ gamma), np.linalg.norm(p), rtol=1e-9)
    assert np.allclose(found[2], (p @ gamma) * rotation(problem)[-1], atol=1e-9 * np.linalg.norm(p))


@pytest.mark.parametrize("n", [3, 4, 5])
def test_the_distribution_has_as_many_independent_integrals_as_its_tori_leave(
    n: int, rng: np.random.Generator
) -> None:
    """dim D = n−1 + n(n−1)/2. h, c_k: n−1. With ℜ: n(n−1)/2 in all, so tori of dimension n−1. With
    l_k alone: n−2 more.
    """
    problem, step = random_problem(rng, n, 5.0), 1e-6
    pairs = [(i, j) for i in range(n) for j in range(i + 1, n)]

    def values(x: Any) -> tuple[Any, Any, Any]:
        """Integrals at the state turned by the n(n−1)/2 first and moved along q̇ by the n−1 last
        components of x.
        """
        skew = np.zeros((n, n))
        for value, (i, j) in zip(x, pairs, strict=False):
            skew[i, j], skew[j, i] = value, -value
        E = np.linalg.inv(np.eye(n) - skew / 2) @ (np.eye(n) + skew / 2) @ problem.frame
        q_dot = E[:, 1:] @ (problem.frame[:, 1:].T @ problem.q_dot + x[len(pairs) :])
        moved = Veselova(problem.A, E[:, 0], q_dot, E, normalize=True)
        reduced = np.append(moved.constants, moved.energy)
        p = integrals.momentum(moved.A, moved.q, moved.q_dot)
        return reduced, E[:, 1:].T @ p, rotation(moved).ravel()

    columns = np.eye(len(pairs) + n - 1)
    slopes = [
        [(a - b) / (2 * step) for a, b in zip(values(step * e), values(-step * e), strict=True)]
        for e in columns
    ]
    reduced, linear, turned = (np.array([row[k] for row in slopes]) for k in range(3))

    def rank(*parts: Any) -> int:
        return int(np.linalg.matrix_rank(np.concatenate(parts, axis=1), tol=1e-4))

    assert rank(reduced) == n - 1
    assert rank(reduced, linear) == n - 1 + n - 2
    assert rank(reduced, turned) == n - 1 + (n - 1) * (n - 2) // 2 == n * (n - 1) // 2
    assert rank(reduced, linear, turned) == n * (n - 1) // 2
