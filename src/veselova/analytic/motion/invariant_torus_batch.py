"""The invariant tori of many Veselova problems of one dimension at once: what
analytic.motion.invariant_torus finds for one, without its matrices.

Curves whose branch points come in one order, with one number of nodes, are computed as one stack of
arrays. No number depends on which other problems are in it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.arithmetic.double_double import DoubleDouble, stack_double_doubles
from veselova.analytic.curve.abel_jacobi import AbelJacobi
from veselova.analytic.curve.hyperelliptic import BranchPoint, Curve
from veselova.analytic.curve.periods import Periods
from veselova.analytic.motion.invariant_torus import actions
from veselova.analytic.spectrum.branch_points_batch import Spectra
from veselova.analytic.time_map.rate import TimeRate, rate_factor
from veselova.mechanics.core.budget import checkpoint

__all__ = ["Tori", "tori"]

Array = NDArray[np.float64]

#: Neighbouring branch points nearer than this part of the largest are left to analytic.torus. Down
#: to here, their differences have twenty digits.
_NARROWEST = 1e-12

#: Numbers of nodes are rounded up to one of these; who needs more has a gap that is worth a call of
#: its own.
_NODES = np.array([12, 16, 20, 24, 32, 40, 52, 64])

#: Largest |log₂| of all A's of a problem together, of any q_i, and of the largest q̇_i: products of
#: them, and what these round, stay floats.
_MOST_BINARY_DIGITS = 150

#: Largest dimension: the orders of branch points are 2^(n−2), and few problems share one.
_MOST_DIMENSIONS = 9


@dataclass(frozen=True)
class Tori:
    """What tori have in numbers, first axis the N problems; g = n−1. Names and units are those of
    ``Torus``.

    known (N,) which problems were computed; the others have NaN
    """

    known: NDArray[np.bool_]
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


def tori(A: Any, q: Any, q_dot: Any) -> Tori:
    """Return the tori of Veselova problems given by arrays (N, n) of doubles, exact as they stand.

    q needs no length, and q̇ may have a part along q. Equal A's, directions that do not move or
    start at q_i = 0, branch points nearer than 1e-12 of the largest, and dimensions above nine are
    not for this function. Digits: those of ``torus``, to 1e-14 of every number (of a cycle for
    phases), tested for n = 2…7. Where A's are orders of magnitude apart the map to phases
    cancels, here as there: over nine of them phases differ by 2e-13.
    """
    A, q, q_dot = (np.asarray(x, dtype=np.float64) for x in (A, q, q_dot))
    count, n = A.shape
    chosen = (
        np.flatnonzero(_plain(A, q, q_dot)) if n <= _MOST_DIMENSIONS else np.empty(0, dtype=np.intp)
    )
    found = _nothing(count, n)
    if chosen.size:
        spectra = Spectra.of(A[chosen], q[chosen], q_dot[chosen])
        for members, part in _stacks(spectra):
            rows = chosen[members]
            for name, values in part.items():
                getattr(found, name)[rows] = values
    return found


def _nothing(count: int, n: int) -> Tori:
    """Return the tori of no problem out of so many."""
    shapes = {"energy": (), "mean_rate": (), "constants": (n - 2,), "branch_points": (2 * n - 1,)}
    values: dict[str, Any] = {
        field.name: np.full((count, *shapes.get(field.name, (n - 1,))), np.nan)
        for field in fields(Tori)
        if field.name not in ("known", "origins")
    }
    return Tori(
        known=np.zeros(count, dtype=bool),
        origins=np.zeros((count, 2 * n - 1), dtype="U3"),
        **values,
    )


def _plain(A: Array, q: Array, q_dot: Array) -> NDArray[np.bool_]:
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
    return np.asarray(
        np.all(sizes < _MOST_BINARY_DIGITS, axis=0) & (largest < _MOST_BINARY_DIGITS) & apart
    )


def _stacks(spectra: Spectra) -> Iterator[tuple[NDArray[np.intp], dict[str, Any]]]:
    """Yield the numbers of problems, and what was found of them, stack by stack."""
    lower = spectra.constants.high[:, 1:] < spectra.inverse.high[:, 1:-1]  # c_s < I_s
    order = lower @ (1 << np.arange(lower.shape[1]))
    for code in np.unique(order[spectra.known]):
        members = np.flatnonzero(spectra.known & (order == code))
        points, origins = _branch_points(spectra, members, lower[members[0]])
        wide = np.min((points[:, 1:] - points[:, :-1]).high, axis=1) > _NARROWEST
        members = members[wide]
        points = points[wide]
        curves = Curve(DOUBLE, points.high, (points[:, None, :] - points[:, :, None]).high, origins)
        nodes = _node_counts(Periods(curves))
        for count in np.unique(nodes[nodes > 0]):
            checkpoint()
            chosen = np.flatnonzero(nodes == count)
            stack = Curve(DOUBLE, points.high[chosen], curves.differences[chosen], origins)
            yield (
                members[chosen],
                _numbers(spectra, members[chosen], points[chosen], Periods(stack, int(count))),
            )


def _branch_points(
    spectra: Spectra, members: NDArray[np.intp], lower: NDArray[np.bool_]
) -> tuple[DoubleDouble, tuple[BranchPoint, ...]]:
    """Return b_0 < … < b_{2g} and where they come from, where c_s < I_s for the s = 2…g that
    ``lower`` marks.
    """
    order = [BranchPoint("c", 0), BranchPoint("I", 0)]
    for s, constant_first in enumerate(lower, start=1):
        pair = [BranchPoint("c", s), BranchPoint("I", s)]
        order += pair if constant_first else pair[::-1]
    order.append(BranchPoint("I", lower.size + 1))
    values = {"c": spectra.constants[members], "I": spectra.inverse[members]}
    return stack_double_doubles([values[origin.kind][:, origin.index] for origin in order]), tuple(
        order
    )


def _node_counts(periods: Periods) -> NDArray[np.int_]:
    """Return how many nodes each of many curves needs on its intervals, 0 where that
    is too many.
    """
    needed = np.max([periods.count_nodes(cut)[:, 0] for cut in periods.cuts], axis=0)
    place = np.searchsorted(_NODES, needed)
    return np.asarray(np.append(_NODES, 0)[place])


def _numbers(
    spectra: Spectra, members: NDArray[np.intp], points: DoubleDouble, periods: Periods
) -> dict[str, Any]:
    """Return the fields of ``Tori`` for the members of one stack."""
    unit = spectra.unit[members, None]
    spheroconic = spectra.spheroconic[members]
    root = np.sqrt(unit)
    rate = _time_rate(spectra.time_rate[members], spheroconic, periods)
    mean = np.asarray(rate.mean)[:, None]
    frequencies = periods.frequencies
    start = _phases(_angles(spheroconic, points, spectra.increasing[members], periods), periods)
    in_time = frequencies / mean
    axes = spectra.axes[members] + 1
    numbers = [
        axes[:, o.index] if o.kind == "I" else np.full(axes.shape[0], o.index + 1)
        for o in periods.curve.origins
    ]
    kinds = [origin.kind for origin in periods.curve.origins]
    return {
        "known": True,
        "energy": spectra.energy[members],
        "constants": spectra.constants.high[members, 1:] / unit,
        "branch_points": periods.curve.branch_points / unit,
        "origins": np.char.add(kinds, np.stack(numbers, axis=1).astype("U2")),
        "actions": actions(periods) / root,
        "rotation_numbers": in_time / in_time[:, :1],
        "frequencies_tau1": frequencies / root,
        "frequencies_t": in_time,
        "phases": np.mod(np.mod(start, 1.0), 1.0),
        "mean_rate": (mean / root)[:, 0],
    }


def _time_rate(at_start: Array, spheroconic: DoubleDouble, periods: Periods) -> TimeRate:
    """Return dt/dτ₁ on each torus, from its value at the start."""
    product = at_start[:, None]
    for s in range(periods.genus):
        product = product * rate_factor(periods.curve, s, spheroconic.high[:, s, None], "t", DOUBLE)
    return TimeRate(AbelJacobi(periods), 1 / product[:, 0], "t")


def _angles(
    spheroconic: DoubleDouble, points: DoubleDouble, increasing: NDArray[np.bool_], periods: Periods
) -> Array:
    """Return the angles ψ_s of the starts, shape (N, g)."""
    angles = []
    for s, cut in enumerate(periods.cuts):
        place = spheroconic[:, s, None]
        below = (place - points[:, 2 * s + 1, None]).high
        above = (points[:, 2 * s + 2, None] - place).high
        angles.append(cut.points.angles(below, above, increasing[:, s, None]))
    return np.concatenate(angles, axis=1)


def _phases(angles: Array, periods: Periods) -> Array:
    """Return z of one point on each torus, by the series of ``AbelJacobi.map``."""
    orders = np.arange(1, periods.longest)
    exponentials = np.sin(angles[:, :, None] * orders) / orders
    terms = periods.angle_series[..., 1:] * exponentials[:, None]
    return np.asarray(angles / (2 * np.pi) + np.sum(terms.reshape(*angles.shape, -1), axis=-1))
