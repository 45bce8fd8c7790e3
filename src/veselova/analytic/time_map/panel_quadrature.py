"""Integrals along an orbit by quadrature. Cost grows with the length, hardly with the genus."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.time_map.chebyshev_panels import TAIL, Panels, are_settled
from veselova.analytic.time_map.linear_flow import LinearFlow
from veselova.mechanics.core.budget import iterate
from veselova.mechanics.core.errors import Unsolved
from veselova.tunings import MANY_PANELS

__all__ = ["NOISE_TAIL", "integrate_on_panels", "integrate_together"]

Array = NDArray[np.float64]

#: Method: points per panel, of a short stretch and of a long one.
_FEW_NODES = 24
_NODES = 48

#: Method: panels beyond an end, as ends come from means; none beyond one so near that going on,
#: where it is short, costs little.
_MARGIN = 2
_NEAR = 4

#: Method: lengths of longer panels in those of few nodes, and how many are looked at.
_LONGER = (7, 6, 5, 4, 3.5, 3, 2.5)
_PROBED = 8

#: Calibrated: last coefficients below this part of the first may be rounding of the phases.
NOISE_TAIL = 1e-11

#: Derived: halvings of a panel before giving up: a jump, where a weak wall throws the point back,
#: then counts for less than the rounding of the integral.
_MOST_HALVINGS = 56

#: Budget: panels that may be halved at once, beyond some times those to begin with: a jump halves
#: two each time, and values without a digit halve all.
_MOST_HALVED = 2000
_MOST_HALVED_AGAIN = 8

#: Budget: nodes evaluated at once.
_BLOCK = 4096


def integrate_on_panels(
    integrand: Callable[[Array], Array],
    in_tau1: LinearFlow,
    low: float,
    high: float,
    floor: float = 0.0,
    noise: float = 0.0,
) -> Panels:
    """Return τ₁ ↦ ∫_0^{τ₁} f(z) along z = z⁰ + fτ₁ over a stretch of the orbit with low ≤ 0 ≤ high,
    and a margin.

    ``integrand`` gives f at phases z of shape (N, g). A panel is resolved to rounding of its mean,
    or of ``floor`` where that is
    larger: an integrand that changes sign has means near zero. ``noise`` is what part of them the
    rounding of the values may be. Panels that are not resolved are halved, each for itself. An end
    at zero, where the integral is known, has no margin. Raises Unsolved (``narrow-gap``) where a
    spike is too short for that.
    """
    return integrate_together(lambda z: integrand(z)[:, None], in_tau1, low, high, floor, noise)[0]


def integrate_together(
    integrands: Callable[[Array], Array],
    in_tau1: LinearFlow,
    low: float,
    high: float,
    floor: float = 0.0,
    noise: float = 0.0,
) -> list[Panels]:
    """Return the integrals of K functions along one orbit, on the same panels.

    ``integrands`` gives them at phases z (N, g), shape (N, K). A panel is resolved where all are.
    Otherwise as ``integrate_on_panels``.
    """
    panels = _Panels(
        integrands,
        in_tau1,
        floor,
        _FEW_NODES,
        2.0 ** math.floor(math.log2(0.5 / np.max(np.abs(in_tau1.rates)))),
    )
    if (high - low) / panels.length >= MANY_PANELS:
        panels = panels.longer(low, high)
    lefts = panels.lefts(low, high)
    lengths = np.full(lefts.size, panels.length)
    return _refine(
        panels.series, lefts, lengths, max(NOISE_TAIL, noise), TAIL * floor * panels.length
    )


def _refine(
    series: Callable[[Array, Array], tuple[Array, Array, Array]],
    lefts: Array,
    lengths: Array,
    noise: float,
    negligible: float,
) -> list[Panels]:
    """Return the panels of K functions, of which those that are not resolved are halved, each for
    itself.

    ``series`` gives coefficients (K, P, N), sizes and tails (K, P) of panels; an integral of tails
    that is ``negligible`` is resolved.
    """
    most = _MOST_HALVED + _MOST_HALVED_AGAIN * lefts.size
    before: Array = np.full((1, lefts.size), np.inf)
    done: list[tuple[Array, Array, Array, Array, Array]] = []
    for _ in range(_MOST_HALVINGS):
        coefficients, sizes, tails = series(lefts, lengths)
        # A spike may be shorter than its phases are exact, and its series never end; a short one
        # needs no more than a long panel.
        resolved = are_settled(tails, before, noise) | (tails * sizes * lengths <= negligible)
        converged = np.all(resolved, axis=0)
        done.append(
            (
                lefts[converged],
                lengths[converged],
                coefficients[:, converged],
                tails[:, converged],
                sizes[:, converged],
            )
        )
        if np.all(converged):
            return _join(done)
        if np.count_nonzero(~converged) > most:
            break
        halves = lengths[~converged] / 2
        lefts = (lefts[~converged][:, None] + halves[:, None] * np.array([0.0, 1.0])).ravel()
        lengths = np.repeat(halves, 2)
        before = np.repeat(tails[:, ~converged], 2, axis=1)
    raise Unsolved(
        "narrow-gap",
        "a spike along the orbit is shorter than phases in doubles are exact; integrate "
        "numerically",
    )


def _join(parts: list[tuple[Array, Array, Array, Array, Array]]) -> list[Panels]:
    """Return the panels of each function, from those resolved in turn."""
    lefts, lengths = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
    of_functions = (np.concatenate([part[k] for part in parts], axis=1) for k in (2, 3, 4))
    return [Panels.of(lefts, lengths, *values) for values in zip(*of_functions, strict=True)]


@dataclass(frozen=True)
class _Panels:
    """Panels of so many nodes, at first of a length of few bits: borders are exact
    multiples of it.
    """

    integrand: Callable[[Array], Array]
    in_tau1: LinearFlow
    floor: float
    nodes: int
    length: float

    def lefts(self, low: float, high: float) -> Array:
        """Return where the panels over a stretch start."""
        before = math.ceil(-low / self.length)
        after = math.ceil(high / self.length)
        first = before + _MARGIN * (before > _NEAR)
        last = max(after + _MARGIN * (after > _NEAR), first == 0)
        return np.arange(-first, last, dtype=float) * self.length

    def series(self, lefts: Array, lengths: Array) -> tuple[Array, Array, Array]:
        """Return the Chebyshev coefficients (K, P, nodes), their sizes and relative tails, (K, P).

        Phases of nodes are those of the border plus a short way.
        """
        points, to_coefficients = _chebyshev(self.nodes)
        offsets = (points * lengths[:, None])[:, :, None]
        z = self.in_tau1.phases(lefts)[:, None, :] + offsets * self.in_tau1.rates
        z = z.reshape(-1, z.shape[2])
        values = [
            self.integrand(z[first : first + _BLOCK])
            for first in iterate(range(0, z.shape[0], _BLOCK), "time map")
        ]
        together = np.ascontiguousarray(np.concatenate(values).T)
        coefficients = together.reshape(len(together), lefts.size, -1) @ to_coefficients
        # zero is resolved
        sizes = np.maximum(np.abs(coefficients[:, :, 0]), max(self.floor, np.finfo(float).tiny))
        return coefficients, sizes, np.max(np.abs(coefficients[:, :, -3:]), axis=2) / sizes

    def longer(self, low: float, high: float) -> _Panels:
        """Return longer panels of more nodes where such resolve the integrand, and
        otherwise these.
        """
        for factor in _LONGER:
            panels = replace(self, nodes=_NODES, length=factor * self.length)
            lefts = panels.lefts(low, high)
            probed = lefts[np.linspace(0, lefts.size - 1, _PROBED).astype(int)]
            lengths = np.full(probed.size, panels.length)
            if np.all(are_settled(panels.series(probed, lengths)[2], np.inf, NOISE_TAIL)):
                return panels
        return self


@lru_cache
def _chebyshev(count: int) -> tuple[Array, Array]:
    """Return the Chebyshev points of [0, 1], from 1 downwards, and what takes values there to
    coefficients; read-only.
    """
    points = np.asarray((np.cos(DOUBLE.nodes(count)) + 1) / 2)
    to_coefficients = np.asarray(DOUBLE.cosine_series(np.eye(count)))
    points.flags.writeable = to_coefficients.flags.writeable = False
    return points, to_coefficients
