"""The rank-one problem together with the path of a ball of radius one that rolls by it."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from operator import mul
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.exact_input import square_root
from veselova.mechanics.core.problem import Series
from veselova.mechanics.systems.veselova import Veselova

__all__ = ["BallPath", "CommutingVeselova", "RollingVeselova", "WithDisplacement"]

Array = NDArray[np.float64]


#: Roundings of a displacement in ε: of the speed, of its product with the time, and of the sums.
_ROUNDINGS = 6.0


@dataclass(frozen=True)
class BallPath:
    """The displacement of a ball of radius one, (D,) components: a uniform part, and integrals of
    functions on the torus.

    - uniform: (D,) per unit of time; factors: (K, D) of the integrals of (q',n_k) over τ₁, and of
      the part of dt/dτ₁ that is odd in n_2
    """

    uniform: Array
    factors: Array

    def at(
        self, times: Array, integrals: Array, errors: Array, late: float | Array = 0.0
    ) -> tuple[Array, Array]:
        """Return the displacement (T, D) and its error (T,) from the integrals and their errors
        (K, T); ``late``: what the times are off by.
        """
        along, across = times[:, None] * self.uniform, integrals.T @ self.factors
        sizes = np.abs(along) + np.abs(integrals.T) @ np.abs(self.factors)
        errors = errors.T @ np.abs(self.factors) + _ROUNDINGS * np.finfo(float).eps * sizes
        loose = np.max(np.abs(self.uniform), initial=0.0) * late
        return along + across, np.max(errors, axis=1) + loose


class WithDisplacement(Veselova):
    """A ``Veselova`` problem whose motions have one series more, the path of a ball."""

    outputs: ClassVar[Mapping[str, tuple[str, ...]]] = {
        **Veselova.outputs,
        "displacement": ("horizontal",),
    }
    bounded: ClassVar[tuple[str, ...]] = ("frame", "displacement")

    @property
    def start(self) -> Series:
        """Return the series at t = 0."""
        return {**super().start, "displacement": np.zeros((1, self.n - 1))}

    @abstractmethod
    def path(self, turn: Array, side: float) -> BallPath:
        """Return the path. turn: ℜ (g, n−1), the moving part of e_2 … e_n along n_2 … γ; side: the
        sign of u against n_2 with an area constant.
        """


class RollingVeselova(WithDisplacement):
    """The displacement is ∫(e_k, q̇) dt for k = 2 … n, (N, n−1).

    A ball of radius a on the hyperplane e_1⊥ that neither slips nor twists has its contact point
    at x(0) − a times the displacement.
    """

    #: The sign of y_j across the momentum.
    sense: ClassVar[float] = 1.0

    @cached_property
    def squares(self) -> tuple[Fraction, Fraction]:
        """Return |p|² and 2h, exactly.

        p = [(Q,AQ)Av − (v,AQ)AQ]/((Q,Q) det A) and 2h = [(Av,v)(AQ,Q) − (AQ,v)²]/((Q,Q) det A) for
        a vector Q along q, of any length, and v = q̇.
        """
        A, Q, v = self.exact.A, self.exact.q, self.exact.tangent
        AQ = tuple(map(mul, A, Q))
        Av = tuple(map(mul, A, v))
        QAQ = sum(map(mul, AQ, Q))
        vAQ = sum(map(mul, AQ, v))
        unit = sum(map(mul, Q, Q)) * math.prod(A)
        momentum = sum((QAQ * x - vAQ * y) ** 2 for x, y in zip(Av, AQ, strict=True))
        twice_energy = sum(map(mul, Av, v)) * QAQ - vAQ**2
        return Fraction(momentum, unit**2), Fraction(twice_energy, unit)

    @property
    def exact_square_of_speed(self) -> Fraction:
        """Return (2h/|p|)², the square of the speed (q̇,γ) along the momentum, exactly."""
        square, twice_energy = self.squares
        return twice_energy**2 / square

    @cached_property
    def speed(self) -> float:
        """Return 2h/|p|, with which the displacement along γ of the natural frame grows."""
        return square_root(self.exact_square_of_speed) if self.moves else 0.0

    def path(self, turn: Array, side: float) -> BallPath:
        """Return ∫(e_k, q̇) dt = Σ_j y_j ℜ_jk, y_j = ± ∫(q',n_j) dτ₁, y_γ = speed·t."""
        return BallPath(self.speed * turn[-1], self.sense * turn[:-1])


class CommutingVeselova(RollingVeselova):
    """A ``RollingVeselova`` that moves by the Hamiltonian |p|²/2D − h, which commutes with its
    energy h: the problem on whose torus Chaplygin's ball in ℝⁿ rolls.

    Torus, phases, frame and time are those of q, q̇; the velocity of the motion is p/D − q̇. With the
    forms λ^(k−1)dλ/2w its direction is du/dτ₁ = ((−1)^(g−1)/D, 0, …, 0, −1).

    - added: D, below all A_iA_j/det A
    """

    sense: ClassVar[float] = -1.0
    added: Fraction

    def __init__(self, A: Any, q: Any, q_dot: Any, frame: Any, *, added: Fraction) -> None:
        super().__init__(A, q, q_dot, frame, normalize=True)
        self._set(added=added)

    @cached_property
    def energy(self) -> float:
        """Return the energy |p|²/2D − h of the ball."""
        square, twice_energy = self.squares
        return float((square / self.added - twice_energy) / 2)

    def direction(
        self, g: int, unit: Fraction, frozen: Sequence[Fraction]
    ) -> tuple[Fraction, Fraction]:
        """Return L of du/dτ₁ = ((−1)^(n−2)/D, 0, …, 0, −1)."""
        first = Fraction((-1) ** self.n) / (self.added * unit ** (self.n - 2))
        return first * math.prod(-unit / a for a in frozen), Fraction(-1)

    @cached_property
    def speed(self) -> float:
        """Return |p|/D − 2h/|p|, with which the displacement along γ of the natural frame grows."""
        if not self.moves:
            return 0.0
        square, twice_energy = self.squares
        # (p,q̇) = 2h ≤ |p|²/J for the least J, which is above D
        return square_root((square - twice_energy * self.added) ** 2 / square / self.added**2)
