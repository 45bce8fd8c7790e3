"""Zeros of secular functions f(x) = κ + Σ w_i/(x−p_i), w_i ≥ 0: one between each two neighbouring
poles, O(m) a step.

In as many digits as it takes.
"""

from __future__ import annotations

import math
from decimal import Decimal
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import Decimals, Values
from veselova.mechanics.core.budget import checkpoint

__all__ = ["TooFewDigits", "zeros_between_poles"]

Array = NDArray[np.float64]

#: Derived: Newton's method doubles the digits; where it leaves the bracket, that is halved in the
#: logarithm.
_MOST_STEPS = 300

#: Where a bracket still begins at zero, its logarithm is halved down to this part of its end.
LEAST_PART = Decimal("1e-30")

#: Derived: a bracket over more than this is not one in which Newton's method converges
#: quadratically.
WIDE_BRACKET = 1000

#: Newton's method that changes less than this part of the distance converges, however wide the
#: bracket.
_CONVERGING = Decimal("1e-3")

#: Derived: iterations settle at this relative change, or at so many roundings; from there every
#: plain Newton step doubles the digits.
_CONVERGED = Decimal("1e-300")
_SETTLED_DIGITS = 300
ROUNDINGS = 4


class TooFewDigits(Exception):
    """The sums cancel below the digits of the arithmetic, so that an iteration does not settle: ask
    again with more.
    """


def zeros_between_poles(
    poles: Values, weights: Values, constant: int, arithmetic: Decimals
) -> list[Any]:
    """Return the zeros of f between increasing poles and the poles of weight zero, all increasing:
    m−1 numbers for m poles.

    They are the eigenvalues of diag(p) restricted to √w⊥ (κ = 0), or those of diag(p) − √w√wᵀ but
    the lowest (κ = 1), to the digits of ``arithmetic`` relative to the largest pole; call it
    ``with`` that. Raises TooFewDigits.
    """
    live = [(p, w) for p, w in zip(poles, weights, strict=True) if w > 0]
    zeros = [p for p, w in zip(poles, weights, strict=True) if not w > 0]
    return sorted([*zeros, *(_zero(live, a, constant, arithmetic) for a in range(len(live) - 1))])


def _zero(live: list[tuple[Any, Any]], a: int, constant: int, arithmetic: Decimals) -> Any:
    """Return the zero between poles a and a+1, found as its distance from the nearer one."""
    (low, _), (high, _) = live[a], live[a + 1]
    width = high - low
    if width == 0:
        return low
    lower = [(low - pole, weight) for pole, weight in reversed(live[: a + 1])]
    upper = [(pole - high, weight) for pole, weight in live[a + 1 :]]
    if _scaled_secular(lower, upper, constant, width, width / 2)[0] <= 0:
        return low + _distance(lower, upper, constant, width, arithmetic)
    return high - _distance(upper, lower, -constant, width, arithmetic)


def _scaled_secular(
    near: list[tuple[Any, Any]], far: list[tuple[Any, Any]], constant: Any, width: Any, own: Any
) -> tuple[Any, Any]:
    """Return δ(width−δ) h(δ) and its derivative, h = κ + Σ_near w/(d+δ) − Σ_far w/(d+width−δ); both
    lists start at d = 0.

    All distances are sums of positive terms, and the product has no pole on [0, width].
    """
    other = width - own
    rest = 0 * own + constant
    slope = 0 * own
    for distances, sign, to_end in ((near, 1, own), (far, -1, other)):
        for distance, weight in distances[1:]:
            inverse = 1 / (distance + to_end)
            term = weight * inverse
            rest = rest + sign * term
            slope = slope - term * inverse
    near_weight = near[0][1]
    far_weight = far[0][1]
    value = near_weight * other - far_weight * own + own * other * rest
    return value, (other - own) * rest + own * other * slope - near_weight - far_weight


def _distance(
    near: list[tuple[Any, Any]],
    far: list[tuple[Any, Any]],
    constant: int,
    width: Any,
    arithmetic: Decimals,
) -> Any:
    """Return the zero δ of h in (0, width/2] to the digits of the arithmetic relative to itself:
    bracketed Newton steps.
    """
    least = 0 * width
    most = width / 2
    own = width * near[0][1] / (near[0][1] + far[0][1])
    own = min(own, most)
    for step in range(_MOST_STEPS):
        checkpoint()
        value, derivative = _scaled_secular(near, far, constant, width, own)
        if value == 0:
            return own
        least, most = (own, most) if value > 0 else (least, own)
        new = own - value / derivative if derivative < 0 else 2 * most
        # Towards a nearly double zero at the pole Newton's method only halves the distance, which
        # may be 1e-300.
        slow = step % 4 == 3 and most > WIDE_BRACKET * least and abs(new - own) > _CONVERGING * own
        if slow or not (least <= new <= most and new > 0):
            new = arithmetic.sqrt(most * max(least, most * LEAST_PART))
        change = abs(new - own)
        own = new
        if change <= ROUNDINGS * max(arithmetic.epsilon, _CONVERGED) * own:
            for _ in range(math.ceil(math.log2(max(1.0, arithmetic.digits / _SETTLED_DIGITS)))):
                value, derivative = _scaled_secular(near, far, constant, width, own)
                own = own - value / derivative
            return own
    raise TooFewDigits
