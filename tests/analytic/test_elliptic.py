"""Jacobi's functions against mpmath's, at moduli from a circle to a gap of 1e-300."""

from __future__ import annotations

from decimal import Decimal
from typing import Any

import mpmath
import numpy as np
import pytest

from veselova.analytic.arithmetic.balls import balls
from veselova.analytic.curve.hyperelliptic import Curve, Interval
from veselova.analytic.kernel import elliptic

COMPLEMENTS = ["0.999999", "0.9", "0.5", "0.3", "1e-2", "1e-8", "1e-20", "1e-100", "1e-300"]
NUMBERS = "1e-8 0.1 0.5 1 1.5 1.57 2 3 3.1 3.5 5 6.2 7 9 11 12.5 -1 -4"
ANGLES = [float(x) for x in NUMBERS.split()]


def interval_of(square: float, complement: float) -> Any:
    """Three points at 0, k² and 1 have the modulus k."""
    interval = np.zeros(elliptic.ROOM)
    elliptic.set_interval(0.0, square, complement, True, False, interval)
    return interval


def jacobi_of(complement: str) -> Any:
    """The interval with both squares rounded once from the exact complement."""
    with mpmath.workdps(360):
        return interval_of(float(1 - mpmath.mpf(complement)), float(mpmath.mpf(complement)))


def functions(interval: Any, psi: float) -> Any:
    """Return sn and cn."""
    return np.array(elliptic.roots(psi, interval)) / np.sqrt(interval[elliptic.WIDTH])


def exact(complement: Any, psi: float, digits: int) -> tuple[Any, ...]:
    with mpmath.workdps(digits):
        m = 1 - mpmath.mpf(complement)
        u = mpmath.ellipk(m) * mpmath.mpf(psi) / mpmath.pi
        return tuple(mpmath.ellipfun(name, u, m=m) for name in ("sn", "cn"))


@pytest.mark.parametrize("complement", COMPLEMENTS)
def test_values_are_accurate_relative_to_themselves(complement: str) -> None:
    interval = jacobi_of(complement)
    quarter = np.pi * interval[elliptic.DENSITY]
    # sn and cn vanish linearly, so a rounding of ψ moves them by ε|ψ|·(K/π) relative to their
    # distance from the zero.
    for psi in ANGLES:
        values = functions(interval, psi)
        for value, true in zip(values, exact(complement, psi, 360), strict=True):
            near_zero = 1 / abs(np.sin(psi / 2) * np.cos(psi / 2))
            allowed = 1e-15 * (4 + quarter * abs(psi)) * max(1.0, near_zero)
            assert abs(value / true - 1) < allowed


@pytest.mark.parametrize("complement", COMPLEMENTS)
def test_quarter_periods_are_the_complete_integrals(complement: str) -> None:
    interval = jacobi_of(complement)
    quarter, aspect = np.pi * interval[elliptic.DENSITY], interval[elliptic.ASPECT]
    with mpmath.workdps(360):
        m = 1 - mpmath.mpf(complement)
        assert abs(quarter / mpmath.ellipk(m) - 1) < 1e-15
        assert abs(aspect * quarter / mpmath.ellipk(1 - m) - 1) < 1e-15


@pytest.mark.parametrize("complement", COMPLEMENTS)
def test_balls_of_the_same_text_hold_the_exact_values(complement: str) -> None:
    with balls(40) as xp:
        after = xp.number(Decimal(complement))
        width, none = 1 - after, 0 * after
        differences = np.array([[none, width, none + 1], [none] * 2 + [after], [none] * 3])
        interval = Interval(Curve(xp, differences[0], differences), 0)
        found = np.array(interval.roots(xp.array(ANGLES))) / xp.sqrt(width)
        for psi, values in zip(ANGLES, found.T, strict=True):
            for value, true in zip(values, exact(complement, psi, 360), strict=True):
                wanted = xp.number(Decimal(mpmath.nstr(true, 60)))
                assert value.overlaps(wanted)
                assert value.rel_accuracy_bits() > 110
                back = interval.angle(*(x * x * width for x in values), True)
                assert back.overlaps(xp.number(psi).cos().acos())
