"""Spectra, branch points and periods, against arbitrary-precision arithmetic and the bilinear
relations.
"""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from draws import random_problem
from veselova import Veselova
from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.curve.branch_points import Spectrum, spectrum
from veselova.analytic.curve.hyperelliptic import Curve
from veselova.analytic.curve.moving_part import moving_part
from veselova.analytic.curve.periods import Periods

DIMENSIONS = (2, 3, 5, 8)


def spectrum_of(problem: Veselova, digits: int = 15) -> Spectrum:
    return spectrum(moving_part(problem), digits)


def curve_of(problem: Veselova) -> Curve:
    return Curve.of(spectrum_of(problem), DOUBLE)


@pytest.mark.parametrize("n", DIMENSIONS)
def test_branch_points_start_at_zero_and_alternate_as_cuts_and_gaps(
    n: int, rng: np.random.Generator
) -> None:
    curve = curve_of(random_problem(rng, n))
    assert curve.branch_points[0] == 0
    assert np.all(np.diff(curve.branch_points) > 0)
    assert sum(origin[0] == "I" for origin in curve.origins) == n
    for gap in range(1, curve.genus):  # every inner gap lies between c_k and I_k
        ends = curve.origins[2 * gap : 2 * gap + 2]
        assert {end[0] for end in ends} == {"I", "c"}
        assert {end[1] for end in ends} == {gap}


@pytest.mark.parametrize("n", DIMENSIONS)
def test_the_riemann_matrix_is_symmetric_and_positive_definite(
    n: int, rng: np.random.Generator
) -> None:
    for _ in range(5):
        periods = Periods(curve_of(random_problem(rng, n)))
        assert periods.riemann_matrix_residual < 1e-14
        assert np.linalg.eigvalsh(periods.riemann_matrix)[0] > 0


def test_for_two_dimensions_the_period_is_a_complete_elliptic_integral() -> None:
    problem = Veselova([5, 1], [0.6, 0.8], [-0.8, 0.6])
    periods = Periods(curve_of(problem))
    I1, I2 = 0.2, 1.0
    expected = 2 * mpmath.ellipk((I2 - I1) / I2) / mpmath.sqrt(I2)
    assert np.isclose(1 / periods.frequencies[0], float(expected), rtol=1e-15)
