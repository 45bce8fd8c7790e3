"""Windows of Neumann time in which a motion is evaluated, and whether its series there are
resolved.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.dense_output.piecewise_polynomial import PiecewisePolynomial
from veselova.analytic.time_map.chebyshev_panels import are_settled
from veselova.mechanics.core.budget import iterate

__all__ = ["MOST_HALVINGS", "NODES", "SUM_ROUNDING", "Evaluation", "WindowBatch", "WindowGrid"]

Array = NDArray[np.float64]

#: From τ₁ (N,) and the phases there (N, g) to dt/dτ₁, (N,), and the series, each with first axis N.
Evaluation = Callable[[Array, Array], tuple[Array, tuple[Array, ...]]]

#: Method: Chebyshev points of a window.
NODES = 48

#: Budget: windows evaluated at once, and how often those that are not resolved are halved.
_AT_ONCE = 64
MOST_HALVINGS = 16

#: Calibrated: last coefficients of a window below this may be rounding of the evaluation.
_NOISE_TAIL = 1e-12

#: What a sum of polynomials rounds to.
SUM_ROUNDING = 4 * float(np.finfo(float).eps)

#: Chebyshev points of [0, 1], and the matrix from values there to coefficients.
_OFFSETS = (np.cos(DOUBLE.nodes(NODES)) + 1) / 2
_TO_COEFFICIENTS = DOUBLE.cosine_series(np.eye(NODES)).T


@dataclass(frozen=True)
class WindowGrid:
    """W windows of one length: the times u at which they start, of any time map; ``tails`` (W,) of
    longer ones there.
    """

    length: float
    starts: Array
    tails: Array

    def __len__(self) -> int:
        return int(self.starts.size)

    def __getitem__(self, chosen: slice | NDArray[np.bool_] | NDArray[np.intp]) -> WindowGrid:
        return WindowGrid(self.length, self.starts[chosen], self.tails[chosen])

    @classmethod
    def concatenate(cls, parts: Sequence[WindowGrid]) -> WindowGrid:
        """Return all windows of the parts."""
        return cls(
            parts[0].length,
            *(
                np.concatenate([getattr(part, name) for part in parts])
                for name in ("starts", "tails")
            ),
        )

    def remaining(self, attempt: Callable[[WindowGrid], WindowGrid]) -> WindowGrid:
        """Return the windows that attempts at a few at once leave."""
        return WindowGrid.concatenate(
            [
                attempt(self[first : first + _AT_ONCE])
                for first in iterate(range(0, len(self), _AT_ONCE), "motion")
            ]
        )

    def halve(self) -> WindowGrid:
        """Return the halves, in their order."""
        length = self.length / 2
        return WindowGrid(
            length,
            (self.starts[:, None] + np.array([0.0, length])).ravel(),
            np.repeat(self.tails, 2),
        )


@dataclass(frozen=True)
class WindowBatch:
    """W windows in Neumann time: Chebyshev coefficients of dt/dτ₁ (W, NODES) and of the series (W,
    NODES, C).

    - starts, length_tau1: (W,) where they start, and how long they are, in τ₁
    - sizes: (C,) of the series, of the ``shapes``
    - before: (W,) tails of longer windows
    """

    rates: Array
    series: Array
    starts: Array
    length_tau1: float
    sizes: Array
    shapes: list[tuple[int, ...]]
    before: Array

    @classmethod
    def of(
        cls,
        evaluation: Evaluation,
        starts: Array,
        z: Array,
        length_tau1: float,
        frequencies: Array,
        before: Array,
    ) -> WindowBatch:
        """Return the windows at whose starts the phases are z (W, g), and move with the
        frequencies.
        """
        offsets = _OFFSETS * length_tau1
        nodes = z[:, None, :] + offsets[:, None] * frequencies
        rate, series = evaluation(
            (starts[:, None] + offsets).ravel(), nodes.reshape(-1, z.shape[1])
        )
        columns = [part.reshape(starts.size, NODES, -1) for part in series]
        sizes = np.repeat(
            [float(np.max(np.abs(part))) or 1.0 for part in series],
            [part.shape[2] for part in columns],
        )
        in_tau1 = _TO_COEFFICIENTS @ np.concatenate(columns, axis=2)
        rates = rate.reshape(-1, NODES) @ _TO_COEFFICIENTS.T
        return cls(
            rates, in_tau1, starts, length_tau1, sizes, [part.shape[1:] for part in series], before
        )

    @cached_property
    def rate_tails(self) -> Array:
        """Return the largest of the last coefficients of dt/dτ₁ against its mean, (W,)."""
        return np.asarray(np.max(np.abs(self.rates[:, -3:]), axis=1) / self.rates[:, 0])

    @cached_property
    def tails(self) -> Array:
        """Return the largest of the last coefficients of anything against its size, (W,)."""
        return np.asarray(
            np.maximum(
                self.rate_tails,
                np.max(np.max(np.abs(self.series[:, -3:]), axis=1) / self.sizes, axis=1),
            )
        )

    def is_resolved(self, tails: Array) -> NDArray[np.bool_]:
        """Return which windows are resolved, by the tails of anything that was made of them."""
        return are_settled(tails, self.before, _NOISE_TAIL)

    def in_pieces(self, count: int) -> tuple[PiecewisePolynomial, Array]:
        """Return the pieces in time, of τ₁ and the series, and their tails or those of the windows,
        whichever are larger.
        """
        polynomials = PiecewisePolynomial.of(
            self.rates, self.series, self.sizes, self.length_tau1, count
        )
        tables = polynomials.tables
        tables[:, :, 0] *= self.length_tau1
        tables[:, :, 0, 0] += self.starts[:, None]
        return polynomials, np.maximum(self.tails, polynomials.tails)
