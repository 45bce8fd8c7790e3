"""The spectra of a start in balls: each zero shown to lie where it was found, by a
change of sign.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from fractions import Fraction
from typing import Any

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Decimals, Values
from veselova.analytic.arithmetic.balls import Balls, balls
from veselova.analytic.spectrum.branch_points import Resolved, Spectrum, tangent
from veselova.analytic.spectrum.moving_part import Moving
from veselova.analytic.spectrum.secular_equation import TooFewDigits, zeros_between_poles
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.geometry.spheroconic import to_spheroconic

__all__ = ["enclose_spectrum", "resting_spheroconic", "spheroconic"]

#: Derived: digits of the balls against those in which the zeros were found: differences of nearby
#: zeros and poles enter what follows.
_FINER = 2

#: Derived: digits of zeros found in double precision.
_DOUBLE_DIGITS = 12

#: Calibrated: how much more than perturbation theory the balls may leave open.
_ROOM = 16

#: Derived: Newton's steps from the zeros found to those digits.
_STEPS = 2

#: Method: a zero is looked for within this many times what its value leaves open, then within so
#: many times that, so often.
_FIRST_REACH = 4
_WIDER = 1000
_WIDENINGS = 5


def enclose_spectrum(found: Resolved) -> Spectrum:
    """Return the spectrum in balls; raises Unsolved where a zero cannot be enclosed.

    Disjoint balls, as many as there are zeros, each with a change of sign of the secular function:
    each holds one.
    """
    coarse = found.spectrum
    xp = balls(_FINER * coarse.arithmetic.digits)
    with xp:
        q, v, rate = tangent(found.moving, xp)
        inverse = xp.array([1 / a for a in found.moving.A])
        points = _zeros(coarse.spheroconic, coarse.inverse, inverse, q * q, 0, xp)
        along = [_component(s, coarse, q, v, inverse, points) for s in range(len(points))]
        known = found.moving.time != "tau1"  # c_1 = 0, but for Neumann's system
        rest = _zeros(
            coarse.constants[int(known) :],
            coarse.spheroconic,
            points,
            xp.array(along) * xp.array(along),
            1,
            xp,
        )
        constants = np.concatenate([xp.array([0]), rest]) if known else rest
        return Spectrum(xp, inverse, q, v, constants, points, rate)


def spheroconic(q: Values, inverse: Values, xp: Any) -> Values:
    """Return the λ's of positions q (N, m), shape (N, m−1): the zeros of Σ q_i² Π_{k≠i}(λ−I_k), all
    positions at once.

    They are eigenvalues of A⁻¹ on q⊥, which move by at most 4|δq| max A⁻¹: where balls of about
    that size cannot be shown to hold them, as they cannot where two nearly meet, they are found one
    position at a time.
    """
    room = _ROOM * (4 * np.sum(np.abs(q - xp.midpoints(q)), axis=1) + 4 * xp.epsilon) * inverse[-1]
    found, around = (_quadratic_zeros if q.shape[1] == 3 else _polynomial_zeros)(
        q, inverse, room, xp
    )
    for row in np.flatnonzero(~xp.contained_in(found, around).all(axis=1)).tolist():
        if not all(x.is_finite() for x in q[row]):
            raise ZeroDivisionError("a position that is not known at all")
        poles = [xp.rational(x) for x in inverse]
        middle = _zeros_of_position(
            poles, [xp.rational(x) ** 2 for x in q[row]], _FINER * xp.digits
        )
        found[row] = xp.add_error(xp.array(middle), room[row] / _ROOM)
    return found


def _quadratic_zeros(q: Values, inverse: Values, room: Values, xp: Any) -> tuple[Values, Values]:
    """Return balls around the zeros for m = 3, (N, 2), and those of the room, which they are inside
    unless they nearly meet.
    """
    squares, (first, second, third) = q * q, inverse
    below = first - second
    above = third - second
    # In λ − I_2 nothing cancels where the poles are near each other: the constant is not positive,
    # and the radicand a sum.
    leading = np.sum(squares, axis=1)
    half = squares @ np.array([above, below + above, below]) / 2
    constant = squares[:, 1] * (below * above)
    root = xp.sqrt(half * half - leading * constant)
    up = np.array([bool(x.mid() >= 0) for x in half])
    far = np.where(up, half + root, half - root)
    of_far = second + far / leading
    of_near = second + constant / far
    zeros = np.stack([np.where(up, of_near, of_far), np.where(up, of_far, of_near)], axis=1)
    return zeros, xp.midpoints(zeros) + xp.zero_ball(room)[:, None]


def _polynomial_zeros(q: Values, inverse: Values, room: Values, xp: Any) -> tuple[Values, Values]:
    """Return a Newton step in balls of the room for any m, (N, m−1), and these balls: inside them
    the step holds the zeros.
    """
    weights = (q * q)[:, :, None]
    zeros = xp.array(to_spheroconic(1 / inverse.astype(float), q.astype(float)))

    def polynomial(x: Values) -> tuple[Values, Values]:
        """Return Σ_{i≤k} w_i Π_{j≠i, j≤k}(x−I_j) and its derivative for k = m, one k from the
        other.
        """
        value = weights[:, 0]
        slope = 0 * x
        product = x - inverse[0]
        product_slope = 1
        for weight, pole in zip(np.moveaxis(weights[:, 1:], 1, 0), inverse[1:], strict=True):
            distance = x - pole
            value, slope = (
                value * distance + weight * product,
                slope * distance + value + weight * product_slope,
            )
            product, product_slope = product * distance, product_slope * distance + product
        return value, slope

    digits = _DOUBLE_DIGITS
    while digits < xp.digits:
        value, slope = polynomial(zeros)
        zeros = xp.midpoints(zeros - xp.midpoints(value) / xp.midpoints(slope))
        digits = 2 * digits
    around = zeros + xp.zero_ball(room)[:, None]
    return np.asarray(zeros - polynomial(zeros)[0] / polynomial(around)[1]), around


def resting_spheroconic(moving: Moving, xp: Balls) -> Values:
    """Return the λ's of a start with q̇ = 0, (m−1,), with m the A's along which q has a component;
    raises Unsolved as above.
    """
    poles = [1 / a for a in moving.A]
    found = _zeros_of_position(poles, list(moving.q_squared), _FINER * xp.digits)
    return _zeros(found, poles, xp.array(poles), xp.array(moving.q_squared), 0, xp)


def _zeros_of_position(
    poles: list[Fraction], weights: list[Fraction], digits: int
) -> list[Fraction]:
    try:
        with Decimals(digits) as arithmetic:
            return [
                Fraction(x)
                for x in zeros_between_poles(
                    arithmetic.array(poles), arithmetic.array(weights), 0, arithmetic
                )
            ]
    except TooFewDigits:
        return _zeros_of_position(poles, weights, _FINER * digits)


def _component(
    s: int, coarse: Spectrum, q: Values, v: Values, inverse: Values, points: Values
) -> Any:
    """Return x_s = (q', m_s), m_s ∝ q_i/(λ_s−I_i), or E_i where λ_s is a pole that q
    does not feel.
    """
    for i, pole in enumerate(coarse.inverse):
        if coarse.spheroconic[s] == pole:
            return v[i]
    live = [i for i in range(len(inverse)) if coarse.q[i] > 0]
    row = q[live] / (points[s] - inverse[live])
    return np.sum(row * v[live]) / np.sum(row * row).sqrt()


def _zeros(
    found: Iterable[Any],
    coarse_poles: Iterable[Any],
    poles: Values,
    weights: Values,
    constant: int,
    xp: Balls,
) -> Values:
    """Return balls around the zeros of constant + Σ w_i/(x−p_i), which falls between its poles; a
    pole of weight zero is one.
    """
    at_pole = dict(zip(coarse_poles, poles, strict=True))
    live = np.array([not weight.is_zero() for weight in weights])

    def secular(x: Any) -> tuple[Any, Any]:
        terms = weights[live] / (x - poles[live])
        return constant + np.sum(terms), -np.sum(terms / (x - poles[live]))

    zeros = [
        at_pole[zero] if zero in at_pole else _enclose_zero(secular, xp.number(zero), xp)
        for zero in found
    ]
    return xp.array(zeros)


def _enclose_zero(falling: Callable[[Any], tuple[Any, Any]], middle: Any, xp: Balls) -> Any:
    for _ in range(_STEPS):
        value, slope = falling(middle)
        middle = (middle - value / slope).mid()
    value, slope = falling(middle)
    reach = _FIRST_REACH * (value / slope.mid()).abs_upper() + xp.epsilon
    for _ in range(_WIDENINGS):
        if falling(middle - reach)[0] > 0 and falling(middle + reach)[0] < 0:
            return xp.add_error(middle, reach)
        reach = _WIDER * reach
    raise Unsolved(
        "not-enclosed",
        "a constant of motion or a spheroconic coordinate: no change of sign could be shown",
    )
