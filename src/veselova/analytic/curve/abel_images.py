"""The image of one point of a hyperelliptic curve with real branch points under the Abel–Jacobi
map, written once over doubles and balls.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.curve.real_hyperelliptic import RealCurve
from veselova.mechanics.core.errors import InvalidInput

__all__ = ["CurveMaps", "image_of"]

#: [ε, δ] of a branch point, entries 0 and ½.
Halves = tuple[NDArray[np.float64], NDArray[np.float64]]


class CurveMaps(Protocol):
    """What ``image_of`` takes of a curve in one arithmetic: doubles (``RealCurve``) or balls."""

    def real_matrix(self) -> Values:
        """Return T of the Riemann matrix iT."""

    def complex_array(self, real: Values, imaginary: Values) -> Values:
        """Return complex numbers of real and imaginary parts."""

    def from_left_end(self, number: int, points: Sequence[Fraction]) -> Values:
        """Return a⁻¹∫ p dμ/(2√|R|) from β_number to points of its interval, (N, g)."""

    def from_nearest_end(self, mu: tuple[Fraction, Fraction]) -> tuple[int | None, Values, complex]:
        """Return (j, a⁻¹∫ p dμ/(2v), v) from the nearest β_j, None for infinity."""


def image_of(
    curve: RealCurve,
    maps: CurveMaps,
    halves: Sequence[Halves],
    point: Fraction | complex,
    w: complex,
) -> Values:
    """Return ∫ of the normalised differentials from the last branch point to (λ, w), (g,), modulo
    the lattice.

    halves: [ε, δ] of each β. On cuts and gaps the sign of w names the sheet (over gaps of its
    imaginary part, or of what it has), elsewhere the nearer root. Raises InvalidInput for w = 0.
    """
    T = maps.real_matrix()
    zero = np.zeros(curve.genus)
    if curve.is_even and point == curve.points[-1]:
        return maps.complex_array(0 * T[0], 0 * T[0])
    mu = curve.to_mu(point)
    number = -1 if mu[1] else curve.place(mu[0])
    if 0 <= number < 2 * curve.genus:
        part = maps.from_left_end(number, [mu[0]])[0]
        epsilon, delta = halves[number]
        on_cut = number % 2 == 1
        named = (w.real or w.imag) if on_cut else (w.imag or w.real)
        if named == 0 and mu[0] not in curve.betas:
            raise InvalidInput(("w",), "a number other than 0, whose sign names the sheet", "0")
        sheet = -1 if named < 0 else 1
        along, across = (sheet * part, zero) if on_cut else (zero, -sheet * part)
        return maps.complex_array(delta + along, T @ epsilon + across)
    j, part, v = maps.from_nearest_end(mu)
    # v = w·(e−λ)^{−g−1} but for a positive factor, where e went to infinity: phases say which.
    angle = cmath.phase(w)
    if curve.is_even:
        angle -= (curve.genus + 1) * cmath.phase(complex(curve.points[-1] - point))
    sign = 1 if math.cos(angle - cmath.phase(v)) >= 0 else -1
    if j is None:
        return np.asarray(sign * part)
    epsilon, delta = halves[j]
    return np.asarray(maps.complex_array(delta + 0 * T[0], T @ epsilon) + sign * part)
