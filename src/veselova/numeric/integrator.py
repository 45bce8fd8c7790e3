"""What an integrator of a flow is: one segment of time, states at the wanted times
and at the end.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.flow import Flow

__all__ = ["Integrator"]

Array = NDArray[np.float64]


class Integrator(ABC):
    """A back end: integrates a flow and its neighbours side by side, over one segment at a time."""

    #: Tolerance of the answer.
    tolerance: ClassVar[float]
    #: How far the neighbours start from the answer, and on which side: rounding may agree by chance
    #: in one of them, and hardly in all.
    neighbours: ClassVar[tuple[float, ...]]
    #: By how much the error may be larger than their largest difference: the starts differ in one
    #: direction, which need not be the one in which errors grow most.
    safety: ClassVar[float]

    @abstractmethod
    def __init__(self, flows: Sequence[Flow]) -> None:
        """Prepare for B flows of one structure, the first of which is the answer; raises
        BackendMissing when the library is not installed.
        """

    @abstractmethod
    def advance(
        self, states: Array, start: float, stop: float, wanted: Array
    ) -> tuple[Array, Array]:
        """Return the states at the wanted times (B, N, m) and at stop (B, m), from those at start
        (B, m); stop may lie before start.
        """

    @property
    @abstractmethod
    def steps(self) -> int:
        """Return the number of steps that the answer has taken so far."""
