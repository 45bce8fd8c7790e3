"""Spectra, branch points and periods, against arbitrary-precision arithmetic and the bilinear
relations.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import mpmath
import numpy as np
import pytest

from conftest import slow
from draws import random_problem
from extended import Extended
from problems import near_separatrix, tagged
from veselova import Veselova
from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.curve.hyperelliptic import Curve
from veselova.analytic.curve.interval import Interval
from veselova.analytic.curve.periods import Periods
from veselova.analytic.spectrum.branch_points import Spectrum, spectrum
from veselova.analytic.spectrum.moving_part import moving_part

DIMENSIONS = range(2, 9)


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


def test_the_roots_are_found_in_clusters_too() -> None:
    A = [1, "1.00000000000000000001", "1.00000000000000000002", "1.00000000000000000003"]
    found = spectrum_of(Veselova(A, ["0.5"] * 4, ["0.5", "-0.5", "0.3", "-0.3"]))
    ends = sorted([*found.constants, *found.inverse])
    assert all(b > a for a, b in pairwise(ends))
    assert all(
        a <= x <= b for x, a, b in zip(found.spheroconic, ends[1::2], ends[2::2], strict=True)
    )


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


def nodal_integral(curve: Curve, interval: Interval, k: int) -> Any:
    """∫ |p_k| dλ/√|R| over an interval by mpmath's tanh-sinh quadrature, k from 1."""
    with mpmath.workdps(30):
        points = [mpmath.mpf(b) for b in curve.branch_points]
        zeros = [(points[2 * m] + points[2 * m + 1]) / 2 for m in range(1, curve.genus)]
        left, right = points[interval.left], points[interval.left + 1]

        def density(angle: Any) -> Any:
            x = (left + right) / 2 - (right - left) / 2 * mpmath.cos(angle)
            numerator = mpmath.fprod(
                x - zero for m, zero in enumerate(zeros) if m != k - 1 or k == curve.genus
            )
            rest = mpmath.fprod(
                abs(x - b)
                for j, b in enumerate(points)
                if j not in (interval.left, interval.left + 1)
            )
            return numerator / mpmath.sqrt(rest)

        return mpmath.quad(density, mpmath.linspace(0, mpmath.pi, 5))


@pytest.mark.parametrize("n", [2, 3, 4, slow(6)])
def test_periods_agree_with_another_quadrature(n: int, rng: np.random.Generator) -> None:
    periods = Periods(curve_of(random_problem(rng, n, 5.0)))
    for intervals in (periods.cuts, periods.gaps):
        for interval in intervals:
            count = periods.node_count(interval)
            psi = periods.arithmetic.nodes(count)
            means = np.mean(interval.forms(*interval.distances(psi)), axis=1) * np.pi
            for k in range(1, n):
                expected = nodal_integral(periods.curve, interval, k) / 2
                assert abs(means[k - 1] - expected) < 1e-13 * (1 + abs(expected))


def test_for_two_dimensions_the_period_is_a_complete_elliptic_integral() -> None:
    problem = Veselova([5, 1], [0.6, 0.8], [-0.8, 0.6])
    periods = Periods(curve_of(problem))
    I1, I2 = 0.2, 1.0
    expected = 2 * mpmath.ellipk((I2 - I1) / I2) / mpmath.sqrt(I2)
    assert np.isclose(1 / periods.frequencies[0], float(expected), rtol=1e-15)


@pytest.mark.parametrize("case", tagged("generic"), ids=lambda case: case.name)
def test_frequencies_agree_with_extended_precision(case: Any) -> None:
    problem = case.problem()
    rounded = Periods(curve_of(problem)).frequencies
    precise = Periods(curve_of(problem, 30)).frequencies
    assert max(abs(a / b - 1) for a, b in zip(rounded, precise, strict=True)) < 2e-15


def test_bilinear_relations_hold_in_extended_precision() -> None:
    periods = Periods(curve_of(tagged("generic")[1].problem(), 50))
    assert periods.riemann_matrix_residual < 1e-45


@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-10])
def test_closing_a_gap_costs_its_logarithm(gap: float) -> None:
    periods = Periods(curve_of(near_separatrix(gap).problem()))
    nodes = max(periods.node_count(cut) for cut in periods.cuts)
    # (ln 1/ε)/π per K/K', and K grows by ln(10)/2 per decade
    assert nodes < 20 + 9 * np.log10(1 / gap)
    assert periods.riemann_matrix_residual < 1e-14


def test_distances_are_sums_of_positive_parts(rng: np.random.Generator) -> None:
    curve = curve_of(random_problem(rng, 4))
    for cut in Periods(curve).cuts:
        psi = rng.uniform(0, 12, 50)
        sn, cn, _ = cut.jacobi(psi)
        below, above = cut.distances(psi)
        width = curve.differences[cut.left, cut.left + 1]
        assert np.allclose(below + above, width, rtol=1e-13)
        squares = cut.points.squares(below, above)
        assert np.allclose(squares[0], sn**2, atol=1e-13)
        assert np.allclose(squares[1], cn**2, atol=1e-13)
        point = curve.branch_points[cut.left] + below
        assert np.allclose(
            cut.to_branch_points(below, above),
            np.abs(point - curve.branch_points[:, None]),
            atol=1e-14,
        )
