"""Jacobi's elliptic functions on a quarter period, each value accurate relative to itself for every
modulus.

The modulus is given by both k² and k'² = 1−k², which come as products of differences of branch
points: for a closing gap k'² is tiny and 1−k² would be noise. Angles are ψ = πv/K, so a function of
period 2K in v has period 2π in ψ. In doubles k² and k'² may be arrays (N, 1), none of them zero:
the functions then have the shape (N, number of angles), no row depending on the others.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Arithmetic, Values

__all__ = ["Jacobi"]

#: Derived: of many moduli, which have as many terms as the largest nome takes, cosh 2y stops here:
#: terms are below e^−200 of the first.
LARGEST_WAVE = 1e86


@dataclass(frozen=True)
class Jacobi:
    """sn, cn, dn of modulus k, with K = K(k) and K' = K(k') by the arithmetic–geometric mean."""

    arithmetic: Arithmetic
    k_squared: Any
    complement: Any

    @cached_property
    def quarter(self) -> Any:
        """Return K, the real quarter period; it grows like log(4/k')."""
        return self.arithmetic.quarter_period(self.complement)

    @cached_property
    def conjugate_quarter(self) -> Any:
        """Return K', the quarter period of the complementary modulus; infinite (raises) for a
        closed cut, k = 0.
        """
        return self.arithmetic.quarter_period(self.k_squared)

    @cached_property
    def aspect(self) -> Any:
        """Return K'/K, which sets how fast trigonometric sums in ψ converge; infinite for k = 0."""
        if self._stacked:
            return self.conjugate_quarter / self.quarter
        return float(self.conjugate_quarter / self.quarter) if self.k_squared > 0 else float("inf")

    @property
    def _stacked(self) -> bool:
        return isinstance(self.k_squared, np.ndarray)

    def __call__(self, psi: Values) -> tuple[Values, Values, Values]:
        """Return sn, cn, dn at v = Kψ/π for any real ψ; sn and cn have period 4π in ψ, and their
        signs say where.
        """
        xp = self.arithmetic
        quarters = xp.floor(psi / xp.pi)
        # Half angles from the nearer end keep cn near K, and sn near 0, accurate relative to
        # themselves.
        offset = psi - quarters * xp.pi
        turn = np.array(quarters, dtype=float) % 4
        far = offset > xp.pi / 2
        near_end = far ^ (turn % 2 == 1)
        s, c, d = self._first_half(np.where(far, xp.pi - offset, offset))
        k_prime = xp.sqrt(self.complement)
        s, c, d = (
            np.where(near_end, c / d, s),
            np.where(near_end, k_prime * s / d, c),
            np.where(near_end, k_prime / d, d),
        )
        return np.where(turn >= 2, -s, s), np.where((turn == 1) | (turn == 2), -c, c), d

    def _first_half(self, psi: Values) -> tuple[Values, Values, Values]:
        """Return sn, cn, dn for 0 ≤ ψ ≤ π/2 (v ≤ K/2) by theta series in whichever nome is at most
        e^(−π).

        With z = πv/2K = ψ/2, sn = (θ3/θ2) θ1(z)/θ4(z), cn = (θ4/θ2) θ2(z)/θ4(z), dn = (θ4/θ3)
        θ3(z)/θ4(z); Jacobi's imaginary transformation has θ2 for θ4, and the other way round, of
        the other nome at iy, y = πv/2K', where θ1 is i times its sum.
        """
        xp = self.arithmetic
        if not self._stacked and self.k_squared == 0:
            return xp.sin(psi / 2), xp.cos(psi / 2), 0 * psi + 1
        sine, cosine = self._half_waves(psi / 2)
        square = 4 * sine * sine
        wave = 2 - square if self._is_direct is True else 2 + square
        if self._stacked:
            wave = np.minimum(np.where(self._is_direct, 2 - square, wave), LARGEST_WAVE)
        exponentials = [0 * wave + 1, wave]  # 1, then 2 cos 2mz or 2 cosh 2my
        for m in range(2, self._terms + 1):
            exponentials.append(wave * exponentials[-1] - (exponentials[-2] if m > 2 else 2))
        sums = self._series @ np.stack(exponentials, axis=-2)
        z1, z2, z3, z4 = self._truncate_sums(*(sums[..., i, :] for i in range(4)))
        (t2, t3, t4), (z2, z4) = self._constants, self._exchange(z2 * cosine, z4)
        return (t3 / t2) * z1 * sine / z4, (t4 / t2) * z2 / z4, (t4 / t3) * z3 / z4

    @cached_property
    def _is_direct(self) -> Any:
        """Return whether the nome of k is the smaller one, not that of k'."""
        return self.aspect >= 1 if self._stacked else bool(self.aspect >= 1)

    def _exchange(self, second: Any, fourth: Any) -> tuple[Any, Any]:
        """Return θ2, θ4, or θ4, θ2 where the nome is that of k'."""
        if self._stacked:
            return np.where(self._is_direct, second, fourth), np.where(
                self._is_direct, fourth, second
            )
        return (second, fourth) if self._is_direct else (fourth, second)

    def _half_waves(self, z: Values) -> tuple[Values, Values]:
        """Return sin z, cos z, or sinh y, cosh y where the nome is that of k'."""
        xp = self.arithmetic
        if self._is_direct is True:
            return xp.sin(z), xp.cos(z)
        y = z * (self.quarter / self.conjugate_quarter)
        sine = xp.sinh(y)
        cosine = xp.cosh(y)
        if self._stacked:
            sine = np.where(self._is_direct, xp.sin(z), sine)
            cosine = np.where(self._is_direct, xp.cos(z), cosine)
        return sine, cosine

    @cached_property
    def _log_nome(self) -> Any:
        if self._stacked:
            return -self.arithmetic.pi * np.maximum(self.aspect, 1 / self.aspect)
        ratio = self.conjugate_quarter / self.quarter
        return -self.arithmetic.pi * (ratio if self._is_direct else 1 / ratio)

    @cached_property
    def _terms(self) -> int:
        """Number of terms m ≥ 1: the least M with nome^(M²+M), which bounds what is left out, at
        the precision or below.
        """
        decay = math.pi if self._stacked else -float(self._log_nome)
        return max(1, math.ceil(math.sqrt(0.25 + self.arithmetic.nats / decay) - 0.5))

    @cached_property
    def _powers(self) -> tuple[Values, Values, Values]:
        """Return q^{m²+m}, q^{m²} for the nome q, and (−1)^m, m = 0…_terms, along the last axis."""
        orders = np.arange(self._terms + 1)
        odd, even = (
            self.arithmetic.exp(self._log_nome * powers)
            for powers in (orders * (orders + 1), orders * orders)
        )
        return odd, even, 1 - 2 * (orders % 2)

    @cached_property
    def _series(self) -> Values:
        """Return what of 1, 2C_1 … 2C_M is in θ1/(q^{1/4} sin z), θ2/(q^{1/4} cos z), θ3 and θ4,
        shape (..., 4, M+1).

        With C_j = cos 2jz, sin (2m+1)z = (1 + 2 Σ_{j≤m} C_j) sin z keeps its accuracy relative to
        itself, and so does cos (2m+1)z = (−1)^m (1 + 2 Σ_{j≤m} (−1)^j C_j) cos z; for sinh and cosh
        C_j = cosh 2jy.
        """
        odd, even, signs = self._powers
        of_sums = 2 * np.cumsum((signs * odd)[..., ::-1], axis=-1)[..., ::-1]
        return np.stack([of_sums, signs * of_sums, even, signs * even], axis=-2)

    @cached_property
    def _constants(self) -> tuple[Any, Any, Any]:
        """Return θ_2/q^{1/4}, θ_3, θ_4 at zero, or θ_4, θ_3, θ_2 where the nome is that of k'."""
        odd, even, signs = self._powers
        sums = (
            2 * values.sum(axis=-1, keepdims=self._stacked) for values in (odd, even, signs * even)
        )
        t2, t3, t4 = self._truncate_sums(
            *(value - rest for value, rest in zip(sums, (0, 1, 1), strict=True))
        )
        t2, t4 = self._exchange(t2, t4)
        return t2, t3, t4

    def _truncate_sums(self, *sums: Any) -> tuple[Any, ...]:
        """Return sums over m ≤ M = _terms with what they leave out, at most nome^(M²+M).

        With y ≤ ¼|log nome| the first omitted term, m = M+1, is at most (4m+2) nome^(m²+m/2) in z1
        and z2, 2 nome^(m²−m/2) in z3 and z4, less at real z and at zero, and the others are below a
        tenth of it, for a nome of at most e^(−π).
        """
        xp = self.arithmetic
        if not xp.has_radii:
            return sums
        bound = xp.exp(self._log_nome * (self._terms**2 + self._terms))
        return tuple(xp.add_error(value, bound) for value in sums)
