"""Jacobi's functions against mpmath's, at moduli from a circle to a gap of 1e-300."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
import pytest

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.curve.hyperelliptic import FourPoints

COMPLEMENTS = ["1", "0.999999", "0.9", "0.5", "0.3", "1e-2", "1e-8", "1e-20", "1e-100", "1e-300"]
ANGLES = [
    1e-8,
    0.1,
    0.5,
    1.0,
    1.5,
    1.57,
    2.0,
    3.0,
    3.1,
    3.5,
    5.0,
    6.2,
    7.0,
    9.0,
    11.0,
    12.5,
    -1.0,
    -4.0,
]


def functions_of(square: float, complement: float) -> FourPoints:
    """Three points at 0, k² and 1 have the modulus k."""
    return FourPoints(DOUBLE, None, square, complement)


def jacobi_of(complement: str) -> FourPoints:
    """The functions with both squares rounded once from the exact complement."""
    with mpmath.workdps(360):
        return functions_of(float(1 - mpmath.mpf(complement)), float(mpmath.mpf(complement)))


def exact(complement: Any, psi: float, digits: int) -> tuple[Any, Any, Any]:
    with mpmath.workdps(digits):
        m = 1 - mpmath.mpf(complement)
        u = mpmath.ellipk(m) * mpmath.mpf(psi) / mpmath.pi
        if m == 0:
            return mpmath.sin(u), mpmath.cos(u), mpmath.mpf(1)
        return tuple(mpmath.ellipfun(name, u, m=m) for name in ("sn", "cn", "dn"))


@pytest.mark.parametrize("complement", COMPLEMENTS)
def test_values_are_accurate_relative_to_themselves(complement: str) -> None:
    jacobi = jacobi_of(complement)
    values = jacobi.functions(np.array(ANGLES))
    # sn and cn vanish linearly, so a rounding of ψ moves them by ε|ψ|·(K/π) relative to their
    # distance from the zero.
    for i, psi in enumerate(ANGLES):
        for value, true in zip(values, exact(complement, psi, 360), strict=True):
            near_zero = 1 / abs(np.sin(psi / 2) * np.cos(psi / 2))
            allowed = 1e-15 * (4 + float(jacobi.quarter) * abs(psi)) * max(1.0, near_zero)
            assert abs(value[i] / true - 1) < allowed


@pytest.mark.parametrize("complement", COMPLEMENTS)
def test_quarter_periods_are_the_complete_integrals(complement: str) -> None:
    jacobi = jacobi_of(complement)
    with mpmath.workdps(360):
        m = 1 - mpmath.mpf(complement)
        assert abs(jacobi.quarter / mpmath.ellipk(m) - 1) < 1e-15
        if m > 0:
            assert abs(jacobi.aspect * jacobi.quarter / mpmath.ellipk(1 - m) - 1) < 1e-15


def test_squares_add_up(rng: np.random.Generator) -> None:
    for complement in (0.7, 1e-3, 1e-12):
        sn, cn, dn = functions_of(1 - complement, complement).functions(rng.uniform(-20, 20, 200))
        assert np.allclose(sn**2 + cn**2, 1, atol=1e-14)
        assert np.allclose(dn**2, complement + (1 - complement) * cn**2, atol=1e-14)
