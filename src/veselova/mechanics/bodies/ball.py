"""Balls on a plane, and on a hyperplane of ℝⁿ: mass, radius, inertia about the centre, and what
they make of inertia about the contact point.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.bodies.inertia_operator import stated_form
from veselova.mechanics.bodies.principal_inertia import symmetric_matrix, three_moments
from veselova.mechanics.core.arguments import is_matrix
from veselova.mechanics.core.decimals import Objects
from veselova.mechanics.core.errors import Faults, InvalidInput
from veselova.mechanics.core.exact_input import (
    exact_vector,
    require_moderate,
    round_to_text,
    scale_number,
    square_root,
    to_float,
)

__all__ = ["Ball", "BallData", "BallN", "require_body"]

Array = NDArray[np.float64]

#: By what part of the largest moment the triangle inequalities may fail: the rounding of moments
#: that are given in doubles.
_ROUNDING = Fraction(1, 10**12)


@dataclass(frozen=True)
class BallData:
    """What balls in any dimension have: mass, radius, and the contact point at t = 0, exactly.

    - mass, radius: positive
    - contact: (n−1,) along e_2 … e_n
    """

    mass: Fraction
    radius: Fraction
    contact: tuple[Fraction, ...]

    @classmethod
    def read(cls, mass: Any, radius: Any, position: Any, count: int) -> BallData:
        """Return the data that are given, the contact point with so many entries. Raises
        InvalidInput, with all faults.
        """
        faults = Faults()
        exact_mass = faults.attempt(scale_number, mass, ("mass",))
        exact_radius = faults.attempt(scale_number, radius, ("radius",))
        contact = faults.attempt(exact_vector, position, ("position",), count)
        faults.require_none()
        found = BallData(exact_mass, exact_radius, contact)
        require_moderate([found.added], ("mass",))
        return found

    @property
    def added(self) -> Fraction:
        """Return ma², the moment of the mass at the centre about the contact point."""
        return self.mass * self.radius**2

    @property
    def size(self) -> float:
        """Return the length in which errors of frame and contact point together are measured."""
        return max(1.0, float(self.radius))


@dataclass(frozen=True)
class Ball(BallData):
    """A ball, and where it touches the plane at t = 0, exactly as given.

    - inertia: principal moments (3,) about the centre, or the symmetric matrix, (3, 3)
    """

    inertia: tuple[Any, ...]

    @classmethod
    def of(cls, inertia: Any, mass: Any, radius: Any, position: Any, strict: bool) -> Ball:
        """Return the ball that is given. Raises InvalidInput, with all faults.

        ``strict``: whether the moments must satisfy the triangle inequalities I_i ≤ I_j + I_k.
        """
        faults = Faults()
        tensor = faults.attempt(_inertia, inertia, strict)
        data = faults.attempt(BallData.read, mass, radius, position, 2)
        faults.require_none()
        return cls(data.mass, data.radius, data.contact, tensor)

    @cached_property
    def effective(self) -> tuple[Any, ...]:
        """Return I + ma², as moments or as a matrix."""
        if not isinstance(self.inertia[0], tuple):
            return tuple(moment + self.added for moment in self.inertia)
        return tuple(
            tuple(x + self.added * (i == j) for j, x in enumerate(row))
            for i, row in enumerate(self.inertia)
        )

    @cached_property
    def tensor(self) -> Array:
        """Return the inertia about the centre, (3, 3)."""
        values = to_float(self.inertia)
        return np.diag(values) if values.ndim == 1 else np.array(values)


@dataclass(frozen=True)
class BallN(BallData):
    """A ball in ℝⁿ, n ≥ 4, and where it touches the hyperplane at t = 0.

    Of the numbers J_ij = A_iA_j/det A the moments about the centre follow: I_ij = J_ij − ma² for a
    ball that may not twist, m²a⁴/(J_ij − ma²) for one that is free to.

    - A: n positive numbers, exactly
    - shares: (n, n) s_ij = J_ij/(I_ij + ma²), symmetric, rationals: one where it may not twist
    """

    A: tuple[Fraction, ...]
    shares: Objects

    @classmethod
    def of(cls, n: int, twists: bool, inertia: Any, mass: Any, radius: Any, position: Any) -> BallN:
        """Return the ball that is given, its inertia as {"special": [A_1 … A_n]}. Raises
        InvalidInput, with all faults.
        """
        faults = Faults()
        pair = np.array(position, dtype=object)
        if pair.shape == (2,) and not any(pair):  # stands for none, the origin
            position = (0,) * (n - 1)
        data = faults.attempt(BallData.read, mass, radius, position, n - 1)
        A = faults.attempt(_special, inertia, n)
        faults.require_none()
        J = _effective(A)
        pairs = list(combinations(range(n), 2))
        least = min(pairs, key=lambda pair: J[pair])
        if J[least] <= data.added:
            required = f"A_iA_j/det A above ma² = {round_to_text(data.added)}"
            i, j = (k + 1 for k in least)
            given = f"A_{i}A_{j}/det A = {round_to_text(J[least])}"
            raise InvalidInput(("inertia", "special"), required, given)
        shares = J / data.added - 1 if twists else J / J
        np.fill_diagonal(shares, Fraction(0))
        found = cls(data.mass, data.radius, data.contact, A, shares)
        for moment in (min(found.moments), max(found.moments)):
            require_moderate([moment], ("inertia",))
        return found

    @property
    def n(self) -> int:
        """Return the dimension."""
        return len(self.A)

    @cached_property
    def moments(self) -> tuple[Fraction, ...]:
        """Return the n(n−1)/2 numbers I_ij, i < j, in lexicographic order."""
        J, pairs = _effective(self.A), combinations(range(self.n), 2)
        return tuple(J[pair] / self.shares[pair] - self.added for pair in pairs)

    @cached_property
    def roots(self) -> Array:
        """Return x_i = A_i/√det A, (n,): J_ij = x_ix_j."""
        unit = Fraction(1) / math.prod(self.A)
        return np.array([square_root(x * x * unit) for x in self.A])

    @cached_property
    def operator(self) -> Array:
        """Return the moments about the centre, (n(n−1)/2,)."""
        return to_float(self.moments)


def require_body(moments: Sequence[Fraction]) -> None:
    """Raise InvalidInput unless three principal moments satisfy the triangle inequalities."""
    first, second, largest = sorted(moments)
    if largest - first - second > _ROUNDING * largest:
        required = "moments of a body, none larger than the sum of the others (or strict=False)"
        given = f"{float(largest):.6g} > {float(first):.6g} + {float(second):.6g}"
        raise InvalidInput(("inertia",), required, given)


def _inertia(given: Any, strict: bool) -> tuple[Any, ...]:
    """Return moments or the matrix, exactly; raises InvalidInput unless a body has them."""
    moments, _ = three_moments(given)
    if strict:
        require_body(moments)
    return symmetric_matrix(given, ("inertia",), 3) if is_matrix(given) else moments


def _effective(A: tuple[Fraction, ...]) -> Objects:
    """Return J_ij = A_iA_j/det A, (n, n)."""
    numbers = np.array(A, dtype=object)
    return np.asarray(np.outer(numbers, numbers) / math.prod(A))


def _special(inertia: Any, n: int) -> tuple[Fraction, ...]:
    """Return the A of {"special": A}, exactly."""
    path = ("inertia", "special")
    _, A = stated_form(inertia, {"special": f'{{"special": [A_1, …, A_{n}]}}'})
    return exact_vector(A, path, n, scale_number)
