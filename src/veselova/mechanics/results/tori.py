"""The invariant tori of many motions of one dimension, as arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.results.ensemble import SOLVED

__all__ = ["Tori", "TorusNumbers"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class TorusNumbers:
    """What N tori have in numbers: see ``Tori``."""

    energy: Array
    constants: Array
    branch_points: Array
    origins: NDArray[np.str_]
    actions: Array
    rotation_numbers: Array
    frequencies_tau1: Array
    frequencies_t: Array
    phases: Array
    mean_rate: Array


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Tori(TorusNumbers):
    """The tori of N Veselova problems, g = n−1; names, shapes and units after the first axis are
    those of ``Torus``. Numbers of a row that was not found are NaN.

    - outcome: (N,) ``solved``, or the name of the reason
    - detail: (N,) the reason in a sentence
    - energy, mean_rate: (N,)
    - constants: (N, n−2)
    - branch_points, origins: (N, 2g+1)
    - actions, rotation_numbers, frequencies_tau1, frequencies_t, phases: (N, g)
    """

    outcome: NDArray[np.str_]
    detail: tuple[str, ...]

    def __len__(self) -> int:
        return int(self.outcome.size)

    @property
    def solved(self) -> NDArray[np.bool_]:
        """Return which tori were found, (N,)."""
        return np.asarray(self.outcome == SOLVED)

    def __repr__(self) -> str:
        found = int(np.count_nonzero(self.solved))
        return f"<Tori: {len(self)} problems, {found} solved>"
