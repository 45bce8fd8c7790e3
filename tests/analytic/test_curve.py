"""Spectra, branch points and periods, against arbitrary-precision arithmetic and the bilinear
relations.
"""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
import pytest

from draws import random_problem
from extended import Extended
from problems import near_separatrix
from veselova import Veselova
from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.curve.hyperelliptic import Curve
from veselova.analytic.curve.periods import Periods
from veselova.analytic.spectrum.branch_points import Spectrum, spectrum
from veselova.analytic.spectrum.moving_part import moving_part

DIMENSIONS = (2, 3, 5, 8)


def spectrum_of(problem: Veselova, digits: int = 15) -> Spectrum:
    return spectrum(moving_part(problem), digits)


def curve_of(problem: Veselova, digits: int | None = None) -> Curve:
    return Curve.of(spectrum_of(problem), DOUBLE if digits is None else Extended(digits))


def eigenvalues(found: Spectrum) -> tuple[list[Any], list[Any]]:
    """Both spectra once more, as eigenvalues of A⁻¹ and A⁻¹ − q'q'ᵀ restricted to q⊥."""
    xp, n = found.arithmetic, len(found.q)
    w = found.q.copy()
    w[-1] = w[-1] + (1 if w[-1] >= 0 else -1)
    basis = (xp.array(np.eye(n).tolist()) - np.outer(w, w) * (2 / sum(w * w)))[:, :-1]
    position = basis.T @ (basis * found.inverse[:, None])
    along = basis.T @ found.q_prime
    with mpmath.workdps(xp.digits + 6):
        matrices = (
            mpmath.matrix(values.tolist())
            for values in (position, position - np.outer(along, along))
        )
        spheroconic, constants = (
            sorted(mpmath.eigsy(matrix, eigvals_only=True)) for matrix in matrices
        )
    return spheroconic, constants


@pytest.mark.parametrize("n", DIMENSIONS)
def test_spectra_agree_with_the_eigenproblems(n: int, rng: np.random.Generator) -> None:
    problem = random_problem(rng, n)
    found, unit = spectrum_of(problem), float(moving_part(problem).unit)
    assert np.allclose(
        [float(c) / unit for c in found.constants[1:]], problem.constants, rtol=1e-11, atol=1e-14
    )
    assert np.allclose(
        [float(x) / unit for x in found.spheroconic], problem.spheroconic, rtol=1e-11, atol=1e-14
    )
    found = found.in_arithmetic(Extended(found.arithmetic.digits))
    spheroconic, constants = eigenvalues(found)
    assert max(abs(a - b) for a, b in zip(spheroconic, found.spheroconic, strict=True)) < 1e-45
    assert max(abs(a - b) for a, b in zip(constants, found.constants, strict=True)) < 1e-45


@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-10])
def test_a_small_gap_keeps_its_digits(gap: float) -> None:
    problem = near_separatrix(gap).problem()
    rounded = curve_of(problem).differences
    precise = Curve.of(spectrum_of(problem, 40), Extended(60)).differences
    relative = [
        abs(rounded[i, j] / precise[i, j] - 1) for i in range(5) for j in range(5) if i != j
    ]
    assert max(relative) < 4e-16


@pytest.mark.parametrize("n", DIMENSIONS)
def test_branch_points_start_at_zero_and_alternate_as_cuts_and_gaps(
    n: int, rng: np.random.Generator
) -> None:
    curve = curve_of(random_problem(rng, n))
    assert curve.branch_points[0] == 0
    assert np.all(np.diff(curve.branch_points) > 0)
    assert sum(origin.kind == "I" for origin in curve.origins) == n
    for gap in range(1, curve.genus):  # every inner gap lies between c_k and I_k
        ends = curve.origins[2 * gap : 2 * gap + 2]
        assert {end.kind for end in ends} == {"I", "c"}
        assert {end.index for end in ends} == {gap}


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
