"""Problems whose motion is linear on the real torus of a hyperelliptic curve: what the closed form
needs to know of them.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from fractions import Fraction
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.errors import InvalidInput
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.geometry.sphere import ExactState

__all__ = ["TorusProblem", "on_torus"]

Array = NDArray[np.float64]


class TorusProblem(Problem):
    """A point q on Sⁿ⁻¹ that is Neumann's in τ₁, with the frame [q, n_2 … n_{n−1}, γ] or a rotated
    one. Subclasses differ in their time.

    - A: (n,) along principal axes
    - frame: (n, n) at the start, along them
    - near_frame: the same in double precision, at less cost; a natural one is turned by
      ε/(distance of its constants)
    - exact: the data as rationals
    - axes: (n, n) the principal axes as columns, None where they are the body's

    The series of an engine are ``tau1``, ``frame``, ``spheroconic`` and ``q_dot``, the velocity in
    the problem's own ``time``: t, s or tau1. ``complete`` makes the problem's series of them.
    """

    A: Array
    near_frame: Array
    exact: ExactState
    axes: Array | None = None

    has_tori: ClassVar[bool] = True
    engines: ClassVar = {
        "analytic": ("theta", "angles"),
        "numeric": ("dop853", "taylor"),
    }

    @property
    @abstractmethod
    def frame(self) -> Array:
        """Return the frame at the start, columns, shape (n, n)."""

    def on_torus(self) -> TorusProblem:
        """Return the problem itself."""
        return self

    def direction(
        self, g: int, unit: Fraction, frozen: Sequence[Fraction]
    ) -> tuple[Fraction, Fraction]:
        """Return L(1) and L(λ^(g−1)) of the direction du/dτ₁ = L(p_k) on a torus of genus g, which
        add up where g = 1; L is zero for powers between them: e_g, that of Neumann's flow.

        unit: the A that counts as 1; frozen: those of the directions that do not move
        """
        return Fraction(0), Fraction(1)

    @property
    def n(self) -> int:
        """Return the dimension."""
        return int(self.A.size)


def on_torus(problem: Problem) -> TorusProblem:
    """Return the problem on whose torus a motion runs. Raises InvalidInput for a system without
    tori.
    """
    if not problem.has_tori:
        systems = "veselova, veselova-so3, rubber-ball, chaplygin-ball, neumann, ellipsoid-geodesic"
        raise InvalidInput(("problem",), f"a system with a torus: {systems}", problem.system)
    known: Any = problem
    found: TorusProblem = known.on_torus()
    return found
