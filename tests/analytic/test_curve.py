"""Spectra, branch points and periods, against arbitrary-precision arithmetic and the bilinear
relations.
"""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from draws import random_problem
from veselova import Veselova
from veselova.analytic.closed.motion import kernel_motion
from veselova.analytic.closed.quotients import riemann_matrix
from veselova.analytic.curve.branch_points import Spectrum, spectrum
from veselova.analytic.curve.moving_part import moving_part

DIMENSIONS = (2, 3, 5, 8)


def spectrum_of(problem: Veselova, digits: int = 15) -> Spectrum:
    return spectrum(moving_part(problem), digits)


@pytest.mark.parametrize("n", DIMENSIONS)
def test_branch_points_start_at_zero_and_alternate_as_cuts_and_gaps(
    n: int, rng: np.random.Generator
) -> None:
    points, kinds, numbers = zip(*spectrum_of(random_problem(rng, n)).branch_points, strict=True)
    assert points[0] == 0
    assert np.all(np.diff(np.array(points)) > 0)
    assert kinds.count("I") == n
    for gap in range(1, n - 1):  # every inner gap lies between c_k and I_k
        assert {*kinds[2 * gap : 2 * gap + 2]} == {"I", "c"}
        assert {*numbers[2 * gap : 2 * gap + 2]} == {gap}


@pytest.mark.parametrize("n", DIMENSIONS)
def test_the_riemann_matrix_is_symmetric_and_positive_definite(
    n: int, rng: np.random.Generator
) -> None:
    for _ in range(5):
        T, residual, _ = riemann_matrix(kernel_motion(random_problem(rng, n)).torus)
        assert residual < 1e-14
        assert np.linalg.eigvalsh(T)[0] > 0


def test_for_two_dimensions_the_period_is_a_complete_elliptic_integral() -> None:
    problem = Veselova([5, 1], [0.6, 0.8], [-0.8, 0.6])
    torus = kernel_motion(problem).torus
    I1, I2 = 0.2, 1.0
    expected = 2 * mpmath.ellipk((I2 - I1) / I2) / mpmath.sqrt(I2)
    assert np.isclose(1 / torus.frequencies[0], float(expected), rtol=1e-15)
