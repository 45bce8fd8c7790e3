"""Zeros of secular functions f(x) = κ + Σ w_i/(x−p_i), w_i ≥ 0: one between each two neighbouring poles, O(m) a step."""

from __future__ import annotations

from typing import Any

from veselova.analytic.precision import Extended, Values
from veselova.mechanics.errors import InternalContradiction

__all__ = ["zeros_between_poles"]

#: Newton's method doubles the digits; before, a bracket over many orders of magnitude is halved in the logarithm.
_MOST_STEPS = 300


def zeros_between_poles(poles: Values, weights: Values, constant: int, arithmetic: Extended) -> list[Any]:
    """Return the zeros of f between increasing poles and the poles of weight zero, all increasing: m−1 numbers for m poles.

    They are the eigenvalues of diag(p) restricted to √w⊥ (κ = 0), or those of diag(p) − √w√wᵀ but the lowest (κ = 1), to
    the digits of ``arithmetic`` relative to the largest pole. Raises InternalContradiction where the iteration does not settle.
    """
    live = [(p, w) for p, w in zip(poles, weights, strict=True) if w > 0]
    zeros = [p for p, w in zip(poles, weights, strict=True) if not w > 0]
    return sorted([*zeros, *(_zero(live, a, constant, arithmetic) for a in range(len(live) - 1))])


def _zero(live: list[tuple[Any, Any]], a: int, constant: int, arithmetic: Extended) -> Any:
    """Return the zero between poles a and a+1 by Newton's method for (x−p_a)(p_{a+1}−x) f(x), which has no pole there."""
    (low, lower_weight), (high, upper_weight) = live[a], live[a + 1]
    width = high - low
    # Distances to all other poles are sums of positive terms, from whichever end of the interval is nearer.
    before = [(low - pole, weight) for pole, weight in live[:a]]
    beyond = [(pole - high, weight) for pole, weight in live[a + 2 :]]
    if width == 0:
        return low
    below = width * lower_weight / (lower_weight + upper_weight)
    least, most = 0 * width, width
    tiny = width * arithmetic.epsilon
    for _ in range(_MOST_STEPS):
        above = width - below
        rest, slope = 0 * below + constant, 0 * below
        for distances, sign, own in ((before, 1, below), (beyond, -1, above)):
            for distance, weight in distances:
                inverse = 1 / (distance + own)
                term = weight * inverse
                rest, slope = rest + sign * term, slope - term * inverse
        value = lower_weight * above - upper_weight * below + below * above * rest
        if value == 0:
            return low + below
        derivative = (above - below) * rest + below * above * slope - lower_weight - upper_weight
        least, most = (below, most) if value > 0 else (least, below)
        new = below - value / derivative if derivative < 0 else 2 * most
        if not least <= new <= most:
            new = _middle(least, most, width, tiny, arithmetic)
        change, below = abs(new - below), new
        if change <= 4 * arithmetic.epsilon * min(below, width - below) or most - least <= tiny:
            return low + below
    raise InternalContradiction("the zero of a secular function was not found")


def _middle(least: Any, most: Any, width: Any, tiny: Any, arithmetic: Extended) -> Any:
    """Return a point between: the middle, or near an end of [0, width] the middle of the logarithms of the distances from it."""
    if most <= width / 2:
        return arithmetic.sqrt(most * max(least, tiny))
    if least >= width / 2:
        return width - arithmetic.sqrt((width - least) * max(width - most, tiny))
    return (least + most) / 2
