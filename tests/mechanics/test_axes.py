"""Axes given as a matrix, in any order or reflected: no motion depends on the orientation that an
eigensolver or a sort picks.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from deviations import agree
from veselova import (
    EllipsoidGeodesic,
    InvalidInput,
    NeumannSystem,
    SeparableVeselova,
    Veselova,
    VeselovaSO3,
    solve,
)

#: Matrices for each system, and the times of their motions.
DRAWS = 24
TIMES = [-0.7, 1.1]


def orthogonal(rng: np.random.Generator, n: int) -> Any:
    """Return a random orthogonal matrix: every other one is a reflection."""
    return np.linalg.qr(rng.normal(size=(n, n)))[0]


def tensors(rng: np.random.Generator, *sizes: int) -> Iterator[tuple[Any, Any, Any]]:
    """Yield orthogonal matrices Q, diagonals D within a factor of 5, and Q D Qᵀ, symmetric, of the
    sizes in turn.
    """
    for k in range(DRAWS):
        n = sizes[k % len(sizes)]
        turn, values = orthogonal(rng, n), np.exp(rng.uniform(0, np.log(5), n))
        tensor = turn @ np.diag(values) @ turn.T
        yield turn, values, (tensor + tensor.T) / 2


def start(rng: np.random.Generator, n: int) -> tuple[Any, Any]:
    """Return a unit vector and a unit tangent."""
    q, v = orthogonal(rng, n)[:, :2].T
    return q, v


def test_a_body_whose_eigenvectors_are_a_reflection_runs_forwards() -> None:
    problem = VeselovaSO3([[1, 0.5, 0], [0.5, 1, 0], [0, 0, 2]], [0.6, 0, 0.8], [0.8, 1, -0.6])
    for engine in ("analytic", "numeric"):
        trajectory = solve(problem, [1.0], engine)
        assert np.max(np.abs(trajectory.gamma[0] - [-0.323967005, 0.834201826, 0.446265271])) < 1e-9
    assert np.isclose(np.linalg.det(problem.axes), 1.0)


@pytest.mark.daily(4)
@pytest.mark.parametrize("potential", [None, {"clebsch": 0.4}, {"family": [0.1, 0.2, 0, 0, 0]}])
def test_the_closed_form_of_a_body_with_a_full_tensor_is_its_integration(
    potential: Any, rng: np.random.Generator
) -> None:
    for _, _, tensor in tensors(rng, 3):
        gamma, v = start(rng, 3)
        problem = VeselovaSO3(tensor, gamma, np.cross(v, gamma), potential, normalize=True)
        closed, integrated = solve(problem, TIMES, "analytic"), solve(problem, TIMES, "numeric")
        agree(closed, integrated, "frame", "Omega", "momentum", "multiplier", room=1e-11)
        assert np.allclose(np.linalg.det(closed.frame), 1.0)


def test_a_problem_with_a_full_matrix_is_that_along_its_axes(rng: np.random.Generator) -> None:
    for turn, values, matrix in tensors(rng, 2, 3, 4):
        q, v = start(rng, len(turn))
        given, along = (
            Veselova(matrix, q, v, normalize=True),
            Veselova(values, turn.T @ q, turn.T @ v, normalize=True),
        )
        assert np.isclose(np.linalg.det(given.axes), 1.0)
        assert np.isclose(np.linalg.det(given.to_body_axes(given.frame)), 1.0)
        closed, there = solve(given, TIMES), solve(along, TIMES)
        assert np.max(np.abs(closed.q - there.q @ turn.T)) < 1e-11
        agree(closed, solve(given, TIMES, "numeric"), "frame", "q_dot", "omega", room=1e-11)


def test_axes_in_another_order_or_reversed_change_nothing_else(rng: np.random.Generator) -> None:
    for n in [3, 4] * (DRAWS // 2):
        A, (q, v) = np.exp(rng.uniform(0, np.log(5), n)), start(rng, n)
        turn = np.eye(n)[rng.permutation(n)] * rng.choice([-1.0, 1.0], n)
        order = np.abs(turn).argmax(axis=1)
        for system in (Veselova, NeumannSystem, SeparableVeselova, EllipsoidGeodesic):
            x, w = (np.sqrt(A) * q, np.sqrt(A) * v) if system is EllipsoidGeodesic else (q, v)
            portrait = "X" if system is EllipsoidGeodesic else "q"
            more = ({"quadratic": 0.3, "quartic": 0.1},) if system is SeparableVeselova else ()
            one = solve(system(A, x, w, *more, normalize=True), TIMES).series(portrait)
            other = solve(
                system(A[order], turn @ x, turn @ w, *more, normalize=True), TIMES
            ).series(portrait)
            assert np.max(np.abs(other - one @ turn.T)) < 1e-10, system


@pytest.mark.daily(3)
@pytest.mark.parametrize("system", [Veselova, VeselovaSO3])
def test_a_diagonal_matrix_is_as_exact_as_its_entries(system: Any) -> None:
    """Its axes are the body's, so digits and certified errors are answered."""
    entries = ["3", "1/3", 1]
    matrix = [["3", 0, 0], [0, "1/3", 0], [0, 0, 1]]
    start = ([0.6, 0, 0.8], [0.8, 1, -0.6])
    for more in ({"digits": 30}, {"certified": True}):
        one, other = (
            solve(system(given, *start, normalize=True), [0, 1, 5], **more)
            for given in (entries, matrix)
        )
        assert np.array_equal(one.frame, other.frame)
        assert np.array_equal(one.error, other.error)
    with pytest.raises(InvalidInput, match="positive definite"):
        system([[1, 0, 0], [0, -1, 0], [0, 0, 1]], *start, normalize=True)
