"""How fast the frame turns with the phases: what an error of a phase costs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

__all__ = ["Steepness", "drawn_angles"]

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


@lru_cache
def drawn_angles(genus: int, count: int) -> Array:
    """Return ``count`` points of the torus, shape (count, g), always the same ones, read-only."""
    result = np.random.default_rng(genus).uniform(0.0, 2 * np.pi, (count, genus))
    result.flags.writeable = False
    return np.asarray(result)
