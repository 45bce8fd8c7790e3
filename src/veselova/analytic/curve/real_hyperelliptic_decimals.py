"""A hyperelliptic curve with real branch points to many digits: working digits are added until
every number has those asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from decimal import Context, Decimal, localcontext
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.arithmetic.balls import balls
from veselova.analytic.curve.abel_images import Halves, image_of
from veselova.analytic.curve.real_hyperelliptic import RealCurve
from veselova.analytic.curve.real_hyperelliptic_balls import CurveInBalls
from veselova.mechanics.core.budget import iterate
from veselova.mechanics.core.decimals import Decimals, Later
from veselova.mechanics.core.enclosures import Pair
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.results.curve import QUASI_PERIODS

__all__ = ["CurveDecimals"]

#: Calibrated: working digits beyond those asked for, attempts, each with twice as many of them, and
#: digits of the midpoints beyond those asked for.
_SPARE = 10
_ATTEMPTS = 6
_SHOWN = 3

#: Where radii are compared, whatever the caller's context of decimals.
_COMPARED = Context(traps=[])

#: What radii are compared with: a function of the midpoints.
Scale = Callable[[Values], Any]


def _largest(middle: Values) -> Any:
    """Return the largest number, 1 at least."""
    return max(Decimal(1), *np.abs(middle).ravel())


def _of_rows(middle: Values) -> Any:
    """Return the largest number of each row: rows have different units."""
    return np.max(np.abs(middle), axis=1, keepdims=True)


def _of_columns(middle: Values) -> Any:
    return np.max(np.abs(middle), axis=0, keepdims=True)


def _of_points(middle: Values) -> Any:
    """Return the largest number of each image (N, g, 2), 1 at least."""
    largest: Any = np.max(np.abs(middle), axis=(1, 2), keepdims=True)
    return np.maximum(largest, np.array(Decimal(1), dtype=object))


def _quasi_periods(number: int, fine: CurveInBalls) -> Values:
    return fine.quasi_periods[number]


class CurveDecimals:
    """One curve to ``digits`` digits, with radii, proven where ``certified``.

    Radii are below 10^−digits: of T and of images absolutely, or of their largest entry where that
    is above 1; of periods by the largest of their row, of coefficients by that of their column, of
    Thomae's values by themselves, of branch points by the largest of all.
    """

    def __init__(
        self, curve: RealCurve, digits: int, certified: bool, halves: Sequence[Halves]
    ) -> None:
        self._curve = curve
        self._digits = digits
        self._certified = certified
        self._halves = halves
        self._in_balls: dict[int, CurveInBalls] = {}

    def of_curve(self, subsets: Callable[[], Sequence[tuple[int, ...]]]) -> Decimals:
        """Return what belongs to the curve itself, each computed when it is first asked for.

        subsets: those of Thomae's formula.
        """
        pairs: dict[str, Pair | Callable[[], Pair]] = {
            "riemann_matrix": partial(self._find, lambda fine: fine.real_matrix(), _largest),
            "a_periods": partial(self._find, lambda fine: fine.cycles[0], _of_rows),
            "b_periods": partial(self._find, lambda fine: fine.cycles[1], _of_rows),
            "normalized_differentials": partial(
                self._find, lambda fine: fine.normalized_differentials, _of_columns
            ),
            "thomae": lambda: self._find(lambda fine: fine.thomae(subsets()), np.abs),
        }
        for i, name in enumerate(QUASI_PERIODS):
            pairs[name] = partial(self._find, partial(_quasi_periods, i), _of_rows)
        return self._decimals(pairs, ("riemann_matrix",))

    def abel(self, points: Sequence[Fraction | complex], sheets: Sequence[complex]) -> Decimals:
        """Return ``abel``, (N, g, 2): real and imaginary parts of the images of points."""

        def compute(fine: CurveInBalls) -> Values:
            rows = [
                image_of(self._curve, fine, self._halves, *place)
                for place in iterate(list(zip(points, sheets, strict=True)))
            ]
            images = np.array(rows, dtype=object).reshape(-1, self._curve.genus)
            return np.stack(fine.arithmetic.parts(images), axis=-1)

        return self._decimals({"abel": partial(self._find, compute, _of_points)}, ("abel",))

    def invert(self, z: Sequence[Sequence[Fraction]]) -> Decimals:
        """Return ``points`` λ and the ``signs`` of w, (N, g), at points z of the real torus."""
        size = Decimal(max(abs(b) for b in self._curve.points).__ceil__() or 1)
        found = dict[int, Values]()

        def compute(fine: CurveInBalls) -> Values:
            points, psi = fine.invert(fine.arithmetic.array(z))
            found[0] = np.where(fine.arithmetic.sin(psi) < 0, -1, 1)
            return points

        pair = self._find(compute, lambda _: size)
        turns = (-1) ** (np.arange(self._curve.genus, 0, -1) - 1)
        signs = np.vectorize(Decimal, otypes=[object])(found[0] * turns)
        return self._decimals({"points": pair, "signs": (signs, 0 * signs)}, ("points",))

    def _decimals(
        self, pairs: dict[str, Pair | Callable[[], Pair]], bounded: tuple[str, ...]
    ) -> Decimals:
        return Decimals(self._digits, self._certified, Later(pairs, 0), Later(pairs, 1), bounded)

    def _find(self, compute: Callable[[CurveInBalls], Values], scale: Scale) -> Pair:
        """Return the midpoints and radii of what a curve in balls gives, with enough digits.

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

    def _at(self, working: int) -> CurveInBalls:
        if working not in self._in_balls:
            arithmetic = balls(working, self._certified)
            self._in_balls[working] = CurveInBalls(self._curve, arithmetic)
        return self._in_balls[working]
