"""Jacobi's elliptic functions on a quarter period, each value accurate relative to itself for every modulus.

The modulus is given by both k² and k'² = 1−k², which come as products of differences of branch points: for a closing gap k'²
is tiny and 1−k² would be noise. Angles are ψ = πv/K, so a function of period 2K in v has period 2π in ψ. In doubles k² and k'²
may be arrays (N, 1), none of them zero: the functions then have the shape (N, number of angles), no row depending on the others.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from veselova.analytic.precision import Arithmetic, Values

__all__ = ["Jacobi"]

#: Of many moduli, which have as many terms as the largest nome takes, e^{2y} stops here: its terms are below e^−200 of the first.
_LARGEST_EXPONENT = 200.0


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
        """Return K', the quarter period of the complementary modulus; infinite (raises) for a closed cut, k = 0."""
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
        """Return sn, cn, dn at v = Kψ/π for any real ψ; sn and cn have period 4π in ψ, and their signs say where."""
        xp = self.arithmetic
        quarters = xp.floor(psi / xp.pi)
        # Half angles from the nearer end keep cn near K, and sn near 0, accurate relative to themselves.
        offset = psi - quarters * xp.pi
        turn = np.array(quarters, dtype=float).astype(np.int64) % 4
        offset = np.where(turn % 2 == 1, xp.pi - offset, offset)
        near_end = offset > xp.pi / 2
        s, c, d = self._first_half(np.where(near_end, xp.pi - offset, offset))
        k_prime = xp.sqrt(self.complement)
        s, c, d = np.where(near_end, c / d, s), np.where(near_end, k_prime * s / d, c), np.where(near_end, k_prime / d, d)
        return np.where(turn >= 2, -s, s), np.where((turn == 1) | (turn == 2), -c, c), d

    def _first_half(self, psi: Values) -> tuple[Values, Values, Values]:
        """Return sn, cn, dn for 0 ≤ ψ ≤ π/2 (v ≤ K/2) by theta series in whichever nome is at most e^(−π)."""
        if self._stacked:
            pairs = zip(self._trigonometric(psi), self._hyperbolic(psi), strict=True)
            s, c, d = (np.where(self.aspect >= 1, *pair) for pair in pairs)
            return s, c, d
        return self._trigonometric(psi) if self.aspect >= 1 else self._hyperbolic(psi)

    @cached_property
    def _log_nome(self) -> Any:
        if self._stacked:
            return -self.arithmetic.pi * np.maximum(self.aspect, 1 / self.aspect)
        ratio = self.conjugate_quarter / self.quarter
        return -self.arithmetic.pi * (ratio if self.aspect >= 1 else 1 / ratio)

    @cached_property
    def _terms(self) -> int:
        """Number of terms m ≥ 1: the least M with nome^(M²+M), which bounds what is left out, at the precision or below."""
        decay = math.pi if self._stacked else -float(self._log_nome)
        return max(1, math.ceil(math.sqrt(0.25 + self.arithmetic.nats / decay) - 0.5))

    @cached_property
    def _powers(self) -> list[tuple[int, Any, Any]]:
        """Return m, q^{m²+m} and q^{m²} for the nome q, m = 1…_terms."""
        exp, q = self.arithmetic.exp, self._log_nome
        # A float times an array takes half as long as a NumPy scalar does.
        number = np.asarray if self._stacked else self.arithmetic.number
        return [(m, number(exp(q * (m * m + m))), number(exp(q * (m * m)))) for m in range(1, self._terms + 1)]

    @cached_property
    def _constants(self) -> tuple[Any, Any, Any]:
        """Return θ_2/q^{1/4}, θ_3, θ_4 at zero."""
        one = self.arithmetic.number(1)
        t2, t3, t4 = 2 * one, one, one
        for m, odd, even in self._powers:
            t2, t3, t4 = t2 + 2 * odd, t3 + 2 * even, t4 + 2 * (-1) ** m * even
        return self._truncated(t2, t3, t4)

    def _truncated(self, *sums: Any) -> tuple[Any, ...]:
        """Return sums over m ≤ M = _terms with what they leave out, at most nome^(M²+M).

        With y ≤ ¼|log nome| the first omitted term, m = M+1, is at most (2m+1) nome^(m²+m/2) in z1 and z2, 2 nome^(m²−(2m−1)/4)
        in z3 and z4, less at real z and at zero, and the others are below a tenth of it, for a nome of at most e^(−π).
        """
        xp = self.arithmetic
        if not xp.has_radii:
            return sums
        bound = xp.exp(self._log_nome * (self._terms**2 + self._terms))
        return tuple(xp.widened(value, bound) for value in sums)

    def _trigonometric(self, psi: Values) -> tuple[Values, Values, Values]:
        """sn = (θ3/θ2) θ1(z)/θ4(z), cn = (θ4/θ2) θ2(z)/θ4(z), dn = (θ4/θ3) θ3(z)/θ4(z), z = πv/2K = ψ/2.

        With C_j = cos 2jz from the recurrence, sin (2m+1)z = (1 + 2 Σ_{j≤m} C_j) sin z keeps its accuracy relative to itself, and
        cos (2m+1)z = (−1)^m (1 + 2 Σ_{j≤m} (−1)^j C_j) cos z.
        """
        xp = self.arithmetic
        sine, cosine = xp.sin(psi / 2), xp.cos(psi / 2)
        if not self._stacked and self.k_squared == 0:
            return sine, cosine, 0 * psi + 1
        t2, t3, t4 = self._constants
        before, wave = 0 * psi + 2, 2 - 4 * sine * sine  # 2C_m
        factor, sum_, alternating = wave, 1, 1
        z1 = z2 = z3 = z4 = 1
        for m, odd, even in self._powers:
            term, sum_ = even * wave, sum_ + wave
            alternating, z4 = (alternating - wave, z4 - term) if m % 2 else (alternating + wave, z4 + term)
            weight = -odd if m % 2 else odd
            z1, z2, z3 = z1 + weight * sum_, z2 + weight * alternating, z3 + term
            before, wave = wave, factor * wave - before
        z1, z2 = 2 * z1, 2 * z2
        z1, z2, z3, z4 = self._truncated(z1, z2, z3, z4)
        z1, z2 = z1 * sine, z2 * cosine
        return (t3 / t2) * z1 / z4, (t4 / t2) * z2 / z4, (t4 / t3) * z3 / z4

    def _hyperbolic(self, psi: Values) -> tuple[Values, Values, Values]:
        """Jacobi's imaginary transformation: sn = (θ3/θ4) (θ1/i)/θ2, cn = (θ2/θ4) θ4/θ2, dn = (θ2/θ3) θ3/θ2 at iy, y = πv/2K'.

        All four sums are divided by e^y. With the nome q, E = e^{2y} and D = 1/E their terms are q^{m²+m} (E^m ∓ D^{m+1}) and
        q^{m²} e^{−y} (E^m + D^m); as y ≤ |log q|/4, and M is small where q is (or E is cut), nothing overflows. E^m − D^{m+1} is
        (1 − D)(1 + Σ_{j≤m} (E^j + D^j)), which keeps its accuracy relative to itself.
        """
        xp = self.arithmetic
        y = psi / 2 * (self.quarter / self.conjugate_quarter)
        t2, t3, t4 = self._constants
        twice = 2 * y
        rise, D = -xp.expm1(-twice), xp.exp(-twice)
        E = xp.exp(np.minimum(twice, _LARGEST_EXPONENT) if self._stacked else twice)
        up, down = E, D
        z1, z2, z3, z4, sum_ = 1, 1 + D, 1, 1, 1
        for m, odd, even in self._powers:
            if m > 1:
                up, down = up * E, down * D
            both = up + down
            sum_ = sum_ + both
            term = even * both
            z1, z4 = (z1 - odd * sum_, z4 - term) if m % 2 else (z1 + odd * sum_, z4 + term)
            z2, z3 = z2 + odd * (up + down * D), z3 + term
        first = xp.exp(-y)
        z3, z4 = first * z3, first * z4
        z1, z2, z3, z4 = self._truncated(z1, z2, z3, z4)
        z1 = z1 * rise
        return (t3 / t4) * z1 / z2, (t2 / t4) * z4 / z2, (t2 / t3) * z3 / z2
