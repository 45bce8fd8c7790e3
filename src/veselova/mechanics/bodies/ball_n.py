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
from veselova.mechanics.bodies.inertia_operator import stated_form
from veselova.mechanics.core.errors import Faults, InvalidInput
from veselova.mechanics.core.exact_input import (
    exact_vector,
    require_moderate,
    require_truth_value,
    round_to_text,
    scale_number,
    square_root,
    to_float,
)

__all__ = ["BallN"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class BallN(BallData):
    """A ball in ℝⁿ, and where it touches the hyperplane at t = 0.

    Of the numbers J_ij = A_iA_j/det A the moments about the centre follow: I_ij = J_ij − ma² for a
    ball that may not twist, m²a⁴/(J_ij − ma²) for one that is free to.

    - A: n positive numbers, exactly
    - moments: n(n−1)/2 numbers I_ij, i < j, in lexicographic order
    """

    A: tuple[Fraction, ...]
    moments: tuple[Fraction, ...]

    @classmethod
    def of(
        cls, n: int, twists: bool, inertia: Any, mass: Any, radius: Any, position: Any, strict: Any
    ) -> BallN:
        """Return the ball that is given, its inertia as {"special": [A_1 … A_n]}. Raises
        InvalidInput, with all faults.
        """
        faults = Faults()
        faults.attempt(require_truth_value, strict, "strict")
        data = faults.attempt(BallData.read, mass, radius, _contact(position, n), n - 1)
        A = faults.attempt(_special, inertia, n)
        faults.require_none()
        added = data.added
        unit = Fraction(1) / math.prod(A)
        J = [x * y * unit for x, y in combinations(A, 2)]
        if min(J) <= added:
            i, j = list(combinations(range(1, n + 1), 2))[J.index(min(J))]
            required = f"A_iA_j/det A above ma² = {round_to_text(added)}"
            given = f"A_{i}A_{j}/det A = {round_to_text(min(J))}"
            raise InvalidInput(("inertia", "special"), required, given)
        moments = tuple(added**2 / (x - added) if twists else x - added for x in J)
        for moment in (min(moments), max(moments)):
            require_moderate([moment], ("inertia",))
        return cls(data.mass, data.radius, data.contact, A, moments)

    @property
    def n(self) -> int:
        """Return the dimension."""
        return len(self.A)

    @cached_property
    def roots(self) -> Array:
        """Return x_i = A_i/√det A, (n,): J_ij = x_ix_j."""
        unit = Fraction(1) / math.prod(self.A)
        return np.array([square_root(x * x * unit) for x in self.A])

    @cached_property
    def operator(self) -> Array:
        """Return the moments about the centre, (n(n−1)/2,)."""
        return to_float(self.moments)


def _special(inertia: Any, n: int) -> tuple[Fraction, ...]:
    """Return the A of {"special": A}, exactly."""
    path = ("inertia", "special")
    _, A = stated_form(inertia, {"special": f'{{"special": [A_1, …, A_{n}]}}'})
    return exact_vector(A, path, n, scale_number)


def _contact(position: Any, n: int) -> Any:
    """Return the contact point; the pair (0, 0), which stands for none, is the origin."""
    try:
        left_out = len(position) == 2 and not any(position)
    except (TypeError, ValueError):
        return position
    return (0,) * (n - 1) if left_out else position
