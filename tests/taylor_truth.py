"""Motions to many digits by Taylor series, independent of the package: Neumann's point and
geodesics on an ellipsoid.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any, TypeAlias

import mpmath

__all__ = ["geodesic_at", "neumann_at"]

#: Coefficients of one component.
_Series: TypeAlias = list[Any]
#: From the coefficients of position and velocity up to order k, twice the k-th of the acceleration
#: over 2.
_Acceleration: TypeAlias = Callable[[list[_Series], list[_Series], int], list[Any]]

#: Length of a step, and terms for so many digits: series of these motions reach beyond 0.3.
_STEP, _TERMS_PER_DIGIT = 0.05, 1.3


def _product(a: _Series, b: _Series, k: int) -> Any:
    return mpmath.fdot(a[: k + 1], b[k::-1])


def _rows(values: Sequence[Any]) -> list[Any]:
    return [mpmath.mpf(Fraction(x).numerator) / Fraction(x).denominator for x in values]


def neumann_at(
    A: Sequence[Any], q: Sequence[Any], v: Sequence[Any], t: Any, digits: int
) -> tuple[list[Any], list[Any]]:
    """Return q and q' at t of q'' = −A⁻¹q + [(A⁻¹q,q) − (q',q')]q from a start that is exactly on
    the manifold.
    """
    with mpmath.workdps(digits + 15):
        inverse = [1 / a for a in _rows(A)]
        multiplier: _Series = []

        def acceleration(q: list[_Series], v: list[_Series], k: int) -> list[Any]:
            del multiplier[k:]
            rows = zip(inverse, q, v, strict=True)
            multiplier.append(sum(i * _product(x, x, k) - _product(y, y, k) for i, x, y in rows))
            return [_product(multiplier, x, k) - i * x[k] for i, x in zip(inverse, q, strict=True)]

        return _integrated(acceleration, _rows(q), _rows(v), t, digits)


def geodesic_at(
    A: Sequence[Any], X: Sequence[Any], V: Sequence[Any], s: Any, digits: int
) -> tuple[list[Any], list[Any]]:
    """Return X and dX/ds at s of X'' = −μ A⁻¹X, μ = (X',A⁻¹X')/(A⁻¹X,A⁻¹X); X and V may be numbers
    of mpmath.
    """
    with mpmath.workdps(digits + 15):
        inverse = [1 / a for a in _rows(A)]
        multiplier: _Series = []
        squares: _Series = []

        def acceleration(X: list[_Series], V: list[_Series], k: int) -> list[Any]:
            del multiplier[k:], squares[k:]
            squares.append(sum(i * i * _product(x, x, k) for i, x in zip(inverse, X, strict=True)))
            speed = sum(i * _product(y, y, k) for i, y in zip(inverse, V, strict=True))
            rest = mpmath.fdot(multiplier, squares[k:0:-1]) if k else 0
            multiplier.append((speed - rest) / squares[0])
            return [-i * _product(multiplier, x, k) for i, x in zip(inverse, X, strict=True)]

        return _integrated(acceleration, list(X), list(V), s, digits)


def _integrated(
    acceleration: _Acceleration, q: list[Any], v: list[Any], t: Any, digits: int
) -> tuple[list[Any], list[Any]]:
    end = mpmath.mpf(Fraction(t).numerator) / Fraction(t).denominator
    steps, order = max(1, int(abs(end) / _STEP) + 1), int(_TERMS_PER_DIGIT * digits) + 10
    for _ in range(steps):
        position, velocity = [[x] for x in q], [[y] for y in v]
        for k in range(order):
            for y, a in zip(velocity, acceleration(position, velocity, k), strict=True):
                y.append(a / (k + 1))
            for x, y in zip(position, velocity, strict=True):
                x.append(y[k] / (k + 1))
        step = end / steps
        q, v = ([_value(series, step) for series in both] for both in (position, velocity))
    return q, v


def _value(series: _Series, x: Any) -> Any:
    total = mpmath.mpf(0)
    for coefficient in reversed(series):
        total = total * x + coefficient
    return total
