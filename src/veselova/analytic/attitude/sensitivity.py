"""How fast the frame turns with the phases: what an error of a phase costs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Sensitivity"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Sensitivity:
    """The largest derivatives of numbers x of a state, such as the entries of its frame, over
    points of the torus.

    by_phase (g,) |∂x/∂z_k| · along_flow |dx/dτ₁| · together √Σ_k (∂x/∂z_k)² · by_rates Σ_k |f_k
    ∂x/∂z_k|
    """

    by_phase: Array
    along_flow: float
    together: float
    by_rates: float

    @classmethod
    def of(cls, slopes: Array, rates: Array) -> Sensitivity:
        """Return it from derivatives in every phase, shape (N, K, g)."""
        sizes = np.abs(slopes)
        together = np.max(np.sum(sizes * sizes, axis=2))
        by_rates = np.max(sizes @ np.abs(rates))
        along_flow = float(np.max(np.abs(slopes @ rates)))
        return cls(
            np.max(sizes, axis=(0, 1)), along_flow, float(np.sqrt(together)), float(by_rates)
        )

    def maximum(self, other: Sensitivity) -> Sensitivity:
        """Return the larger of both."""
        return Sensitivity(
            np.maximum(self.by_phase, other.by_phase),
            max(self.along_flow, other.along_flow),
            max(self.together, other.together),
            max(self.by_rates, other.by_rates),
        )
