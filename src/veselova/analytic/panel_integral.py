"""Integrals along an orbit by quadrature. Cost grows with the length, hardly with the genus."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.orbit import LinearFlow
from veselova.analytic.panels import PANEL_TAIL, Panels
from veselova.analytic.precision import DOUBLE
from veselova.mechanics.errors import InternalContradiction

__all__ = ["integrated"]

Array = NDArray[np.float64]

#: Points per panel: the Chebyshev points of [−1, 1], from 1 downwards, and the matrix from values there to coefficients.
_PANEL_NODES = 24
_POINTS, _TO_COEFFICIENTS = np.cos(DOUBLE.nodes(_PANEL_NODES)), DOUBLE.cosine_series(np.eye(_PANEL_NODES))

#: Panels beyond an end, each of at most half a cycle of the fastest phase: ends come from means.
_MARGIN = 2

#: Last coefficients below this part of the first that have not fallen to a quarter in the last halving: then they are rounding
#: of the phases.
_NOISE_TAIL = 1e-11
_STALLED = 0.25

#: Halvings of a panel before giving up; near a separatrix integrands vary over a few hundredths of a cycle.
_MOST_HALVINGS = 30

#: Nodes evaluated at once.
_BLOCK = 4096


def integrated(integrand: Callable[[Array], Array], in_tau1: LinearFlow, low: float, high: float, floor: float = 0.0) -> Panels:
    """Return τ₁ ↦ ∫_0^{τ₁} f(z) along z = z⁰ + fτ₁ over a stretch of the orbit with low ≤ 0 ≤ high, and a margin.

    ``integrand`` gives f at phases z of shape (N, g). A panel is resolved to rounding of its mean, or of ``floor`` where that is
    larger: an integrand that changes sign has means near zero. Panels that are not are halved, each for itself. An end at zero,
    where the integral is known, has no margin.
    """
    fastest = float(np.max(np.abs(in_tau1.rates)))
    # Borders are whole multiples of a power of two, so that their products with it are exact.
    length = float(2.0 ** np.floor(np.log2(0.5 / fastest)))
    first = int(np.floor(low / length)) - _MARGIN if low < 0 else 0
    last = int(np.ceil(high / length)) + _MARGIN if high > 0 or first == 0 else 0
    lefts = np.arange(first, last, dtype=float) * length
    before = np.full(lefts.size, np.inf)
    done: list[tuple[Array, Array, Array, Array, Array]] = []
    for _ in range(_MOST_HALVINGS):
        coefficients = _coefficients(integrand, in_tau1, lefts, length)
        sizes = np.maximum(np.abs(coefficients[:, 0]), floor)
        tails = np.max(np.abs(coefficients[:, -3:]), axis=1) / sizes
        settled = (tails <= PANEL_TAIL) | ((tails <= _NOISE_TAIL) & (tails > _STALLED * before))
        lengths = np.full(lefts.size, length)
        done.append((lefts[settled], lengths[settled], coefficients[settled], tails[settled], sizes[settled]))
        if np.all(settled):
            return Panels.of(*(np.concatenate(parts) for parts in zip(*done, strict=True)))
        length /= 2
        lefts = (lefts[~settled][:, None] + np.array([0.0, length])).ravel()
        before = np.repeat(tails[~settled], 2)
    raise InternalContradiction("a panel along the orbit was not resolved")


def _coefficients(integrand: Callable[[Array], Array], in_tau1: LinearFlow, lefts: Array, length: float) -> Array:
    """Return the Chebyshev coefficients of the integrand on panels; node phases are those of the border plus a short way."""
    start = in_tau1.phases(lefts)
    offsets = (_POINTS + 1)[:, None] * (length / 2) * in_tau1.rates
    z = (start[:, None, :] + offsets).reshape(-1, start.shape[1])
    values = [integrand(z[first : first + _BLOCK]) for first in range(0, z.shape[0], _BLOCK)]
    return np.asarray(np.concatenate(values).reshape(lefts.size, -1) @ _TO_COEFFICIENTS)
