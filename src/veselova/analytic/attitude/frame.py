"""The whole attitude from the angles: q, the normals n_k, γ and q' in closed form (equations (S_n,
printed 6.10) and (wurzel, printed 7.9)).

Write m_s for the unit eigenvectors of A⁻¹ on q⊥ (eigenvalue λ_s). With signed roots

    q_i = ς_i √(|U(I_i)/Ψ'(I_i)|),   v_k = (q', n_k) = √(|U(c_k)/ψ'(c_k)|),
    y_s = √(|Ψ(λ_s)| / Π_{j≠s}|λ_s−λ_j|),   x_s = (q', m_s) = √(|ψ(λ_s)| / Π_{j≠s}|λ_s−λ_j|),   λ_s'
        = 2 x_s y_s,

the two orthogonal matrices (m_s)_i = q_i y_s/(λ_s−I_i) and (n_k, m_s) = x_s v_k/(λ_s−c_k) multiply
to (n_k)_i = Σ_s (m_s)_i (n_k, m_s), the sum in (wurzel). U(r) = Π(r−λ_s), Ψ(r) = Π(r−I_i), ψ(r) =
Π(r−c_k).

Each root is a product of ratios at most one, taken along the interlacing I_s, c_s ≤ λ_s ≤ I_{s+1},
c_{s+1}; the factor of a cut's own end comes from sn or cn and carries the sign, so all entries are
analytic in the angles and keep their relative accuracy where a coordinate turns.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Literal

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.curve.hyperelliptic import Curve
from veselova.analytic.curve.periods import Periods

__all__ = ["Attitude", "Differences", "Frame"]

#: Derived: step of the difference quotients: truncation and rounding both near 1e-8.
STEP = 1e-8


@dataclass(frozen=True)
class Attitude:
    """The body at N points of the torus, along sorted principal axes.

    - q: (N, n)
    - normals: (N, n, g) columns n_2 … n_{n−1}, γ
    - components: (N, g) of q' along them
    - spheroconic: (N, g)
    """

    q: Values
    normals: Values
    components: Values
    spheroconic: Values

    @property
    def q_prime(self) -> Values:
        """Return q' = dq/dτ₁ = Σ_k v_k n_k, shape (N, n)."""
        return np.asarray((self.normals * self.components[:, None, :]).sum(axis=2))

    @classmethod
    def concatenate(cls, parts: list[Attitude]) -> Attitude:
        """Return the attitudes one after the other."""
        return cls(
            *(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(cls))
        )


@dataclass(frozen=True)
class Frame:
    """The closed formula of the frame for one curve; ``signs`` (n,) are the ς_i, constants of the
    motion.
    """

    periods: Periods
    signs: Values

    def at(self, psi: Values) -> Attitude:
        """Return the attitude at angles ψ of shape (N, g); entries change sign with ψ_s → ψ_s + 2π
        as they do in time.
        """
        point = _Point(self, psi)
        g = self.periods.genus
        q, position = _orthogonal(point, "I", self.signs[:, None])
        v, velocity = _orthogonal(point, "c", None)
        order = [*range(1, g), 0]  # n_2 … n_{n−1}, then γ, which belongs to c_1 = 0
        normals = position.transpose(2, 1, 0) @ velocity[:, order].transpose(2, 0, 1)
        lower_ends = self.periods.curve.branch_points[1 : 2 * g : 2]
        return Attitude(q.T, normals, v[order].T, lower_ends + point.on_cuts[0].T)

    @cached_property
    def half_periods(self) -> Values:
        """Return ν ∈ {0, 1}^g, (2^g, g): at the angles πν, the half periods z = ½ν, every λ_s is a
        branch point.
        """
        genus = self.periods.genus
        return self.periods.arithmetic.array(
            np.arange(2**genus)[:, None] >> np.arange(genus)[::-1] & 1
        )


@dataclass(frozen=True)
class Differences:
    """Difference quotients of the frame along directions (N, g, d) at points (N, g)."""

    points: Values
    directions: Values

    @cached_property
    def _lengths(self) -> Values:
        # Where angles are ill-conditioned their directions are long, and a fixed step would lead
        # out of the neighbourhood.
        return np.asarray(STEP / np.maximum(1.0, np.max(np.abs(self.directions), axis=1)))

    @property
    def ends(self) -> Values:
        """Return the points between which differences are taken, shape ((1+d)N, g): these points,
        and one in each direction.
        """
        steps = np.moveaxis(self.directions * self._lengths[:, None, :], 2, 0)
        return np.concatenate([self.points[None], self.points + steps]).reshape(
            -1, self.points.shape[1]
        )

    def quotients(self, values: Values) -> Values:
        """Return the derivatives of K numbers, shape (N, K, d), from their values at the ends,
        shape ((1+d)N, …).
        """
        count, _, number = self.directions.shape
        entries = values.reshape(1 + number, count, -1)
        return np.asarray(np.moveaxis(entries[1:] - entries[0], 0, 2) / self._lengths[:, None, :])


@dataclass(frozen=True)
class _Point:
    """The distances and signed roots at given angles, shared by the products. Axes: s = 1…g, branch
    points b_i, N points.
    """

    frame: Frame
    psi: Values

    @property
    def curve(self) -> Curve:
        """Return the curve."""
        return self.frame.periods.curve

    @cached_property
    def own_roots(self) -> Values:
        """Return the signed root of |λ_s−b_i| at each end b_i of its cut s, along sn or cn, and one
        for b_0, (2g+1, N).
        """
        below, above = self.frame.periods.roots_on_cuts(self.psi)
        result = np.full((2 * len(below) + 1, self.psi.shape[0]), self.curve.arithmetic.number(1))
        result[1::2], result[2::2] = below, above
        return result

    @cached_property
    def on_cuts(self) -> tuple[Values, Values]:
        """Return λ_s−b_{2s−1} and b_{2s}−λ_s, each (g, N)."""
        squares = self.own_roots * self.own_roots
        return squares[1::2], squares[2::2]

    @cached_property
    def roots(self) -> Values:
        """Return √|λ_s−b_i|, (g, 2g+1, N), one where b_i ends cut s."""
        points = zip(self.frame.periods.cuts, *self.on_cuts, strict=True)
        distances = np.stack([cut.to_branch_points(*at) for cut, *at in points])
        cuts = np.arange(self.curve.genus)
        for end in (1, 2):
            distances[cuts, 2 * cuts + end] = self.curve.arithmetic.number(1)
        return np.asarray(self.curve.arithmetic.sqrt(distances))

    @cached_property
    def roots_between(self) -> Values:
        """Return √|λ_s−λ_j|, (g, g, N), one for s = j: of what is above λ_s on its cut, the stretch
        between, and below λ_j.
        """
        (below, above), g = self.on_cuts, self.curve.genus
        cuts = np.arange(g)
        between = self.curve.differences[2 : 2 * g + 1 : 2, 1 : 2 * g : 2]
        forward = above[:, None] + between[:, :, None] + below
        result = np.where((cuts[:, None] < cuts)[:, :, None], forward, np.swapaxes(forward, 0, 1))
        result[cuts, cuts] = self.curve.arithmetic.number(1)
        return np.asarray(self.curve.arithmetic.sqrt(result))


def _orthogonal(
    point: _Point, kind: Literal["I", "c"], signs: Values | None
) -> tuple[Values, Values]:
    """Return the signed column values (q_i or v_k), (m, N), and the matrix column·row/(λ_s−b), (g,
    m, N), for one kind of b; q and v are columns of the two matrices. ``signs``: (m, 1).
    """
    curve = point.curve
    layout = curve.layouts[kind]
    near = point.roots[:, layout.places]
    own = point.own_roots[layout.places]
    # √(|U(b)/Φ'(b)|) without the factor of b's own cut: ratios to the b of the same kind beyond
    # each λ_s.
    columns = np.prod(near / curve.root_stretches[kind][:, :, None], axis=0)
    if signs is not None:
        columns = columns * signs
    # √(Π|λ_s−b| / Π_{j≠s}|λ_s−λ_j|) over the b that are not ends of cut s; the outermost (c_1, or
    # I_1 and I_n) have no partner.
    ratios = near.copy()
    cuts = np.arange(curve.genus)[:, None]
    ratios[:, 1 : curve.genus] /= point.roots_between[cuts, layout.partners]
    rows = np.prod(ratios, axis=1)
    whole_rows = rows.copy()
    values = columns * own
    for k, s, _ in layout.ends:
        whole_rows[s] *= own[k]
    matrix = layout.sides[:, :, None] * (values / near) * (whole_rows[:, None] / near)
    # The root of |λ_s−b| stands in both factors and cancels the quotient; that of the cut's other
    # end stays.
    for k, s, mate in layout.ends:
        entry = layout.sides[s, k] * columns[k] * rows[s]
        matrix[s, k] = entry if mate < 0 else entry * own[mate]
    return values, matrix
