"""The start of a body with an area constant to any number of digits: its frame, made exactly
orthonormal, and its momentum in space.
"""

from __future__ import annotations

import decimal
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from veselova.mechanics.core import decimal_vectors as vectors
from veselova.mechanics.core.decimal_vectors import Vector
from veselova.mechanics.systems.rigid_body import RigidBody

__all__ = ["AreaStart", "exact_start"]

#: Digits beyond those asked for.
_SPARE = 60

#: A column of the natural frame in double precision this near to one of many digits is that one.
_NEARLY_NATURAL = 1e-9


@dataclass(frozen=True)
class AreaStart:
    """The state at t = 0 along the principal axes, rationals whose error is below 10^−digits.

    - frame: (3, 3) rows of [e_1 e_2 e_3], orthonormal
    - momentum: (3,) the components of K along e_1, e_2, e_3; the first is the area constant
    """

    frame: tuple[tuple[Fraction, ...], ...]
    momentum: tuple[Fraction, ...]


def exact_start(body: RigidBody, digits: int, added: Fraction | None = None) -> AreaStart:
    """Return the start of a body with exact principal axes, K = 𝓘Ω − (𝓘Ω,γ)γ + (Ω,γ)γ, or, with
    ``added`` D, that of Chaplygin's ball, K = JΩ − D(Ω,γ)γ.

    The frame is the natural one of γ and γ̇ = γ×Ω where none was given and double precision knows
    it: γ, p/|p| and their vector product. Otherwise it is that in double precision, made
    orthonormal.
    """
    with decimal.localcontext() as context:
        context.prec = digits + _SPARE
        context.Emin, context.Emax = decimal.MIN_EMIN, decimal.MAX_EMAX
        gamma, Omega, moments = (
            tuple(vectors.of_rational(x) for x in values)
            for values in (body.exact_gamma, body.exact_Omega, body.moments)
        )
        gamma = vectors.unit(gamma)
        columns = None
        if body.exact_frame is None:
            columns = _natural(gamma, Omega, moments, body)
        if columns is None:
            columns = _orthonormal(gamma, body)
        M = vectors.times(Omega, moments)
        shift = vectors.dot(Omega, gamma)
        if added is None:
            shift -= vectors.dot(M, gamma)
        else:
            shift *= -vectors.of_rational(added)
        K = tuple(x + shift * y for x, y in zip(M, gamma, strict=True))
        momentum = tuple(Fraction(vectors.dot(column, K)) for column in columns)
        rows = tuple(tuple(map(Fraction, row)) for row in zip(*columns, strict=True))
        return AreaStart(rows, momentum)


def _natural(
    gamma: Vector, Omega: Vector, moments: Vector, body: RigidBody
) -> tuple[Vector, ...] | None:
    """Return the columns γ, ±p×γ/|p|, ±p/|p| in the order and with the signs of the frame in
    double precision; None where it is another.
    """
    rate = vectors.cross(gamma, Omega)
    A = tuple(1 / moment for moment in moments)
    Aq = vectors.times(A, gamma)
    Av = vectors.times(A, rate)
    along, across = vectors.dot(gamma, Aq), vectors.dot(rate, Aq)
    p = tuple(along * x - across * y for x, y in zip(Av, Aq, strict=True))
    if not any(p):
        return None
    p = vectors.unit(p)
    found = [gamma]
    for near in body.frame.T[1:]:
        for vector in (p, vectors.cross(p, gamma)):
            cosine = float(np.dot(near, [float(x) for x in vector]))
            if abs(cosine) > 1 - _NEARLY_NATURAL:
                found.append(vector if cosine > 0 else tuple(-x for x in vector))
    return tuple(found) if len(found) == 3 else None


def _orthonormal(gamma: Vector, body: RigidBody) -> tuple[Vector, ...]:
    """Return γ and the polar factor of the given columns across it: the nearest orthonormal
    vectors, by Newton–Schulz steps X(3 − XᵀX)/2.
    """
    given = body.frame.tolist() if body.exact_frame is None else body.exact_frame
    second, third = (tuple(vectors.of_rational(Fraction(row[k])) for row in given) for k in (1, 2))
    second, third = (_across(vector, gamma) for vector in (second, third))
    for _ in range(decimal.getcontext().prec.bit_length() + 3):
        a, b, c = vectors.dot(second, second), vectors.dot(second, third), vectors.dot(third, third)
        pairs = list(zip(second, third, strict=True))
        second = tuple(((3 - a) * x - b * y) / 2 for x, y in pairs)
        third = tuple(((3 - c) * y - b * x) / 2 for x, y in pairs)
    return gamma, second, third


def _across(vector: Vector, gamma: Vector) -> Vector:
    share = vectors.dot(vector, gamma)
    return tuple(x - share * y for x, y in zip(vector, gamma, strict=True))
