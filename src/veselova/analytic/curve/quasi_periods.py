"""Periods of the first and second kind in doubles, and Legendre's relation between them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.curve.abel_images import Halves
from veselova.analytic.curve.nodal_forms import second_kind
from veselova.analytic.curve.real_hyperelliptic import RealCurve
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.results.curve import QUASI_PERIODS

__all__ = ["legendre_residual", "quasi_periods"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: ω, ω', η, η'.
Matrices = tuple[Complex, Complex, Complex, Complex]

#: Derived: roundings of a term of η in ε, and digits of an answer in doubles.
_ROUNDINGS = 8.0
_DIGITS = 17

#: Budget: what rounding may take of η, relative to the largest of its row, before ball arithmetic
#: serves.
_MOST_LOST = 1e-12


def quasi_periods(curve: RealCurve, halves: Sequence[Halves]) -> Matrices:
    """Return ω, ω', η, η', half the periods of du_k = ν^{k−1}dν/y and −dr_k over a_s and b_s, (g,
    g), y² = 4Π(ν−ν_j).

    dr_k are Baker's differentials of the second kind (``second_kind``). Where their terms cancel,
    between near or far branch points, ball arithmetic serves. Raises Unsolved (``beyond-floats``).
    """
    with np.errstate(over="ignore", invalid="ignore"):
        found, lost = _in_doubles(curve)
        if not lost <= _MOST_LOST:
            found = _by_balls(curve, halves)
    if not all(np.all(np.isfinite(part)) for part in found):
        reason = "a period leaves the range of a float; take branch points in other units"
        raise Unsolved("beyond-floats", reason)
    return found


def _in_doubles(curve: RealCurve) -> tuple[Matrices, float]:
    """Return the four matrices, and what rounding may have taken of their rows."""
    g = curve.genus
    highest = 2 * g - 1
    try:
        kinds = np.array(second_kind(g, curve.nus), dtype=np.float64)
    except OverflowError:
        kinds = np.full((2 * g, 2 * g), np.inf)
    over = np.array([kinds @ curve.nu_integrals(j, highest) for j in range(2 * g)])
    sizes = np.array(
        [np.abs(kinds) @ curve.nu_integrals(j, highest, sizes=True) for j in range(2 * g)]
    )
    lost = np.max(sizes, axis=0) / np.max(np.abs(over), axis=0)
    a = np.stack([(-1) ** (g - s) * over[2 * s - 1] for s in range(1, g + 1)], axis=1) / 2j
    # y = 2iv on cuts; on gaps v is i√|R| as in the b-periods of the first kind.
    gaps = np.stack([(-1) ** (g - s + 1) * over[2 * s] for s in range(g)], axis=1)
    b = np.cumsum(gaps, axis=1) / 2
    return _complex(a[:g], b[:g], a[g:], b[g:]), float(np.max(lost)) * _ROUNDINGS * DOUBLE.epsilon


def _by_balls(curve: RealCurve, halves: Sequence[Halves]) -> Matrices:
    # loads python-flint
    from veselova.analytic.curve.real_hyperelliptic_decimals import CurveDecimals

    digits = CurveDecimals(curve, _DIGITS, False, halves).of_curve(list)
    omega, omega_prime, eta, eta_prime = (
        np.array(digits.midpoints[name], dtype=np.float64) for name in QUASI_PERIODS
    )
    return _complex(1j * omega, omega_prime, 1j * eta, eta_prime)


def _complex(*parts: NDArray[Any]) -> Matrices:
    omega, omega_prime, eta, eta_prime = (np.asarray(part, dtype=np.complex128) for part in parts)
    return omega, omega_prime, eta, eta_prime


def legendre_residual(curve: RealCurve, halves: Sequence[Halves]) -> float:
    """Return max |ωη'ᵀ − ω'ηᵀ ∓ ½πi| over the largest of both rows, or over ½π where that is more.

    It is that of the curve in the power of 2 as a unit in which ν is of order one: but for powers
    of 2 its periods are the same.
    """
    unit = curve.root_of_unit ** (2 if curve.is_even else -2)
    scaled = RealCurve(tuple(b * unit for b in curve.points), curve.sign)
    omega, omega_prime, eta, eta_prime = quasi_periods(scaled, halves)
    first = np.max(np.abs(np.hstack([omega, omega_prime])), axis=1)[:, None]
    second = np.max(np.abs(np.hstack([eta, eta_prime])), axis=1)[:, None]
    found = (omega / first) @ (eta_prime / second).T - (omega_prime / first) @ (eta / second).T
    half = np.pi / 2 / first / second.T
    off = np.abs(np.abs(found) - half * np.eye(curve.genus))
    return float(np.max(off / np.maximum(1.0, half)))
