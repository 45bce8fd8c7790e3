"""Curves with real branch points to many digits: radii hold, and every number is that of doubles,
of more digits, and of mpmath.
"""

from __future__ import annotations

from collections.abc import Iterator
from decimal import Context, Decimal, localcontext
from fractions import Fraction
from itertools import pairwise
from typing import Any

import mpmath
import numpy as np
import pytest
from test_curves import quadrature

from conftest import slow
from deviations import decimals_of
from deviations import enclosed as are_enclosed
from veselova import curves
from veselova.mechanics.core.budget import limits
from veselova.mechanics.core.errors import OverBudget

CASES = [(count, sign) for count in range(3, 8) for sign in (-1, 1)]
MATRICES = ("riemann_matrix", "a_periods", "b_periods", "normalized_differentials")
HALF_PERIODS = ("omega", "omega_prime", "eta", "eta_prime")


@pytest.fixture(autouse=True)
def _digits() -> Iterator[None]:
    """Give the decimals of a test digits to be compared with."""
    with localcontext(Context(prec=120)):
        yield


def branch_points(count: int) -> list[str]:
    random = np.random.default_rng([11, count])
    return [str(round(float(b), 6)) for b in np.cumsum(random.uniform(0.1, 2, count)) - 3]


def places(points: list[str]) -> list[Any]:
    """Return points on every cut and gap, at ends, beyond them, and complex ones."""
    exact = sorted(map(Fraction, points))
    between = [str((2 * a + b) / 3) for a, b in pairwise(exact)]
    beyond = [str(exact[0] - 1), str(exact[-1] + 1), str(exact[0] - 100), "5e7"]
    return [*between, *beyond, points[0], points[-1], points[1], 0.3 + 0.7j, -50 + 3j, 2 - 1j]


def three_ways(points: Any, sign: int, certified: bool) -> list[curves.RealHyperelliptic]:
    """Return one curve in doubles, with 25 digits, and with 60."""
    return [
        curves.RealHyperelliptic(points, sign),
        curves.RealHyperelliptic(points[::-1], sign, digits=25, certified=certified),
        curves.RealHyperelliptic(points, sign, digits=60),
    ]


def enclosed(coarse: Any, fine: Any, name: str) -> Any:
    """Return the midpoints, after a look at the radii."""
    are_enclosed(coarse, fine, [name])
    return coarse.midpoints[name].astype(float)


@pytest.mark.parametrize("certified", [slow(False), True])
@pytest.mark.parametrize(("count", "sign"), CASES)
def test_every_number_of_a_curve_has_the_digits_asked_for(
    count: int, sign: int, certified: bool
) -> None:
    points = branch_points(count)
    plain, coarse, fine = three_ways(points, sign, certified)
    quasi = plain.quasi_periods
    expected = {
        "riemann_matrix": plain.riemann_matrix.imag,
        "a_periods": plain.periods.a,
        "b_periods": plain.periods.b.imag,
        "normalized_differentials": plain.normalized_differentials,
        "omega": quasi[0].imag,
        "omega_prime": quasi[1].real,
        "eta": quasi[2].imag,
        "eta_prime": quasi[3].real,
    }
    for name, values in expected.items():
        found = enclosed(coarse.decimals, fine.decimals, name)
        assert np.max(np.abs(found - values)) <= 1e-12 * np.max(np.abs(values)), name
    decimals = decimals_of(coarse)
    periods, radii = decimals.midpoints["a_periods"], decimals.radii["a_periods"]
    sizes = np.max(np.abs(periods), axis=1, keepdims=True)
    assert (radii <= sizes * Decimal("1e-25")).all()


@pytest.mark.daily(4)
@pytest.mark.parametrize("certified", [slow(False), True])
@pytest.mark.parametrize(("count", "sign"), CASES)
def test_the_abel_map_and_its_inverse_have_the_digits_asked_for(
    count: int, sign: int, certified: bool
) -> None:
    points = branch_points(count)
    plain, coarse, fine = three_ways(points, sign, certified)
    given = places(points)
    sheets = [1 + 1j] * len(given)
    found = enclosed(coarse.abel_decimals(given, sheets), fine.abel_decimals(given, sheets), "abel")
    images = plain.abel(given, sheets)
    assert np.max(np.abs(found[..., 0] + 1j * found[..., 1] - images)) < 1e-12
    z = [row[: plain.genus] for row in (["0.3", "0.1", "0.77"], ["1/3", "-2/7", "5/9"])]
    inverse = coarse.invert_decimals(z)
    found = enclosed(inverse, fine.invert_decimals(z), "points")
    where, signs = plain.invert([[float(Fraction(x)) for x in row] for row in z])
    assert np.max(np.abs(found - where)) < 1e-12
    assert np.array_equal(inverse.midpoints["signs"].astype(float), signs)
    # a branch point itself is a point of the torus: its radius is not that of a square root
    ends = coarse.invert_decimals([["0.5", "0", "0.5"][: plain.genus]])
    cuts = plain.cuts
    assert np.min(np.abs(ends.midpoints["points"].astype(float).T - cuts), axis=1).max() < 1e-14
    assert ends.radii["points"].max() < Decimal("1e-20")


def test_periods_to_fifty_digits_are_those_of_quadrature() -> None:
    points = ["0", "1", "1.7", "3", "4.5"]
    decimals = decimals_of(curves.RealHyperelliptic(points, digits=50, certified=True))
    with mpmath.workdps(70):
        for s, cut in enumerate((points[1:3], points[3:])):
            for k in (0, 1):
                found = mpmath.mpf(str(abs(decimals.midpoints["a_periods"][k, s])))
                off = abs(found - quadrature(points, *cut, k, digits=70))
                assert off <= mpmath.mpf(str(decimals.radii["a_periods"][k, s]))


def test_legendres_relation_holds_to_forty_digits() -> None:
    """ωη'ᵀ − ω'ηᵀ = ±½πi, with ω and η without their i."""
    for points in (branch_points(5), branch_points(6), branch_points(7)):
        decimals = decimals_of(curves.RealHyperelliptic(points, digits=40, certified=True))
        omega, omega_prime, eta, eta_prime = (decimals.midpoints[name] for name in HALF_PERIODS)
        with mpmath.workdps(50):
            half_pi = Decimal(mpmath.nstr(mpmath.pi / 2, 48))
            found = (omega @ eta_prime.T - omega_prime @ eta.T) / half_pi
        size = max(1, *np.abs(omega @ eta_prime.T).astype(float).ravel())
        rest = np.abs(found) - np.eye(len(omega), dtype=int)
        assert np.max(np.abs(rest)) < Decimal("1e-36") * int(size)


@pytest.mark.daily(4)
@pytest.mark.parametrize("gap", ["1e-12", "1e-40"])
def test_narrow_gaps_keep_all_their_digits(gap: str) -> None:
    points = ["0", "1", str(1 + Fraction(gap)), "2", "3"]
    coarse = curves.RealHyperelliptic(points, digits=30, certified=True)
    fine = curves.RealHyperelliptic(points, digits=70, certified=True)
    for name in (*MATRICES, *HALF_PERIODS):
        enclosed(coarse.decimals, fine.decimals, name)
    given = ["1.5", "0.5", "2.5", "-1", 1.5 + 1j]
    enclosed(coarse.abel_decimals(given, [1] * 5), fine.abel_decimals(given, [1] * 5), "abel")


def test_digits_of_a_curve_end_with_the_budget() -> None:
    curve = curves.RealHyperelliptic(branch_points(9), digits=900, certified=True)
    decimals = decimals_of(curve)
    with pytest.raises(OverBudget), limits(0.2):
        _ = decimals.midpoints["omega"]
