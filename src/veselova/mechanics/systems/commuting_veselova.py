"""The rank-one problem on whose torus Chaplygin's ball in ℝⁿ rolls, with another direction of its
flow.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cached_property
from typing import Any

from veselova.mechanics.core.exact_input import square_root
from veselova.mechanics.systems.rolling_veselova import RollingVeselova

__all__ = ["CommutingVeselova"]


class CommutingVeselova(RollingVeselova):
    """A ``RollingVeselova`` that moves by the Hamiltonian |p|²/2D − h, which commutes with its
    energy h.

    Torus, phases, frame and time are those of q, q̇; the velocity of the motion is p/D − q̇. With the
    forms λ^(k−1)dλ/2w its direction is du/dτ₁ = ((−1)^(g−1)/D, 0, …, 0, −1).

    - added: D, below all A_iA_j/det A
    """

    added: Fraction

    def __init__(self, A: Any, q: Any, q_dot: Any, frame: Any, *, added: Fraction) -> None:
        super().__init__(A, q, q_dot, frame, normalize=True)
        self._set(added=added)

    @cached_property
    def energy(self) -> float:
        """Return the energy |p|²/2D − h of the ball."""
        square, twice_energy = self.squares
        return float((square / self.added - twice_energy) / 2)

    @cached_property
    def speed(self) -> float:
        """Return |p|/D − 2h/|p|, with which the displacement along γ of the natural frame grows."""
        if not self.moves:
            return 0.0
        square, twice_energy = self.squares
        # (p,q̇) = 2h ≤ |p|²/J for the least J, which is above D
        return square_root((square - twice_energy * self.added) ** 2 / square / self.added**2)
