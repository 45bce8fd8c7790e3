"""Invariant tori of many Veselova problems, those whose branch points come in one order side by
side: what motions and tori of many starts have in common.

No number depends on which other problems are in a stack.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.arithmetic.double_double import DoubleDouble, stack_double_doubles
from veselova.analytic.compiled.compiler import ready
from veselova.analytic.curve.abel_jacobi import AbelJacobi
from veselova.analytic.curve.angle_maps import AngleMaps
from veselova.analytic.curve.hyperelliptic import BranchPoint, Curve
from veselova.analytic.curve.periods import Periods
from veselova.analytic.spectrum.branch_points_batch import Spectra
from veselova.analytic.time_map.mode_tables import ModeTables, form_tables
from veselova.analytic.time_map.rate import TimeRate, rate_factor
from veselova.mechanics.core.budget import checkpoint
from veselova.tunings import STACKED_DIMENSIONS

__all__ = [
    "MOST_BINARY_DIGITS",
    "NARROWEST",
    "NODES_PER_WAVE",
    "NODE_COUNTS",
    "RATE_ROUNDING",
    "SPARE_NODES",
    "TorusStack",
    "branch_points",
    "columns_at_nodes",
    "known_starts",
    "origins_of",
    "spectra_of_starts",
    "torus_stacks",
]

Array = NDArray[np.float64]

#: Derived: neighbouring branch points nearer than this part of the largest are left to
#: analytic.torus. Down to here, their differences have twenty digits.
NARROWEST = 1e-12

#: Numbers of nodes are rounded up to one of these; who needs more has a gap that is worth a call of
#: its own.
NODE_COUNTS = (12, 16, 20, 24, 32, 40, 52, 64)

#: Budget: starts whose tori are formed side by side: some tenths of a second.
_STARTS = 2**14

#: Derived: largest |log₂| of all A's of a problem together, of any q_i, and of the largest q̇_i:
#: products of them, and what these round, stay floats.
MOST_BINARY_DIGITS = 150


#: Calibrated: relative rounding of f and F_0 in ε, as analytic.motion.error_bound has it.
RATE_ROUNDING = 2.0

#: What a stack knows of each of its tori, once it is asked for.
_BY_ROWS = (
    "angles",
    "phases",
    "frequencies",
    "mean",
    "signs",
    "rate_rounding",
    "phase_error",
    "start_rounding",
    "base_rounding",
)

#: Derived: N nodes of half a period have the mean of what has less than 2N waves in it, those of
#: the forms and of a mode together. A tenth more, and some, leaves nothing above 1e-15.
NODES_PER_WAVE = 0.6
SPARE_NODES = 6


@dataclass(frozen=True)
class TorusStack:
    """N tori whose branch points come in one order, with one number of nodes on every interval.

    - rows: (N,) their places among all problems
    - spectra: of them alone
    - points: (N, 2g+1) b_0 < … < b_{2g} to thirty digits
    - periods: of all N curves
    """

    rows: NDArray[np.intp]
    spectra: Spectra
    points: DoubleDouble
    periods: Periods

    def part(self, members: NDArray[np.intp]) -> TorusStack:
        """Return some of the tori, with what is known of them."""
        curve = self.curve
        points = curve.branch_points[members]
        part = Curve(DOUBLE, points, curve.differences[members], curve.origins)
        result = TorusStack(
            self.rows[members],
            self.spectra.part(members),
            self.points[members],
            self.periods.part(part, members),
        )
        for name in _BY_ROWS:
            if name in vars(self):
                vars(result)[name] = vars(self)[name][members]
        return result

    @property
    def curve(self) -> Curve:
        """Return the curves."""
        return self.periods.curve

    @cached_property
    def angles(self) -> Array:
        """Return the angles ψ_s of the starts, (N, g)."""
        below, above = self.on_cuts
        angles = [
            cut.points.angles(below[:, s, None], above[:, s, None], increasing)
            for s, cut in enumerate(self.periods.cuts)
            for increasing in [self.spectra.increasing[:, s, None]]
        ]
        return np.concatenate(angles, axis=1)

    @cached_property
    def on_cuts(self) -> tuple[Array, Array]:
        """Return λ_s−b_{2s−1} and b_{2s}−λ_s at the starts, (N, g) each."""
        spheroconic = self.spectra.spheroconic
        last = 2 * self.periods.genus + 1
        return (
            (spheroconic - self.points[:, 1:last:2]).high,
            (self.points[:, 2:last:2] - spheroconic).high,
        )

    @cached_property
    def maps(self) -> AngleMaps:
        """Return the Abel–Jacobi maps."""
        return AngleMaps(self.periods.angle_series)

    @cached_property
    def phases(self) -> Array:
        """Return z⁰, (N, g), by the series of ``AbelJacobi.map``."""
        return self.maps.map(self.angles[:, None])[:, 0]

    @cached_property
    def frequencies(self) -> Array:
        """Return f, (N, g), cycles per unit of τ₁."""
        return np.asarray(self.periods.frequencies)

    @cached_property
    def rate(self) -> TimeRate:
        """Return dt/dτ₁ on each torus, from its value at the start."""
        product = self.spectra.time_rate[:, None]
        for s in range(self.periods.genus):
            place = self.spectra.spheroconic.high[:, s, None]
            product = product * rate_factor(self.curve, s, place, "t", DOUBLE)
        return TimeRate(AbelJacobi(self.periods), 1 / product[:, 0], "t")

    @cached_property
    def mean(self) -> Array:
        """Return F_0, the mean of dt/dτ₁, (N,)."""
        return np.asarray(self.rate.mean)

    def mode_tables(self, pace: float, highest: int) -> ModeTables:
        """Return the Fourier coefficients of dt/dτ₁ in a box of modes |m_k| ≤ ``highest``, which
        turn by ``pace`` radians at most by one of ψ.
        """
        columns = columns_at_nodes(self.periods, self.rate, pace)
        return form_tables(*columns, np.asarray(self.rate.scale), self.mean, highest)

    @cached_property
    def rate_rounding(self) -> Array:
        """Return the relative error of f and F_0, (N,)."""
        return np.full(self.rows.size, RATE_ROUNDING * DOUBLE.epsilon)

    @cached_property
    def phase_error(self) -> Array:
        """Return by how much the maps between angles and phases are off beyond rounding, (N,)."""
        return np.zeros(self.rows.size)

    @cached_property
    def start_rounding(self) -> Array:
        """Return how far roundings at the start move each phase, (N, g), as
        ``Solution.start_rounding`` has it.
        """
        slopes = self.maps.slopes(self.angles[:, None])[:, 0]
        of_angles = np.abs(slopes) @ np.abs(self.angles)[..., None]
        return np.asarray(of_angles[..., 0] * DOUBLE.epsilon + self.base_rounding)

    @cached_property
    def base_rounding(self) -> Array:
        """Return the part of it that the angles have no share in, (N, g)."""
        periods = self.periods
        integrals = np.sum(
            [np.sum(np.abs(series), axis=2) for series in periods.cut_series], axis=0
        )
        inverse = np.abs(periods.inverse_cycles)
        return np.asarray((inverse @ integrals[..., None])[..., 0] * DOUBLE.epsilon)

    @cached_property
    def signs(self) -> Array:
        """Return the constant signs ς_i of the q_i, (N, n), along sorted axes."""
        result = self.spectra.signs.copy()
        for i in range(result.shape[1]):
            j = self.curve.place["I", i]
            if j % 2 == 1:  # along sn, which has the sign of the angle
                up = self.spectra.increasing[:, Curve.cut_of(j) - 1]
                result[:, i] *= np.where(up, 1.0, -1.0)
        return result


def columns_at_nodes(periods: Periods, rate: TimeRate, pace: float) -> tuple[Array, Array]:
    """Return the weights of dt/dτ₁ and G_s, (N, s, k, J) each, at J nodes, enough for modes that
    turn by ``pace`` radians at most by one of ψ.
    """
    nodes = math.ceil(NODES_PER_WAVE * (periods.longest + pace)) + SPARE_NODES
    psi = DOUBLE.nodes(nodes)
    series = periods.angle_series  # (N, k, s, M)
    orders = np.arange(1, series.shape[3])
    powers = np.sin(np.outer(orders, psi)) / orders[:, None]
    G = np.ascontiguousarray(np.swapaxes(series[..., 1:], 1, 2)) @ powers
    cuts = np.arange(periods.genus)
    G[:, cuts, cuts] += psi / (2 * np.pi)
    weights = np.stack([rate.weights(s, psi) for s in cuts.tolist()], axis=1)
    return weights, G


def torus_stacks(
    A: Array, q: Array, q_dot: Array, node_counts: Sequence[int] = NODE_COUNTS
) -> Iterator[TorusStack]:
    """Yield the tori of Veselova problems given by arrays (N, n) of doubles, exact as they stand,
    stack by stack; problems that are not of this kind are in none.

    q needs no length, and q̇ may have a part along q. Numbers of nodes are rounded up to one of
    ``node_counts``: fewer stacks, or fewer nodes. A's have to be apart, no q_i may be zero and
    no direction at rest, and n is at most nine.
    """
    if A.shape[1] > STACKED_DIMENSIONS:
        return
    chosen = known_starts(A, q, q_dot)
    for first in range(0, chosen.size, _STARTS):
        checkpoint()
        block = chosen[first : first + _STARTS]
        spectra = spectra_of_starts(A[block], q[block], q_dot[block])
        for rows, points, periods in _stacks(spectra, node_counts):
            yield TorusStack(block[rows], spectra.part(rows), points, periods)


def _stacks(
    spectra: Spectra, node_counts: Sequence[int]
) -> Iterator[tuple[NDArray[np.intp], DoubleDouble, Periods]]:
    """Yield rows of spectra whose curves are of one kind, their branch points, and the periods."""
    lower = spectra.constants.high[:, 1:] < spectra.inverse.high[:, 1:-1]  # c_s < I_s
    order = lower @ (1 << np.arange(lower.shape[1]))
    for code in np.unique(order[spectra.known]):
        members = np.flatnonzero(spectra.known & (order == code))
        points, origins = branch_points(spectra, members, lower[members[0]])
        wide = np.min((points[:, 1:] - points[:, :-1]).high, axis=1) > NARROWEST
        members = members[wide]
        points = points[wide]
        curves = Curve(DOUBLE, points.high, (points[:, None, :] - points[:, :, None]).high, origins)
        nodes = _node_counts(Periods(curves), node_counts)
        for count in np.unique(nodes[nodes > 0]):
            checkpoint()
            part = np.flatnonzero(nodes == count)
            stack = Curve(DOUBLE, points.high[part], curves.differences[part], origins)
            yield members[part], points[part], Periods(stack, int(count))


def spectra_of_starts(A: Array, q: Array, q_dot: Array) -> Spectra:
    """Return ``Spectra.of``, by compiled loops where they serve: no bit depends on that."""
    if ready():
        from veselova.analytic.compiled.spectra import spectra_of

        return spectra_of(A, q, q_dot)
    return Spectra.of(A, q, q_dot)


def known_starts(A: Array, q: Array, q_dot: Array) -> NDArray[np.intp]:
    """Return which problems are of moderate size, with A's apart and no q_i = 0."""
    with np.errstate(divide="ignore", invalid="ignore"):
        sizes = np.stack(
            [
                np.sum(np.abs(np.log2(A)), axis=1),
                *(np.max(np.abs(np.log2(np.abs(x))), axis=1) for x in (A, q)),
            ]
        )
        largest = np.abs(np.log2(np.max(np.abs(q_dot), axis=1)))
    ordered = np.sort(A, axis=1)
    apart = np.all(np.diff(ordered, axis=1) > 0, axis=1)
    moderate = np.all(sizes < MOST_BINARY_DIGITS, axis=0) & (largest < MOST_BINARY_DIGITS)
    return np.flatnonzero(moderate & apart)


def branch_points(
    spectra: Spectra, members: NDArray[np.intp], lower: NDArray[np.bool_]
) -> tuple[DoubleDouble, tuple[BranchPoint, ...]]:
    """Return b_0 < … < b_{2g} and where they come from, where c_s < I_s for the s = 2…g that
    ``lower`` marks.
    """
    order = origins_of(lower)
    values = {"c": spectra.constants[members], "I": spectra.inverse[members]}
    columns = [values[origin.kind][:, origin.index] for origin in order]
    return stack_double_doubles(columns), order


def origins_of(lower: NDArray[np.bool_]) -> tuple[BranchPoint, ...]:
    """Return where b_0 < … < b_{2g} come from, where c_s < I_s for the s that ``lower`` marks."""
    order = [BranchPoint("c", 0), BranchPoint("I", 0)]
    for s, constant_first in enumerate(lower, start=1):
        pair = [BranchPoint("c", s), BranchPoint("I", s)]
        order += pair if constant_first else pair[::-1]
    order.append(BranchPoint("I", lower.size + 1))
    return tuple(order)


def _node_counts(periods: Periods, node_counts: Sequence[int]) -> NDArray[np.int_]:
    """Return how many nodes each of many curves needs on its intervals, 0 where that
    is too many.
    """
    needed = np.max([periods.count_nodes(cut)[:, 0] for cut in periods.cuts], axis=0)
    place = np.searchsorted(node_counts, needed)
    return np.asarray(np.array([*node_counts, 0])[place])
