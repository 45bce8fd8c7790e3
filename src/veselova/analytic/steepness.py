"""How fast the frame turns with the phases: what an error of a phase costs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Steepness"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Steepness:
    """The largest |∂(frame entry)/∂z_k|, shape (g,), and |d(frame entry)/dτ₁| along the flow."""

    by_phase: Array
    along_flow: float

    @classmethod
    def of(cls, slopes: Array, rates: Array) -> Steepness:
        """Return it from derivatives in every phase, shape (N, n², g)."""
        return cls(np.max(np.abs(slopes), axis=(0, 1)), float(np.max(np.abs(slopes @ rates))))

    def joined(self, other: Steepness) -> Steepness:
        """Return the larger of both."""
        return Steepness(np.maximum(self.by_phase, other.by_phase), max(self.along_flow, other.along_flow))
