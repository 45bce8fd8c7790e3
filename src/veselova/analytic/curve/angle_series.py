"""What periods make of the cosine series of their forms: cycles a, frequencies f and the series of
the Abel–Jacobi map.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property
from typing import ClassVar

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Arithmetic, Values

__all__ = ["AngleSeries"]


class AngleSeries(ABC):
    """The period data of g cuts, on each of which the forms du_1 … du_g are cosine series in its
    angle ψ_s.
    """

    #: What serves where the angles of this curve are ill-conditioned.
    without_angles: ClassVar[str] = "more digits serve"

    @property
    @abstractmethod
    def arithmetic(self) -> Arithmetic:
        """Return the arithmetic of the data."""

    @property
    @abstractmethod
    def genus(self) -> int:
        """Return g, the number of cuts."""

    @property
    @abstractmethod
    def narrowest_gap(self) -> float:
        """Return the least gap between neighbouring cuts, relative to what is around it."""

    @property
    @abstractmethod
    def cut_series(self) -> tuple[Values, ...]:
        """Return, per cut, the cosine coefficients of du_k/dψ (signs included), shape (g, N_s)."""

    @property
    @abstractmethod
    def series_truncation(self) -> Values:
        """Return what the angle series leave out of z_k, shape (g,)."""

    @cached_property
    def cycles(self) -> Values:
        """Return a, shape (g, g)."""
        return np.stack([2 * self.arithmetic.pi * s[:, 0] for s in self.cut_series], axis=1)

    @cached_property
    def inverse_cycles(self) -> Values:
        """Return a⁻¹."""
        return self.arithmetic.inverse(self.cycles)

    @cached_property
    def frequencies(self) -> Values:
        """Return f = a⁻¹e_g, cycles per unit of τ: z(τ) = z⁰ + fτ."""
        return self.inverse_cycles[:, self.genus - 1]

    @cached_property
    def angle_series(self) -> Values:
        """Return g_{ksm}, shape (g, g, M): dz_k/dψ_s = Σ_m g_{ksm} cos mψ_s, zero-padded to the
        longest cut.
        """
        longest = max(series.shape[1] for series in self.cut_series)
        padded = np.zeros((*self.cycles.shape, longest), dtype=self.cycles.dtype)
        for s, series in enumerate(self.cut_series):
            padded[:, s, : series.shape[1]] = self.inverse_cycles @ series
        return padded
