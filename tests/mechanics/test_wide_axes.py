"""Full matrices: principal axes beyond doubles, and errors that hold whatever the condition of the
matrix.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from veselova import Veselova
from veselova.mechanics.bodies.principal_inertia import wide_axes


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
