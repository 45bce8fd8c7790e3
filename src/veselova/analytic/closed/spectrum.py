"""The branch points of a start, by FLINT from rational polynomials (section 2 of the paper).

Zeros come as balls whose bits are doubled until every difference of neighbours has its own.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.spectrum.branch_points import spectrum
from veselova.analytic.spectrum.moving_part import Moving
from veselova.analytic.spectrum.polynomials import Polynomials

__all__ = ["Start", "exact_start", "to_doubles"]

Array = NDArray[np.float64]

#: Derived: digits of the roots at most; so many of every difference are its own.
_MOST_DIGITS, _OWN = 4000, 27


class Start(NamedTuple):
    """What ``kernel.torus.make_torus`` takes of a start; axes by decreasing A.

    - d: (2g+1, 2g+1) b_j − b_i; points: (2g+1,) b_j, the largest I is 1
    - of_I: (n,) place of I_i among the b; of_c: (g,) that of c_k
    - signs: (n,) of the roots of ``frame``
    - on_cuts: (2, g) λ_s−b_{2s−1} and b_{2s}−λ_s; up: (g,) whether λ_s increases
    - rate: (1,) d(time)/dτ₁
    """

    d: Any
    points: Any
    of_I: NDArray[np.int64]
    of_c: NDArray[np.int64]
    signs: Array
    on_cuts: Any
    up: NDArray[np.bool_]
    rate: Any


def exact_start(moving: Moving) -> Start | None:
    """Return the start of what moves in balls, every difference of branch points with digits of its
    own; None where two coincide.
    """
    polynomials = Polynomials.of(moving)
    coincides = any(polynomials.N(x) == 0 for x in polynomials.I)
    if coincides or any(x == y for x, y in pairwise(polynomials.I)):
        return None
    found = spectrum(moving, _OWN // 2, _MOST_DIGITS)
    if not found.is_known(_OWN):
        return None
    points = np.array([value for value, _, _ in found.branch_points])
    place = {(kind, index): j for j, (_, kind, index) in enumerate(found.branch_points)}
    with found.arithmetic:
        return Start(
            points[None, :] - points[:, None],
            points,
            np.array([place["I", i] for i in range(moving.size)]),
            np.array([place["c", k] for k in range(moving.size - 1)]),
            np.array(found.signs, dtype=np.float64),
            np.array(found.on_cuts).T,
            np.array(found.increasing),
            np.array([1 / found.time_rate]),
        )


def to_doubles(start: Start) -> Start:
    """Return the start with every number rounded once."""
    found = {
        name: np.vectorize(float, otypes=[np.float64])(getattr(start, name))
        for name in ("d", "points", "on_cuts", "rate")
    }
    return start._replace(**found)
