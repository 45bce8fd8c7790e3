"""The rank-one problem together with the path of a ball of radius one that rolls by it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from functools import cached_property
from operator import mul
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from veselova.mechanics.core.exact_input import square_root
from veselova.mechanics.core.problem import Series
from veselova.mechanics.systems.veselova import Veselova

__all__ = ["RollingVeselova"]

Array = NDArray[np.float64]


class RollingVeselova(Veselova):
    """A ``Veselova`` problem whose motions have one series more, the displacement ∫(e_k, q̇) dt for
    k = 2 … n, (N, n−1).

    A ball of radius a on the hyperplane e_1⊥ that neither slips nor twists has its contact point
    at x(0) − a times the displacement.

    - axes: those that numbers A, q, q_dot and frame belong to, as columns in the body, (n, n); None
      where they are the body's
    """

    outputs: ClassVar[Mapping[str, tuple[str, ...]]] = {
        **Veselova.outputs,
        "displacement": ("horizontal",),
    }
    bounded: ClassVar[tuple[str, ...]] = ("frame", "displacement")

    def __init__(
        self,
        A: ArrayLike | Sequence[Any],
        q: ArrayLike | Sequence[Any],
        q_dot: ArrayLike | Sequence[Any],
        frame: ArrayLike | Sequence[Any] | None = None,
        *,
        normalize: bool = False,
        axes: Array | None = None,
    ) -> None:
        super().__init__(A, q, q_dot, frame, normalize=normalize)
        if axes is not None:
            self._set(axes=axes)

    @cached_property
    def exact_square_of_speed(self) -> Fraction:
        """Return (2h/|p|)², the square of the speed (q̇,γ) along the momentum, exactly.

        2h/|p| = [(Av,v)(AQ,Q) − (AQ,v)²]/|(Q,AQ)Av − (v,AQ)AQ| for a vector Q along q, of any
        length, and v = q̇.
        """
        A, Q, v = self.exact.A, self.exact.q, self.exact.tangent
        AQ = tuple(map(mul, A, Q))
        Av = tuple(map(mul, A, v))
        QAQ = sum(map(mul, AQ, Q))
        vAQ = sum(map(mul, AQ, v))
        twice_energy = sum(map(mul, Av, v)) * QAQ - vAQ**2
        momentum = [QAQ * x - vAQ * y for x, y in zip(Av, AQ, strict=True)]
        return Fraction(twice_energy**2, sum(x * x for x in momentum))

    @cached_property
    def speed(self) -> float:
        """Return 2h/|p|, with which the displacement along γ of the natural frame grows."""
        return square_root(self.exact_square_of_speed) if self.moves else 0.0

    @property
    def start(self) -> Series:
        """Return the series at t = 0."""
        return {**super().start, "displacement": np.zeros((1, self.n - 1))}
