"""The mean velocity of a rolling ball."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Drift"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Drift:
    """The mean velocity of a contact point over all times, along e_2 … e_n.

    - velocity: (n−1,)
    - resonance: the whole numbers M with Σ_s M_s f_s = 0 by which the ball also drifts across
      the direction of its generic motions; None where there are none
    """

    velocity: Array
    resonance: tuple[int, ...] | None = None

    @property
    def speed(self) -> float:
        """Return |velocity|."""
        return float(np.linalg.norm(self.velocity))

    @property
    def direction(self) -> Array:
        """Return the unit vector along the velocity, (n−1,); zero for a ball at rest."""
        return self.velocity / self.speed if self.speed else np.zeros_like(self.velocity)

    def as_dict(self) -> dict[str, Any]:
        """Return velocity and resonance as JSON has them."""
        resonance = None if self.resonance is None else list(self.resonance)
        return {"velocity": self.velocity.tolist(), "resonance": resonance}

    @classmethod
    def from_dict(cls, document: Mapping[str, Any]) -> Drift:
        """Return the drift of what ``as_dict`` gave."""
        resonance = document["resonance"]
        velocity = np.array(document["velocity"], dtype=np.float64)
        return cls(velocity, None if resonance is None else tuple(map(int, resonance)))
