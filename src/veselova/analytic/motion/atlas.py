"""The tori of one body with n = 3 as functions of its one constant c_2: frequencies, angle maps and
Fourier coefficients of dt/dτ₁, interpolated from those at Chebyshev points.

Where c_2 meets I_2 is a separatrix: periods grow like the logarithm of the distance. Panels on
either side are halved towards it, and their places are counted from there.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.arithmetic.double_double import DoubleDouble, stack_double_doubles
from veselova.analytic.compiled.compiler import ready
from veselova.analytic.curve.abel_jacobi import AbelJacobi
from veselova.analytic.curve.angle_maps import AngleMaps
from veselova.analytic.curve.hyperelliptic import Curve
from veselova.analytic.curve.periods import Periods
from veselova.analytic.motion.ensemble import LIMITS, States, states_of_stack
from veselova.analytic.motion.ensemble_compiled import Interpolation, states_by_interpolation
from veselova.analytic.motion.torus_stack import (
    TorusStack,
    branch_points,
    columns_at_nodes,
    known_starts,
    origins_of,
    spectra_of_starts,
)
from veselova.analytic.spectrum.branch_points_batch import Spectra
from veselova.analytic.time_map.fourier import SMALLEST_MODE
from veselova.analytic.time_map.mode_tables import ModeTables, fourier_coefficients, orders_of
from veselova.analytic.time_map.rate import TimeRate
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.errors import InvalidInput
from veselova.mechanics.core.times import TimeGrid

__all__ = ["Atlas"]

Array = NDArray[np.float64]

#: Method: degree of the interpolants, and points at which each is compared with the tori
#: themselves.
_DEGREE = 18
_TESTS = 7

#: Budget: halvings of panels towards the separatrix, and largest |m_k| there: nearer tori are
#: computed by themselves.
_HALVINGS = 11
_BOXES = (12, 18, 28, 42)

#: Method: part of the other end, where a cut closes, that panels leave out.
_CLOSED = 2.0**-20

#: Budget: interpolation errors of a panel that is kept: of series and modes, and relative ones of
#: frequencies; one that has more is cut in two. A body with A's within a factor of ten takes 22
#: panels and up to 30 attempts; where A's are far apart, most attempts fail.
_ALLOWED = 4e-15
_ALLOWED_OF_RATES = 4e-15
_MOST_ATTEMPTS = 88

#: Calibrated: largest of the A's over the smallest beyond which no panel is accurate.
_WIDEST = 1e6

#: Calibrated: the part of a largest difference, seen at a few points, that may lie between them.
_BETWEEN = 2.0

#: Calibrated: relative rounding of f and F_0 in ε, as analytic.motion.error_bound has it.
_RATE_ROUNDING = 2.0

#: Budget: starts that are evaluated at once.
_BLOCK = 20_000


@dataclass(frozen=True)
class _Panel:
    """The tori with c_2 − I_2 in [low, high], of one sign.

    - modes: which modes of the box are interpolated, (K,) places in it
    - coefficients: (D+1, L) Chebyshev coefficients of f (g), of F_0 over the scale of the rate, of
      the angle series (g, g, M) and of K modes
    - cancellation: (g,) largest of ``Periods.cancellation``
    - off: of each mode; of_rates: relative error of f and F_0; of_phases: error of z
    """

    low: float
    high: float
    highest: int
    modes: NDArray[np.intp]
    coefficients: Array
    cancellation: Array
    off: float
    of_rates: float
    of_phases: float

    @property
    def terms(self) -> int:
        """Return M, the length of the angle series."""
        return int(self.coefficients.shape[1] - 3 - self.modes.size) // 4

    def at(self, distances: Array) -> Array:
        """Return the interpolated numbers at c_2 − I_2 (N,), (N, L)."""
        return _chebyshev(self.places(distances)) @ self.coefficients

    def places(self, distances: Array) -> Array:
        """Return c_2 − I_2 (N,) as places between −1 and 1."""
        return np.asarray((2 * distances - self.low - self.high) / (self.high - self.low))


def _chebyshev(x: Array) -> Array:
    """Return T_k(x), k = 0 … D, (N, D+1)."""
    angles = np.arccos(np.clip(x, -1.0, 1.0))
    return np.asarray(np.cos(angles[:, None] * np.arange(_DEGREE + 1)))


#: The Chebyshev points of a panel, and what turns values there into coefficients.
_POINTS = np.cos((2 * np.arange(_DEGREE + 1) + 1) * np.pi / (2 * _DEGREE + 2))
_TO_COEFFICIENTS = np.linalg.inv(_chebyshev(_POINTS))


class Atlas:
    """The tori of one body with A (3,), distinct positive doubles; raises InvalidInput for others.

    ``panels`` are made at once: some thousand tori, in half a second, or three where most of them
    are not accurate; none where A's are very far apart.
    """

    def __init__(self, A: Array) -> None:
        self._A = A
        order = np.argsort(-A, kind="stable")
        with np.errstate(all="ignore"):
            # a power of two off, so that no quotient overflows
            scaled = np.ldexp(A[order], -np.frexp(np.max(A))[1])
            self._inverse = DoubleDouble.of(scaled[-1:]) / scaled
        widths = (self._inverse[1:] - self._inverse[:-1]).high
        if A.shape != (3,) or not np.all(widths > 0):
            raise InvalidInput(("A",), "3 different positive numbers", str(A.tolist()))
        with np.errstate(over="ignore"):
            wide = np.max(A) / np.min(A) > _WIDEST
        self.panels = [] if wide else list(self._panels(widths))

    def _panels(self, widths: Array) -> Iterator[_Panel]:
        """Yield the panels on both sides of I_2, of these widths: where one is not accurate it is
        cut, the largest first, until there were too many attempts.
        """
        sides = ((-1.0, widths[0]), (1.0, widths[1]))
        waiting = deque((sign, *ends) for sign, width in sides for ends in _graded(width))
        for _ in range(_MOST_ATTEMPTS):
            if not waiting:
                return
            checkpoint()
            sign, near, far = waiting.popleft()
            panel = self._interpolate(*sorted((sign * near, sign * far)))
            if panel is not None:
                yield panel
            else:
                middle = math.sqrt(near) * math.sqrt(far)
                waiting += [(sign, near, middle), (sign, middle, far)]

    def _interpolate(self, low: float, high: float) -> _Panel | None:
        """Return the interpolant between two c_2 − I_2, None where it is not accurate."""
        tests = np.cos((np.arange(_TESTS) + 0.5) * np.pi / _TESTS + 0.1)
        places = (low + high) / 2 + (high - low) / 2 * np.concatenate([_POINTS, tests])
        tori = _Tori(self._curves(places))
        for highest in _BOXES:
            values, off, counts = tori.coefficients(highest)
            at_face = np.max(np.abs(orders_of(highest, 2)), axis=1) == highest
            if not np.any(counts[:, at_face]):
                break
        else:
            return None
        # modes that fade within the panel are interpolated as they are, not as zeros
        modes = np.flatnonzero(np.any(counts, axis=0))
        periods = tori.periods
        numbers = [periods.frequencies, tori.mean, periods.angle_series, values[:, modes]]
        table = np.concatenate([np.reshape(x, (len(places), -1)) for x in numbers], axis=1)
        count = _DEGREE + 1
        panel = _Panel(
            low,
            high,
            highest,
            modes,
            _TO_COEFFICIENTS @ table[:count],
            np.max(periods.cancellation, axis=0),
            max(4 * SMALLEST_MODE, float(np.max(off[counts], initial=0.0)) / 2),
            0.0,
            0.0,
        )
        apart = _BETWEEN * np.abs(panel.at(places[count:]) - table[count:])
        end = 3 + 4 * panel.terms
        of_rates = float(np.max(apart[:, :3] / np.abs(table[count:, :3])))
        of_series = float(np.max(np.sqrt(np.sum(apart[:, 3:end] ** 2, axis=1))))
        of_modes = float(np.max(apart[:, end:], initial=0.0))
        if max(of_series, of_modes) > _ALLOWED or of_rates > _ALLOWED_OF_RATES:
            return None
        return replace(panel, off=panel.off + of_modes, of_rates=of_rates, of_phases=of_series)

    def _curves(self, distances: Array) -> Curve:
        """Return the curves with c_2 − I_2 (N,), all of one sign."""
        inverse = self._inverse
        constant = inverse[1] + distances
        ends = [DoubleDouble.of(np.zeros_like(distances)), _spread(inverse[0], distances)]
        middle = _spread(inverse[1], distances)
        below = bool(distances[0] < 0)
        ends += [constant, middle] if below else [middle, constant]
        points = stack_double_doubles([*ends, _spread(inverse[2], distances)])
        between = (points[:, None, :] - points[:, :, None]).high
        return Curve(DOUBLE, points.high, between, origins_of(np.array([below])))

    def states(self, q: Array, q_dot: Array, grid: TimeGrid) -> Iterator[States]:
        """Yield the states of starts (N, 3), exact as they stand, at the times of a grid, for as
        many of the starts as lie on a panel.
        """
        A = np.broadcast_to(self._A, q.shape)
        chosen = known_starts(A, q, q_dot)
        for first in range(0, chosen.size, _BLOCK):
            rows = chosen[first : first + _BLOCK]
            spectra = spectra_of_starts(A[rows], q[rows], q_dot[rows])
            distances = (spectra.constants[:, 1] - spectra.inverse[:, 1]).high
            for panel in self.panels:
                on_it = spectra.known & (distances >= panel.low) & (distances <= panel.high)
                members = np.flatnonzero(on_it)
                if members.size:
                    checkpoint()
                    stack = _stack(panel, rows, spectra, members)
                    if ready():
                        numbers = _interpolation(panel, stack, distances[members])
                        for places, found in states_by_interpolation(stack, numbers, grid, LIMITS):
                            arrays = found.tau1, found.q_dot, found.frame, found.error
                            yield States(stack.rows[places], *arrays)
                    else:
                        tables = _tables(panel, stack, distances[members])
                        yield from states_of_stack(stack, tables, grid, None)


def _graded(width: float) -> Iterator[tuple[float, float]]:
    """Yield the distances from I_2 between which the panels of one side lie."""
    far = width * (1 - _CLOSED)
    for halving in range(1, _HALVINGS + 1):
        near = width * 2.0**-halving
        yield near, far
        far = near


def _spread(value: DoubleDouble, like: Array) -> DoubleDouble:
    return DoubleDouble(np.full_like(like, value.high), np.full_like(like, value.low))


@dataclass(frozen=True)
class _Tori:
    """The tori of some curves; the scale of dt/dτ₁ is one."""

    curves: Curve

    @cached_property
    def periods(self) -> Periods:
        """Return the periods, with as many nodes as the neediest of them asks for."""
        counting = Periods(self.curves)
        count = max(int(np.max(counting.count_nodes(cut))) for cut in counting.cuts)
        return Periods(self.curves, count)

    @cached_property
    def _rate(self) -> TimeRate:
        return TimeRate(AbelJacobi(self.periods), np.ones(len(self.curves.branch_points)), "t")

    @cached_property
    def mean(self) -> Array:
        """Return F_0, (N,)."""
        return np.asarray(self._rate.mean)

    def coefficients(self, highest: int) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Return ``fourier_coefficients`` in a box."""
        pace = float(np.max(AngleMaps(self.periods.angle_series).paces)) * highest
        columns = columns_at_nodes(self.periods, self._rate, pace)
        return fourier_coefficients(*columns, self._rate.scale, self.mean, highest)


def _stack(
    panel: _Panel, rows: NDArray[np.intp], spectra: Spectra, members: NDArray[np.intp]
) -> TorusStack:
    """Return the tori of some starts on one panel, without what is interpolated of them."""
    points, origins = branch_points(spectra, members, np.array([panel.high <= 0]))
    between = (points[:, None, :] - points[:, :, None]).high
    periods = Periods(Curve(DOUBLE, points.high, between, origins), panel.terms)
    stack = TorusStack(rows[members], spectra.part(members), points, periods)
    count = members.size
    base = panel.cancellation * DOUBLE.epsilon + panel.of_phases
    vars(stack).update(
        rate_rounding=np.full(count, panel.of_rates + _RATE_ROUNDING * DOUBLE.epsilon),
        phase_error=np.full(count, panel.of_phases),
        base_rounding=np.tile(base, (count, 1)),
    )
    return stack


def _interpolation(panel: _Panel, stack: TorusStack, distances: Array) -> Interpolation:
    """Return what compiled loops take of the panel."""
    scale = np.asarray(stack.rate.scale)
    arguments = panel.coefficients, panel.places(distances), scale, panel.modes
    return Interpolation(*arguments, panel.terms, panel.highest, panel.off)


def _tables(panel: _Panel, stack: TorusStack, distances: Array) -> ModeTables:
    """Fill what is interpolated of tori, and return their tables."""
    numbers = panel.at(distances)
    count = distances.size
    end = 3 + 4 * panel.terms
    series = np.ascontiguousarray(numbers[:, 3:end]).reshape(count, 2, 2, -1)
    vars(stack.periods)["angle_series"] = series
    vars(stack).update(
        frequencies=np.ascontiguousarray(numbers[:, :2]), mean=numbers[:, 2] * stack.rate.scale
    )
    values = np.zeros((count, (panel.highest + 1) * (2 * panel.highest + 1)))
    values[:, panel.modes] = numbers[:, end:]
    return ModeTables(
        values.reshape(count, panel.highest + 1, -1), np.full(count, panel.off), panel.modes
    )
