"""The Riemann matrix of a hyperelliptic curve with real branch points, in ball arithmetic."""

from __future__ import annotations

from decimal import Decimal
from typing import Any

import numpy as np

from veselova.analytic.arithmetic.balls import balls
from veselova.analytic.curve.hyperelliptic import Curve
from veselova.analytic.curve.periods import Periods
from veselova.analytic.curve.real_hyperelliptic import RealCurve
from veselova.mechanics.core.decimals import Decimals
from veselova.mechanics.core.errors import Unsolved

__all__ = ["riemann_matrix_decimals"]

#: Working digits beyond those asked for, attempts, each with twice as many of them, and digits of
#: the midpoints beyond those asked for.
_SPARE = 10
_ATTEMPTS = 5
_SHOWN = 3


def riemann_matrix_decimals(curve: RealCurve, digits: int, certified: bool) -> Decimals:
    """Return T of τ = iT with ``digits`` digits after the point, of its largest entry where that is
    above 1; radii are proven where ``certified``.

    Raises Unsolved where a gap is too narrow for that.
    """
    spare = _SPARE
    for _ in range(_ATTEMPTS):
        xp: Any = balls(digits + spare, certified)
        with xp:
            points = np.array([xp.number(b) for b in curve.betas], dtype=object)
            differences = np.array(
                [[xp.number(b - a) for b in curve.betas] for a in curve.betas], dtype=object
            )
            origins = curve.periods.curve.origins
            T = Periods(Curve(xp, points, differences, origins)).riemann_matrix
            middle, radius = xp.decimals(T, digits + _SHOWN)
        largest = max(1, *np.abs(middle).ravel())
        if max(radius.ravel()) <= largest * Decimal(10) ** -digits:
            found = {"riemann_matrix": middle}, {"riemann_matrix": radius}
            return Decimals(digits, certified, *found, ("riemann_matrix",))
        spare = 2 * spare
    raise Unsolved(
        "no-digit-left", f"{digits} digits were not reached with {digits + spare} working digits"
    )
