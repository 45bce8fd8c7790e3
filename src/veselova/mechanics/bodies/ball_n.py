"""A ball in ℝⁿ, n ≥ 4, that rolls on a hyperplane: mass, radius, and an inertia with which its
motion is integrable.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.bodies.ball import BallData
from veselova.mechanics.bodies.principal_inertia import require_moderate
from veselova.mechanics.bodies.special_inertia import GivenInertia, pair_of
from veselova.mechanics.bodies.wide_axes import WideAxes
from veselova.mechanics.core.errors import Faults, InvalidInput
from veselova.mechanics.core.exact_input import (
    require_truth_value,
    round_to_text,
    square_root,
    to_float,
)
from veselova.mechanics.geometry.sphere import INPUT_TOLERANCE

__all__ = ["BallN"]

Array = NDArray[np.float64]
Vector = tuple[Fraction, ...]


@dataclass(frozen=True)
class BallN(BallData):
    """A ball in ℝⁿ, and where it touches the hyperplane at t = 0.

    Of the numbers J_ij = scale·A_iA_j/det A the moments about the centre follow: I_ij = J_ij − ma²
    for a ball that may not twist, m²a⁴/(J_ij − ma²) for one that is free to.

    - A: n positive numbers, exactly
    - scale: positive
    - moments: n(n−1)/2 numbers I_ij, i < j, in lexicographic order
    - wide_axes: the axes that A belongs to, None where they are the body's
    """

    A: tuple[Fraction, ...]
    scale: Fraction
    moments: Vector
    wide_axes: WideAxes | None

    @classmethod
    def of(
        cls, n: int, twists: bool, inertia: Any, mass: Any, radius: Any, position: Any, strict: Any
    ) -> BallN:
        """Return the ball that is given. Raises InvalidInput, with all faults.

        ``inertia``: {"special": A}, the A of J with scale 1, n numbers or a matrix; or the
        n(n−1)/2 moments; or the operator as a matrix, bare or as {"matrix": …}.
        """
        faults = Faults()
        faults.attempt(require_truth_value, strict, "strict")
        data = faults.attempt(BallData.read, mass, radius, _contact(position, n), n - 1)
        stated = faults.attempt(GivenInertia.of, inertia, n)
        faults.require_none()
        added = data.added
        if stated.special:
            A, scale = stated.numbers, Fraction(1)
            J = _products(A, scale)
            if min(J) <= added:
                i, j = pair_of(J.index(min(J)), n)
                required = f"A_iA_j/det A above ma² = {round_to_text(added)}"
                given = f"A_{i}A_{j}/det A = {round_to_text(min(J))}"
                raise InvalidInput(("inertia", "special"), required, given)
            moments = tuple(added**2 / (x - added) if twists else x - added for x in J)
        else:
            moments = stated.numbers
            J = tuple(added + (added**2 / x if twists else x) for x in moments)
            A, scale = _special(J, n, twists)
        ball = cls(data.mass, data.radius, data.contact, A, scale, moments, stated.axes)
        require_moderate((*moments, added), "inertia")
        return ball

    @property
    def n(self) -> int:
        """Return the dimension."""
        return len(self.A)

    @cached_property
    def roots(self) -> Array:
        """Return x_i = A_i√(scale/det A), (n,): J_ij = x_ix_j."""
        unit = self.scale / math.prod(self.A)
        return np.array([square_root(x * x * unit) for x in self.A])

    @cached_property
    def operator(self) -> Array:
        """Return the moments about the centre, (n(n−1)/2,)."""
        return to_float(self.moments)

    @property
    def axes(self) -> Array | None:
        """Return the axes that A and the moments belong to as columns, (n, n), a rotation of the
        body's; None where they are the same.
        """
        return None if self.wide_axes is None else self.wide_axes.rounded

    def to_axes(self, vector: Vector) -> Vector:
        """Return the components along these axes, to 2^−256 of the largest."""
        return vector if self.wide_axes is None else self.wide_axes.to_axes(vector)


def _contact(position: Any, n: int) -> Any:
    """Return the contact point; the pair (0, 0), which stands for none, is the origin."""
    try:
        left_out = len(position) == 2 and not any(position)
    except (TypeError, ValueError):
        return position
    return (0,) * (n - 1) if left_out else position


def _products(A: tuple[Fraction, ...], scale: Fraction) -> Vector:
    unit = scale / math.prod(A)
    return tuple(x * y * unit for x, y in combinations(A, 2))


def _special(J: Vector, n: int, twists: bool) -> tuple[tuple[Fraction, ...], Fraction]:
    """Return A, with A_1 = 1, and the scale of J_ij = scale·A_iA_j/det A; raises InvalidInput where
    J is off by more than 1e-9 of itself.
    """
    entries = dict(zip(combinations(range(n), 2), J, strict=True))
    A = [Fraction(1), entries[1, 2] / entries[0, 2]]
    A += [entries[1, i] / entries[0, 1] for i in range(2, n)]
    scale = entries[0, 1] * math.prod(A[2:])
    off = [abs(x / y - 1) for x, y in zip(J, _products(tuple(A), scale), strict=True)]
    if max(off) > Fraction(INPUT_TOLERANCE):
        i, j = pair_of(off.index(max(off)), n)
        what = "ma² + m²a⁴/I_ij" if twists else "I_ij + ma²"
        required = f"special moments, {what} = c A_iA_j/det A to 1e-9"
        given = f"moments whose I_{i}{j} is off by {float(max(off)):.3g} of that"
        raise InvalidInput(("inertia",), required, given)
    return tuple(A), scale
