"""Integrals of the nodal differentials along straight paths in the plane of μ, in doubles: from a
branch point, or from infinity, to a complex point.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.errors import Unsolved

__all__ = ["from_end", "from_infinity", "midpoints"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Method: nodes of Gauss' rule on a part of a path.
_NODES = 32

#: Derived: the relative change at which a rule with twice as many nodes has converged.
_QUADRATURE = 1e-13

#: Budget: parts of a path. Beside branch points at a relative distance of d it has some log₂(1/d).
_MOST_PARTS = 2000


def midpoints(betas: Array) -> Array:
    """Return ζ_1 … ζ_{g−1}, counted from where the β's are."""
    return np.asarray((betas[2:-1:2] + betas[3::2]) / 2)


def from_infinity(target: complex, betas: Array, zeros: Array) -> tuple[Complex, complex]:
    """Return ∫ p dμ/(2v) from infinity to c + ``target``, (g,), and the phase of v there; β's and
    ζ's are counted from c.

    t = (μ−c)^{−1/2}: v = i t^{−2g−1} Π√(1+(c−β)t²), and each root stays away from its branch line.
    """
    genus = zeros.size + 1
    end = 1 / np.sqrt(target)
    powers = np.full(genus, 2)
    powers[-1] = 0

    def over_t(t: Complex) -> Complex:
        square = (t * t)[:, None]
        forms = _without_each(np.asarray(1 - square * zeros, dtype=complex)) * t ** powers[:, None]
        return np.asarray(1j * forms / np.prod(np.sqrt(1 - square * betas), axis=1))

    # its phase alone names the sheet: powers of far points leave the range of a double
    turn = (end / abs(end)) ** (-2 * genus - 1)
    v = 1j * turn * np.prod(np.sqrt(1 - end**2 * betas))
    return _integral(over_t, end), complex(v)


def from_end(target: complex, j: int, betas: Array, zeros: Array) -> tuple[Complex, complex]:
    """Return ∫ p dμ/(2v) from β_j to β_j + ``target``, (g,), and v there; β's and ζ's are counted
    from β_j.

    x = √(μ−β_j): v² = −x² Π_{<}(μ−β) Π_{>}(μ−β), and each root below stays away from its branch
    line.
    """
    below = betas[:j]
    above = betas[j + 1 :]
    unit = 1j if len(above) % 2 == 0 else 1.0
    end = np.sqrt(target)

    def roots(x: Complex) -> Complex:
        square = (x * x)[:, None]
        return np.asarray(
            unit
            * np.prod(np.sqrt(square - below), axis=1)
            * np.prod(np.sqrt(above - square), axis=1),
            dtype=complex,
        )

    def over_x(x: Complex) -> Complex:  # dμ/(2v) = dx/(v/x)
        return np.asarray(
            _without_each(np.asarray((x * x)[:, None] - zeros, dtype=complex)) / roots(x)
        )

    v = end * roots(np.array([end]))[0]
    return _integral(over_x, end), complex(v)


def _without_each(factors: Complex) -> Complex:
    """Return the products of factors (N, g−1) without the k-th, k < g, and of all of
    them, (g, N).
    """
    count = factors.shape[1]
    products = [np.prod(np.delete(factors, k, axis=1), axis=1) for k in range(count)]
    return np.stack([*products, np.prod(factors, axis=1)])


@lru_cache
def _gauss() -> tuple[Array, Array]:
    """Return nodes and weights of Gauss' rule on [0, 1]."""
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    return (nodes + 1) / 2, weights / 2


def _integral(integrand: Callable[[Complex], Complex], end: complex) -> Complex:
    """Return the integrals from 0 straight to ``end`` of functions (g, N), by Gauss' rule on parts
    that are halved until both halves give what the whole gave.
    """
    nodes, weights = _gauss()

    def rule(start: complex, stop: complex) -> tuple[Complex, Array]:
        values = integrand(np.asarray(start + (stop - start) * nodes, dtype=complex))
        terms = values * (weights * (stop - start))
        return np.sum(terms, axis=1), np.sum(np.abs(terms), axis=1)

    first, _ = rule(0j, end)
    total = np.zeros_like(first)
    remaining = [(0j, end, first)]
    for _ in range(_MOST_PARTS):
        if not remaining:
            return total
        start, stop, whole = remaining.pop()
        middle = (start + stop) / 2
        left, left_size = rule(start, middle)
        right, right_size = rule(middle, stop)
        if np.all(np.abs(left + right - whole) <= _QUADRATURE * (left_size + right_size)):
            total = total + left + right
        else:
            remaining += [(middle, stop, right), (start, middle, left)]
    raise Unsolved(
        "narrow-gap", "the path to a point passes too near a branch point for its quadrature"
    )
