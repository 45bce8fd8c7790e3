"""Bodies in space with V = 0 and (Ω,γ) = 0 side by side: the motions of rank-one problems with A =
1/I, q = γ and q̇ = γ×Ω, whose roundings the errors count.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.double_double import DoubleDouble

if TYPE_CHECKING:
    from veselova.analytic.closed.many import States

__all__ = ["bodies_side_by_side", "inverse_moments"]

Array = NDArray[np.float64]

#: Method: the roundings of the data are made so many times larger, and the motion moves by so many
#: times more: far above its own rounding, and yet in proportion.
_ENLARGED = 2.0**12

#: Derived: the factor for what is not in proportion, and errors above which ``solve`` is to serve.
_SAFETY = 2.0
_LARGEST_ERROR = 1e-6

#: What computes states: of starts A, q, q_dot (N, 3).
StatesOf: TypeAlias = "Callable[[Array, Array, Array], Iterable[States]]"


def inverse_moments(inertia: Array) -> tuple[Array, Array]:
    """Return 1/I in doubles, and the same moved by its enlarged roundings."""
    exact = 1.0 / DoubleDouble.of(inertia)
    return exact.high, exact.high + _ENLARGED * exact.low


def bodies_side_by_side(
    inertia: Array, gamma: Array, Omega: Array, states_of: StatesOf, names: tuple[str, ...]
) -> Iterator[tuple[NDArray[np.intp], dict[str, Array]]]:
    """Yield (places, series by name) of bodies with moments and starts (N, 3), for as many of them
    as ``states_of`` serves.
    """
    A, moved_A = inverse_moments(inertia)
    q_dot, moved_q_dot = _velocities(gamma, Omega)
    for states in states_of(A, gamma, q_dot):
        rows = states.rows
        off = np.full(states.error.shape, np.inf)
        for moved in states_of(moved_A[rows], gamma[rows], moved_q_dot[rows]):
            apart = np.abs(moved.frame - states.frame[moved.rows])
            off[moved.rows] = _SAFETY / _ENLARGED * np.max(apart, axis=(2, 3))
        kept = np.all(off < _LARGEST_ERROR, axis=1)
        if kept.any():
            found = _series(inertia[rows[kept]], states.frame[kept], states.q_dot[kept], names)
            yield rows[kept], {**found, "error": states.error[kept] + off[kept]}


def _velocities(gamma: Array, Omega: Array) -> tuple[Array, Array]:
    """Return γ×Ω/|γ| in doubles, and the same moved by its enlarged roundings, (N, 3)."""
    x, y = DoubleDouble.of(gamma), DoubleDouble.of(Omega)
    length = sum((x[:, i] * x[:, i] for i in range(3)), DoubleDouble.of(0.0)).sqrt()
    parts = [(x[:, i - 2] * y[:, i - 1] - x[:, i - 1] * y[:, i - 2]) / length for i in range(3)]
    high, low = (
        np.stack([getattr(part, name) for part in parts], axis=1) for name in ("high", "low")
    )
    return high, high + _ENLARGED * low


def _series(inertia: Array, frame: Array, q_dot: Array, names: tuple[str, ...]) -> dict[str, Array]:
    """Return the named series of bodies whose γ is the first column of the frame."""
    gamma = frame[..., 0]
    moments = inertia[:, None]
    Omega = np.cross(q_dot, gamma)
    M = moments * Omega
    across = gamma / moments
    found: dict[str, Any] = {
        "Omega": Omega,
        "gamma": gamma,
        "frame": frame,
        "momentum": M - np.sum(M * gamma, axis=-1)[..., None] * gamma,
        "multiplier": -np.sum(np.cross(M, Omega) * across, axis=-1)
        / np.sum(gamma * across, axis=-1),
    }
    return {name: found[name] for name in names}
