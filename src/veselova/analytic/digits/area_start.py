"""The start of a body with an area constant to any number of digits: its frame, made exactly
orthonormal, and its momentum in space.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from veselova.analytic.closed.area_veselova import unit_of, vector_of
from veselova.mechanics.core.enclosures import Objects, enclose, rational, working_digits
from veselova.mechanics.geometry.symmetric_axes import midpoints
from veselova.mechanics.systems.rigid_body import RigidBody

__all__ = ["exact_start"]

#: Digits beyond those asked for.
_SPARE = 30

#: A column of the natural frame in double precision this near to one of many digits is that one.
_NEARLY_NATURAL = 1e-9


def exact_start(body: RigidBody, digits: int) -> tuple[Objects, tuple[Fraction, ...]]:
    """Return the frame at t = 0, (3, 3), orthonormal, and the components of K along e_1, e_2, e_3,
    the first the area constant: rationals along the principal axes, which are exact, whose error is
    below 10^−digits.

    K = 𝓘Ω − (𝓘Ω,γ)γ + (Ω,γ)γ, or that of Chaplygin's ball, K = JΩ − D(Ω,γ)γ.

    The frame is the natural one of γ and γ̇ = γ×Ω where none was given and double precision knows
    it: γ, p/|p| and their vector product. Otherwise it is that in double precision, made
    orthonormal.
    """
    with working_digits(digits + _SPARE):
        gamma = unit_of(vector_of(body.exact_gamma))
        Omega, moments = vector_of(body.exact_Omega), vector_of(body.moments)
        frame = _natural(gamma, Omega, moments, body) if body.exact_frame is None else None
        if frame is None:
            frame = _orthonormal(gamma, body, digits)
        M = Omega * moments
        shift = Omega @ gamma
        D = body.added
        shift = shift - M @ gamma if D is None else -vector_of([D])[0] * shift
        momentum = tuple(map(rational, (M + shift * gamma) @ frame))
        return np.frompyfunc(rational, 1, 1)(frame), momentum


def _natural(gamma: Objects, Omega: Objects, moments: Objects, body: RigidBody) -> Objects | None:
    """Return the columns γ, ±p×γ/|p|, ±p/|p| in the order and with the signs of the frame in
    double precision; None where it is another.
    """
    rate = np.cross(gamma, Omega)
    Aq, Av = gamma / moments, rate / moments
    p = midpoints((gamma @ Aq) * Av - (rate @ Aq) * Aq)
    if all(x == 0 for x in p):
        return None
    p = unit_of(p)
    found = [gamma]
    for near in body.frame.T[1:]:
        for vector in (p, np.cross(p, gamma)):
            cosine = float(np.dot(near, vector.astype(np.float64)))
            if abs(cosine) > 1 - _NEARLY_NATURAL:
                found.append(vector if cosine > 0 else -vector)
    return np.stack(found, axis=1) if len(found) == 3 else None


def _orthonormal(gamma: Objects, body: RigidBody, digits: int) -> Objects:
    """Return γ and the polar factor of the given columns across it: the nearest orthonormal
    vectors, by Newton–Schulz steps X(3 − XᵀX)/2.
    """
    given = body.frame if body.exact_frame is None else body.exact_frame
    X = enclose(np.array(given, dtype=object))[:, 1:]
    X = X - np.outer(gamma, gamma @ X)
    for _ in range((digits + _SPARE).bit_length() + 6):
        X = midpoints((3 * X - X @ (X.T @ X)) / 2)
    return np.column_stack([gamma, X])
