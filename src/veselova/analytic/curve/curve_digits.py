"""A hyperelliptic curve with real branch points to many digits: working digits are added until
every number has those asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from decimal import Context, Decimal, localcontext
from fractions import Fraction
from functools import cache, partial
from typing import Any

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.arithmetic.balls import balls
from veselova.analytic.curve.curve_values import CurveValues
from veselova.mechanics.core.budget import iterate
from veselova.mechanics.core.decimals import Decimals, Later
from veselova.mechanics.core.enclosures import Pair
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.results.curve import QUASI_PERIODS

__all__ = ["CurveDigits"]

#: Calibrated: working digits beyond those asked for, attempts, each with twice as many of them, and
#: digits of the midpoints beyond those asked for.
_SPARE = 10
_ATTEMPTS = 6
_SHOWN = 3

#: Where radii are compared, whatever the caller's context of decimals.
_COMPARED = Context(traps=[])


def _largest(middle: Values, axis: Any = None) -> Any:
    """Return the largest number, or those along axes, 1 at least."""
    largest: Any = np.max(np.abs(middle), axis=axis, keepdims=True)
    return np.maximum(largest, np.array(Decimal(1), dtype=object))


def _largest_along(axis: int, middle: Values) -> Any:
    """Return the largest number of each row, or column: they have different units."""
    return np.max(np.abs(middle), axis=axis, keepdims=True)


class CurveDigits:
    """One curve to ``digits`` digits, with radii, proven where ``certified``.

    Radii are below 10^−digits: of T and of images absolutely, or of their largest entry where that
    is above 1; of periods by the largest of their row, of coefficients by that of their column, of
    Thomae's values by themselves, of branch points by the largest of all.
    """

    def __init__(self, doubles: CurveValues, digits: int, certified: bool) -> None:
        self._curve = doubles.curve
        self._digits = digits
        self._certified = certified
        self._at = cache(
            lambda working: CurveValues(doubles.curve, balls(working, certified), doubles)
        )

    def of_curve(self, subsets: Callable[[], Sequence[tuple[int, ...]]]) -> Decimals:
        """Return what belongs to the curve itself, each computed when it is first asked for.

        subsets: those of Thomae's formula.
        """
        rows, columns = partial(_largest_along, 1), partial(_largest_along, 0)
        made: dict[str, tuple[Callable[[CurveValues], Values], Callable[[Values], Any]]] = {
            "riemann_matrix": (lambda fine: fine.periods.riemann_matrix, _largest),
            "a_periods": (lambda fine: fine.cycles[0], rows),
            "b_periods": (lambda fine: fine.cycles[1], rows),
            "normalized_differentials": (lambda fine: fine.normalized_differentials, columns),
            "thomae": (lambda fine: fine.thomae(subsets()), np.abs),
        }
        for i, name in enumerate(QUASI_PERIODS):
            made[name] = (lambda fine, i=i: fine.quasi_periods[i], rows)  # type: ignore[misc]
        return self._decimals(
            {name: partial(self._find, *how) for name, how in made.items()}, "riemann_matrix"
        )

    def abel(self, points: Sequence[Fraction | complex], sheets: Sequence[complex]) -> Decimals:
        """Return ``abel``, (N, g, 2): real and imaginary parts of the images of points."""

        def compute(fine: CurveValues) -> Values:
            places = list(zip(points, sheets, strict=True))
            rows = [fine.image(*place) for place in iterate(places)]
            images = np.array(rows, dtype=object).reshape(-1, self._curve.genus)
            return np.stack(fine.arithmetic.parts(images), axis=-1)

        return self._decimals(
            {"abel": partial(self._find, compute, partial(_largest, axis=(1, 2)))}, "abel"
        )

    def invert(self, z: Sequence[Sequence[Fraction]]) -> Decimals:
        """Return ``points`` λ and the ``signs`` of w, (N, g), at points z of the real torus."""
        size = Decimal(max(abs(b) for b in self._curve.points).__ceil__() or 1)
        sines = list[Values]()

        def compute(fine: CurveValues) -> Values:
            points, psi = fine.invert(fine.arithmetic.array(z))
            sines.append(fine.arithmetic.sin(psi))
            return points

        pair = self._find(compute, lambda _: size)
        alternating = (-1) ** (np.arange(self._curve.genus, 0, -1) - 1)
        signs = np.vectorize(Decimal, otypes=[object])(np.where(sines[-1] < 0, -1, 1) * alternating)
        return self._decimals({"points": pair, "signs": (signs, 0 * signs)}, "points")

    def _decimals(self, pairs: dict[str, Pair | Callable[[], Pair]], bounded: str) -> Decimals:
        return Decimals(self._digits, self._certified, Later(pairs, 0), Later(pairs, 1), (bounded,))

    def _find(
        self, compute: Callable[[CurveValues], Values], scale: Callable[[Values], Any]
    ) -> Pair:
        """Return the midpoints and radii of what a curve in balls gives, with enough digits; radii
        are compared with ``scale`` of the midpoints.

        Raises Unsolved (``no-digit-left``) where the most working digits do not suffice.
        """
        spare = _SPARE
        for _ in range(_ATTEMPTS):
            fine = self._at(self._digits + spare)
            with fine.arithmetic as xp:
                try:
                    middle, radius = xp.decimals(compute(fine), self._digits + _SHOWN)
                except ZeroDivisionError:  # a ball that should be away from zero holds it
                    radius = None
            with localcontext(_COMPARED):
                if radius is not None and np.all(
                    radius <= scale(middle) * Decimal(10) ** -self._digits
                ):
                    return middle, radius
            spare = 2 * spare
        digits = self._digits
        reason = f"{digits} digits were not reached with {digits + spare // 2} working digits"
        raise Unsolved("no-digit-left", reason)
