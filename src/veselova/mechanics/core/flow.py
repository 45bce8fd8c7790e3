"""What the numerical engine integrates: an autonomous vector field on a manifold, in units in which
both are of order one.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.errors import InternalContradiction, Unsolved

__all__ = ["FLOATS", "Flow", "Operations", "PointFlow", "restoring_step"]

Array = NDArray[np.float64]

#: What an energy is rounded to, ε of its size, over what a state has gathered since it was last put
#: back, about 10 ε. With more, energies would drift; with less, their rounding would show in the
#: states.
_ENERGY_ROUNDING = 0.1


@dataclass(frozen=True)
class Operations:
    """What a field may do besides + − × ÷, in floating point or with the symbols of a Taylor
    integrator.

    - dot: the matrix product ``a @ b`` of arrays of one or two dimensions
    - solve: the solution of ``a @ x = b`` for symmetric positive definite ``a`` and columns
      ``b`` (or a stack of each)
    """

    sqrt: Callable[[Any], Any]
    dot: Callable[[Any, Any], Any]
    solve: Callable[[Any, Any], Any]


FLOATS = Operations(np.sqrt, np.matmul, np.linalg.solve)


class Flow(ABC):
    """A vector field with a start. States are flat arrays; redundant coordinates are put back on
    the manifold by ``project``.

    - initial: the start, (m,)
    - parameters: the numbers that the field depends on, (k,)
    - time_unit: one unit of scaled time, in units of the problem's time
    - size: what the bounded outputs are measured in, in the problem's units
    """

    initial: Array
    parameters: Array
    time_unit: float
    size: float = 1.0

    @abstractmethod
    def field(self, state: Any, parameters: Any, ops: Operations) -> Any:
        """Return the derivative of a state in scaled time, (m,); arrays hold floats or symbols, so
        ``ops`` has the functions.
        """

    @property
    def structure(self) -> Hashable | None:
        """Return what determines the field besides its parameters, so that compiled fields can be
        kept; None has no symbols.
        """
        return type(self), self.initial.size, self.parameters.size

    @abstractmethod
    def project(self, state: Array) -> Array:
        """Return a state that left the manifold by rounding and truncation, back on it."""

    @abstractmethod
    def neighbour(self, distance: float) -> Flow:
        """Return the flow of a start moved by about ``distance`` on the manifold: how rounding of
        the data acts.
        """

    @abstractmethod
    def unpack(self, states: Array) -> dict[str, Array]:
        """Return series by name, in the problem's units, from states (N, m)."""

    @property
    def endless(self) -> bool:
        """Return whether no motion ends; other flows define ``clearance`` and ``ending``."""
        return True

    def clearance(self, state: Array) -> float:
        """Return a number that is positive until the motion ends (at a collision, say), and
        negative beyond.
        """
        return 1.0

    def ending(self, time: float, state: Array) -> Unsolved:
        """Return the named outcome of a motion that has ended at a scaled time, in this state."""
        raise InternalContradiction(f"a motion without end has ended at {time:.6g}")

    def vector_field(self, _time: float, state: Array) -> Array:
        """Return the derivative of a state in floating point."""
        return np.asarray(self.field(state, self.parameters, FLOATS), dtype=np.float64)


def restoring_step(excess: Array, slope_squared: Array, size: Array) -> Array:
    """Return s = excess/(|∇E|² + (size/10)²): the step −s∇E takes the excess of energy from a state
    as far as E tells, shape (…).

    slope_squared = |∇E|²; size: the sum of the absolute values of E's parts, so that E is rounded
    to ε·size. At a distance δ from an equilibrium ∇E is of order δ, and excess/|∇E|² would move the
    state by ε·size/δ, which may be all of δ. Least squares over both roundings move it by at most 5
    ε for each ε·size of excess: where E tells nothing, the state is left as integrated.
    """
    weight = np.asarray(slope_squared + (_ENERGY_ROUNDING * size) ** 2)
    return np.divide(
        excess, weight, out=np.zeros_like(weight), where=weight >= np.finfo(float).tiny
    )


@dataclass(frozen=True)
class PointFlow(Flow):
    """The flow of a point of ℝⁿ: its parameters are ``lists`` of n numbers each, and ``further``
    single ones behind them.
    """

    parameters: Array
    time_unit: float
    initial: Array

    lists: ClassVar[int] = 1
    further: ClassVar[int] = 0

    @property
    def n(self) -> int:
        """Return the dimension."""
        return (self.parameters.size - self.further) // self.lists
