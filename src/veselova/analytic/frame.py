"""The whole attitude from the angles: q, the normals n_k, γ and q' in closed form (equations (S_n) and (wurzel)).

Write m_s for the unit eigenvectors of A⁻¹ on q⊥ (eigenvalue λ_s). With signed roots

    q_i = ς_i √(|U(I_i)/Ψ'(I_i)|),   v_k = (q', n_k) = √(|U(c_k)/ψ'(c_k)|),
    y_s = √(|Ψ(λ_s)| / Π_{j≠s}|λ_s−λ_j|),   x_s = (q', m_s) = √(|ψ(λ_s)| / Π_{j≠s}|λ_s−λ_j|),   λ_s' = 2 x_s y_s,

the two orthogonal matrices (m_s)_i = q_i y_s/(λ_s−I_i) and (n_k, m_s) = x_s v_k/(λ_s−c_k) multiply to
(n_k)_i = Σ_s (m_s)_i (n_k, m_s), the sum in (wurzel). U(r) = Π(r−λ_s), Ψ(r) = Π(r−I_i), ψ(r) = Π(r−c_k).

Each root is a product of ratios at most one, taken along the interlacing I_s, c_s ≤ λ_s ≤ I_{s+1}, c_{s+1}; the factor of a
cut's own end comes from sn or cn and carries the sign, so all entries are analytic in the angles and keep their relative
accuracy where a coordinate turns.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from veselova.analytic.periods import Periods
from veselova.analytic.precision import Values

__all__ = ["Attitude", "Frame"]

#: Step of the difference quotient in ψ: truncation and rounding both near 1e-8.
_STEP = 1e-6


@dataclass(frozen=True)
class Attitude:
    """The body at N points of the torus, along sorted principal axes.

    q (N, n) · normals (N, n, g) columns n_2 … n_{n−1}, γ · components (N, g) of q' along them · spheroconic (N, g)
    """

    q: Values
    normals: Values
    components: Values
    spheroconic: Values

    @property
    def q_prime(self) -> Values:
        """Return q' = dq/dτ₁ = Σ_k v_k n_k, shape (N, n)."""
        return np.asarray(np.sum(self.normals * self.components[:, None, :], axis=2))


@dataclass(frozen=True)
class Frame:
    """The closed formula of the frame for one curve; ``signs`` (n,) are the ς_i, constants of the motion."""

    periods: Periods
    signs: Values

    def at(self, psi: Values) -> Attitude:
        """Return the attitude at angles ψ of shape (N, g); entries change sign with ψ_s → ψ_s + 2π as they do in time."""
        return _Point(self, psi).attitude()

    def slopes(self, psi: Values) -> Values:
        """Return the derivatives of all frame entries in the angles, shape (N, n², g), to about 1e-8: a difference quotient."""
        size, genus = self.periods.genus + 1, self.periods.genus
        slopes = np.empty((psi.shape[0], size, size, genus))
        for s in range(genus):
            step = np.zeros(genus)
            step[s] = _STEP / 2
            upper, lower = self.at(psi + step), self.at(psi - step)
            slopes[:, :, 0, s] = (upper.q - lower.q) / _STEP
            slopes[:, :, 1:, s] = (upper.normals - lower.normals) / _STEP
        return slopes.reshape(psi.shape[0], -1, genus)


@dataclass(frozen=True)
class _Point:
    """The distances and signed roots at given angles, computed once and shared by the products."""

    frame: Frame
    psi: Values

    @cached_property
    def _curve(self) -> Any:
        return self.frame.periods.curve

    @cached_property
    def _on_cuts(self) -> list[tuple[Values, Values, Values, Values]]:
        return [cut.distances(self.psi[:, s]) for s, cut in enumerate(self.frame.periods.cuts)]

    @cached_property
    def _to_points(self) -> list[list[Values]]:
        """Return |λ_s−b_i| by cut s and branch point i."""
        cuts = self.frame.periods.cuts
        return [
            [cut.from_branch_point(i, below, above) for i in range(len(self._curve.origins))]
            for cut, (_, _, below, above) in zip(cuts, self._on_cuts, strict=True)
        ]

    @cached_property
    def _between(self) -> dict[tuple[int, int], Values]:
        """Return |λ_s−λ_j| for s ≠ j (from 0): what is above λ_s on its cut, the stretch between, what is below λ_j."""
        d, result = self._curve.differences, {}
        for j in range(len(self._on_cuts)):
            for s in range(j):
                result[s, j] = result[j, s] = self._on_cuts[s][3] + d[2 * s + 2, 2 * j + 1] + self._on_cuts[j][2]
        return result

    def _own_root(self, i: int) -> Values:
        """Return the signed root of |λ_s−b_i| at an end b_i of cut s: along sn at the lower end, along cn at the upper."""
        sn, cn, below, above = self._on_cuts[self._curve.cut_of(i) - 1]
        distance, wave = (below, sn) if i % 2 == 1 else (above, cn)
        root = self._curve.arithmetic.sqrt(distance)
        return np.asarray(np.where(wave < 0, -root, root))

    def _column(self, kind: str, index: int) -> tuple[Values, int | None]:
        """Return √(|U(b)/Φ'(b)|) without the factor of b's own cut, and that cut (from 0; None for c_1 = 0, which ends none)."""
        curve, g = self._curve, self._curve.genus
        b = curve.place[kind, index]
        own = None if b == 0 else curve.cut_of(b) - 1
        size = g + 1 if kind == "I" else g
        product = 0 * self.psi[:, 0] + 1
        for s in range(g):
            partner = s if s < index else s + 1  # the branch point of the same kind beyond λ_s, as seen from b
            ratio = product if s == own else product * self._to_points[s][b]
            product = ratio / abs(curve.differences[b, curve.place[kind, partner]]) if partner < size else ratio
        return curve.arithmetic.sqrt(product), own

    def _row(self, kind: str, s: int) -> tuple[Values, list[int]]:
        """Return √(Π|λ_s−b| / Π_{j≠s}|λ_s−λ_j|) over the b of one kind that are not ends of cut s, and those that are."""
        curve, g = self._curve, self._curve.genus
        ends = [i for i in (2 * s + 1, 2 * s + 2) if curve.origins[i].kind == kind]
        product = 0 * self.psi[:, 0] + 1
        # b_2 … b_s pair with the λ_j below, b_{s+1} … b_g with those above; the outermost (c_1, or I_1 and I_n) are left over.
        partners = {index: (index - 1 if index <= s else index) for index in range(1, g)}
        for index in range(g + 1 if kind == "I" else g):
            b = curve.place[kind, index]
            if b not in ends:
                product = product * self._to_points[s][b]
            if index in partners:
                product = product / self._between[s, partners[index]]
        return curve.arithmetic.sqrt(product), ends

    def _orthogonal(self, kind: str, count: int) -> tuple[list[Values], list[Values], list[list[Values]]]:
        """Return the signed columns (q_i or v_k), rows (y_s or x_s), and the matrix column·row/(λ_s−b) by row s and column."""
        curve, g = self._curve, self._curve.genus
        columns = [self._column(kind, index) for index in range(count)]
        rows = [self._row(kind, s) for s in range(g)]
        if kind == "I":
            columns = [(sign * value, own) for sign, (value, own) in zip(self.frame.signs, columns, strict=True)]
        places = [curve.place[kind, index] for index in range(count)]
        whole_columns = [
            value if own is None else value * self._own_root(b) for (value, own), b in zip(columns, places, strict=True)
        ]
        whole_rows = [self._times_roots(value, ends) for value, ends in rows]
        matrix = []
        for s, (row, ends) in enumerate(rows):
            entries = []
            for index, b in enumerate(places):
                side = 1 if b <= 2 * s + 1 else -1  # the sign of λ_s − b
                if b in ends:  # the root of |λ_s−b| stands in both factors and cancels the quotient
                    others = [i for i in ends if i != b]
                    entries.append(side * columns[index][0] * self._times_roots(row, others))
                else:
                    entries.append(side * whole_columns[index] * whole_rows[s] / self._to_points[s][b])
            matrix.append(entries)
        return whole_columns, whole_rows, matrix

    def _times_roots(self, value: Values, ends: list[int]) -> Values:
        for i in ends:
            value = value * self._own_root(i)
        return value

    def attitude(self) -> Attitude:
        curve, g = self._curve, self._curve.genus
        q, _, position = self._orthogonal("I", g + 1)
        v, _, velocity = self._orthogonal("c", g)
        m: Values = np.moveaxis(np.array(position), 2, 0)  # (N, s, i)
        o: Values = np.moveaxis(np.array(velocity), 2, 0)  # (N, s, k)
        order = [*range(1, g), 0]  # n_2 … n_{n−1}, then γ, which belongs to c_1 = 0
        normals = np.sum(m[:, :, :, None] * o[:, :, None, order], axis=1)
        spheroconic = np.stack(
            [curve.branch_points[2 * s + 1] + below for s, (_, _, below, _) in enumerate(self._on_cuts)], axis=1
        )
        return Attitude(np.stack(q, axis=1), normals, np.stack(v, axis=1)[:, order], spheroconic)
