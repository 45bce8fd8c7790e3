"""The branch points of a start, by FLINT from rational polynomials (section 2 of the paper).

Zeros come as balls whose bits are doubled until every difference of neighbours has its own.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from flint import arb
from numpy.typing import NDArray

from veselova.analytic.arithmetic.balls import balls
from veselova.analytic.spectrum.moving_part import Moving, squared_rates
from veselova.analytic.spectrum.polynomials import Polynomials, rational

__all__ = ["Start", "exact_start", "to_doubles"]

Array = NDArray[np.float64]

#: Derived: digits of the roots at first, and at most; so many of every difference are its own.
_DIGITS, _MOST_DIGITS, _OWN = 60, 4000, 27


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
    rate = rational(squared_rates(moving)[1])
    digits = _DIGITS
    while digits <= _MOST_DIGITS:
        with balls(digits):
            found = _start(polynomials, rate)
        if found is not None:
            return found
        digits *= 2
    return None


def to_doubles(start: Start) -> Start:
    """Return the start with every number rounded once."""
    found = {
        name: np.vectorize(float, otypes=[np.float64])(getattr(start, name))
        for name in ("d", "points", "on_cuts", "rate")
    }
    return start._replace(**found)


def _start(polynomials: Polynomials, rate: Any) -> Start | None:
    """Return the start at the working precision, None where that leaves differences open."""
    I, lam, c = polynomials.zeros()
    g = len(lam)
    labelled = [(x, 0, i) for i, x in enumerate(I)] + [(x, 1, k) for k, x in enumerate(c)]
    labelled.sort(key=lambda item: item[0].mid())
    place = {(kind, i): k for k, (_, kind, i) in enumerate(labelled)}
    of_I = [place[0, i] for i in range(g + 1)]
    b = [item[0] for item in labelled]
    if not all(_is_known(y - x) for x, y in pairwise(b)):
        return None
    up, on_cuts = [], np.empty((2, g), dtype=object)
    for s in range(g):
        low, high = b[2 * s + 1 : 2 * s + 3]
        if lam[s] is low or lam[s] is high:  # λ_s turns at the start: either direction serves
            at = int(lam[s] is high)
            on_cuts[at, s], on_cuts[1 - at, s] = arb(0), high - low
            up.append(True)
            continue
        terms = (x / (lam[s] - p) for x, p in zip(polynomials.qv, I, strict=True) if x != 0)
        slope = sum(terms, arb(0))
        ends = lam[s] - low, high - lam[s]
        if not ((slope > 0 or slope < 0) and all(map(_is_known, ends))):
            return None
        up.append(bool(slope > 0))
        on_cuts[:, s] = ends
    signs = []
    for i in range(g + 1):
        s, lower = (of_I[i] - 1) // 2, of_I[i] % 2 == 1
        if polynomials.q_squared[i] == 0:  # it passes zero with ψ, and q̇_i > 0
            signs.append(1.0 if lower else -1.0)
        else:
            signs.append(1.0 if up[s] or not lower else -1.0)
    points = np.array(b, dtype=object)
    return Start(
        points[None, :] - points[:, None],
        points,
        np.array(of_I),
        np.array([place[1, k] for k in range(g)]),
        np.array(signs),
        on_cuts,
        np.array(up),
        np.array([1 / arb(rate).sqrt()], dtype=object),
    )


def _is_known(x: Any) -> bool:
    """Return whether a difference is positive and has enough digits of its own."""
    return bool(x > 0) and x.rel_accuracy_bits() > 3.33 * _OWN
