"""Full matrices: principal axes beyond doubles, and errors that hold whatever the condition of the
matrix.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest

import veselova as vs
from veselova import Veselova, VeselovaSO3
from veselova.mechanics.bodies.principal_inertia import wide_axes

TIMES = [1, 1_000, 100_000]


def _matrix(rng: np.random.Generator, n: int, condition: float) -> Any:
    turn = np.linalg.qr(rng.standard_normal((n, n)))[0]
    values = condition ** -np.concatenate([[0, 1], rng.uniform(0, 1, n)])[:n]
    matrix = turn * values @ turn.T
    return ((matrix + matrix.T) / 2).tolist()


@pytest.mark.parametrize("n", [2, 3, 5, 9, 24])
def test_principal_axes_have_sixty_digits(n: int, rng: np.random.Generator) -> None:
    for condition in (1.0, 1e4, 1e8, 1e12):
        matrix = [list(map(Fraction, row)) for row in _matrix(rng, n, condition)]
        found = wide_axes(matrix)
        for value, column in zip(found.values, found.columns.T.tolist(), strict=True):
            image = [sum(a * x for a, x in zip(row, column, strict=True)) for row in matrix]
            assert max(abs(a - value * x) for a, x in zip(image, column, strict=True)) < Fraction(
                1, 10**70
            )
            assert abs(sum(x * x for x in column) - 1) < Fraction(1, 10**70)
        assert np.isclose(np.linalg.det(found.rounded), 1, atol=1e-14)


def test_equal_moments_are_equal_numbers() -> None:
    rows = [[2, 1, 1], [1, 2, 1], [1, 1, 2]]
    assert wide_axes([list(map(Fraction, row)) for row in rows]).values == (1, 1, 4)
    assert Veselova([[2, 0], [0, 2]], [0.6, 0.8], [0.8, -0.6]).exact.A == (2, 2)


def _in_forty_digits(A: Any, q: Any, q_dot: Any, inverse: bool) -> tuple[Veselova, Any]:
    """Return the problem along principal axes in 40 digits, and these axes in doubles."""
    with mpmath.workdps(50):
        values, axes = mpmath.eigsy(mpmath.matrix(A))
        n = len(A)
        if mpmath.det(axes) < 0:
            axes[:, n - 1] = -axes[:, n - 1]
        along = [[mpmath.nstr(x, 40) for x in axes.T * mpmath.matrix(v)] for v in (q, q_dot)]
        diagonal = [mpmath.nstr(1 / x if inverse else x, 40) for x in values]
        return Veselova(diagonal, *along, normalize=True), np.array(axes.tolist(), dtype=float)


@pytest.mark.parametrize("seed", range(30))
def test_errors_of_a_full_matrix_hold(seed: int) -> None:
    """Against the same motion along principal axes in 40 digits, whose own error is that of a
    diagonal A.
    """
    rng = np.random.default_rng([20251125, seed])
    on_group, condition = seed % 2 == 1, 10.0 ** (8 * seed / 29)
    A = _matrix(rng, 3 if on_group else 2 + seed // 2 % 4, condition)
    q, v = (rng.standard_normal(len(A)) for _ in range(2))
    if on_group:
        q = q / np.linalg.norm(q)
        problem: Any = VeselovaSO3(A, q, np.cross(q, v))
        with mpmath.workdps(50):
            gamma, Omega = (
                list(map(mpmath.mpf, x)) for x in (problem.given["gamma"], problem.given["Omega"])
            )
            length = mpmath.norm(mpmath.matrix(gamma))
            v = [
                (gamma[i - 2] * Omega[i - 1] - gamma[i - 1] * Omega[i - 2]) / length
                for i in range(3)
            ]
            reference, axes = _in_forty_digits(A, gamma, v, inverse=True)
    else:
        problem = Veselova(A, q, v, normalize=True)
        reference, axes = _in_forty_digits(A, q.tolist(), v.tolist(), inverse=False)
    times = TIMES if condition < 1e5 else TIMES[:2]  # beyond, modes are too many
    found, expected = vs.solve(problem, times), vs.solve(reference, times)
    difference = np.max(np.abs(found.frame - axes @ expected.frame), axis=(1, 2))
    assert np.all(difference <= found.error)
    assert np.all(found.error <= 3 * expected.error + 1e-13)
