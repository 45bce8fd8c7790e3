"""What an integrator of a flow is: one segment of time, states at the wanted times
and at the end.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.flow import Flow

__all__ = ["Integrator"]

Array = NDArray[np.float64]


class Integrator(ABC):
    """A back end: integrates the field of a Flow over one segment at a fixed tolerance."""

    #: Tolerance of the answer, and the looser one of the second run that measures its error.
    tolerances: ClassVar[tuple[float, float]]
    method: ClassVar[str]

    @abstractmethod
    def __init__(self, flow: Flow, tolerance: float) -> None:
        """Prepare for one flow at one tolerance; raises BackendMissing when the library is not
        installed.
        """

    @abstractmethod
    def advance(
        self, state: Array, start: float, stop: float, wanted: Array
    ) -> tuple[Array, Array]:
        """Return (states at the wanted times, state at stop), from the state at start; stop may lie
        before start.
        """

    @property
    @abstractmethod
    def steps(self) -> int:
        """Return the number of steps taken so far."""
