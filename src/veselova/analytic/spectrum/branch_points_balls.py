"""The spectra of a start, and of the positions along its motion, in balls."""

from __future__ import annotations

from typing import Any

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.arithmetic.balls import Balls, balls
from veselova.analytic.spectrum.branch_points import Resolved, Spectrum, tangent
from veselova.analytic.spectrum.moving_part import Moving
from veselova.analytic.spectrum.polynomials import Polynomials, zeros_of_position
from veselova.mechanics.geometry.spheroconic import to_spheroconic

__all__ = ["enclose_spectrum", "resting_spheroconic", "spheroconic"]

#: Derived: digits of the balls against those in which the zeros were found: differences of nearby
#: zeros and poles enter what follows.
_FINER = 2

#: Derived: digits of zeros found in double precision.
_DOUBLE_DIGITS = 12

#: Calibrated: how much more than perturbation theory the balls may leave open.
_ROOM = 16


def enclose_spectrum(found: Resolved) -> Spectrum:
    """Return the spectrum in balls."""
    xp = balls(_FINER * found.spectrum.arithmetic.digits)
    with xp:
        q, v, rate = tangent(found.moving, xp)
        inverse, points, constants = map(xp.array, Polynomials.of(found.moving).zeros())
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
        with balls(_FINER * xp.digits):
            middle = zeros_of_position(poles, [xp.rational(x) ** 2 for x in q[row]])
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
    """Return the λ's of a start with q̇ = 0, (m−1,), of the m A's along which q has a component."""
    return xp.array(zeros_of_position([1 / a for a in moving.A], moving.q_squared))
