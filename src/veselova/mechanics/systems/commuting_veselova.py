"""The rank-one problem on whose torus Chaplygin's ball in ℝⁿ rolls, with another direction of its
flow.
"""

from __future__ import annotations

import math
from fractions import Fraction
from functools import cached_property
from operator import mul
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.exact_input import square_root
from veselova.mechanics.systems.rolling_veselova import RollingVeselova

__all__ = ["CommutingVeselova"]

Array = NDArray[np.float64]


class CommutingVeselova(RollingVeselova):
    """A ``RollingVeselova`` that moves by the Hamiltonian |p|²/2D − h, which commutes with its
    energy h.

    Torus, phases, frame and time are those of q, q̇; the velocity of the motion is p/D − q̇. With the
    forms λ^(k−1)dλ/2w its direction is du/dτ₁ = ((−1)^(g−1)/D, 0, …, 0, −1).

    - added: D, in the units of A, where 𝓘(E_i∧E_j) = A_iA_j/det A: below all of these
    - scale: that unit, in the units of the ball
    """

    added: Fraction
    scale: Fraction

    def __init__(
        self,
        A: Any,
        q: Any,
        q_dot: Any,
        frame: Any,
        *,
        axes: Array | None,
        added: Fraction,
        scale: Fraction,
    ) -> None:
        super().__init__(A, q, q_dot, frame, normalize=True, axes=axes)
        self._set(added=added, scale=scale)

    @cached_property
    def energy(self) -> float:
        """Return the energy |p|²/2D − h of the ball."""
        square, twice_energy = self._squares
        return float(self.scale * (square / self.added - twice_energy) / 2)

    @property
    def has_units(self) -> bool:
        """Return True: it is a float."""
        return True

    @cached_property
    def speed(self) -> float:
        """Return |p|/D − 2h/|p|, with which the displacement along γ of the natural frame grows."""
        if not self.moves:
            return 0.0
        square, twice_energy = self._squares
        # (p,q̇) = 2h ≤ |p|²/J for the least J, which is above D
        return square_root((square - twice_energy * self.added) ** 2 / square / self.added**2)

    @cached_property
    def _squares(self) -> tuple[Fraction, Fraction]:
        """Return |p|² and 2h in the units of A, exactly."""
        A, Q, v = self.exact.A, self.exact.q, self.exact.tangent
        AQ = tuple(map(mul, A, Q))
        Av = tuple(map(mul, A, v))
        QAQ = sum(map(mul, AQ, Q))
        vAQ = sum(map(mul, AQ, v))
        unit = sum(map(mul, Q, Q)) * math.prod(A)
        momentum = sum((QAQ * x - vAQ * y) ** 2 for x, y in zip(Av, AQ, strict=True))
        twice_energy = sum(map(mul, Av, v)) * QAQ - vAQ**2
        return Fraction(momentum, unit**2), Fraction(twice_energy, unit)
