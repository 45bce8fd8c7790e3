"""Fourier sums in balls: over modes at many points, and over points for many modes.

Sums over modes, Σ_m c_m sin 2πm·z and Σ_m c_m cos 2πm·z, put these into a box: along its first axis
sums at all points are one product of matrices, along the others products of numbers. Sums over
points are Σ_j w_kj cos 2πm·z_j. Up to 250 digits both are formed in fixed point.
"""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.arithmetic.fixed_point import LARGEST, LEAST, UPWARDS, FixedPoint
from veselova.mechanics.core.budget import checkpoint, iterate

__all__ = ["SumsOverPoints", "sums_over_modes"]

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Derived: digits up to which the last limbs of numbers of size one are doubles.
_MOST_FIXED = 250

#: Derived: digits of fixed-point numbers beyond those of the sums and of their terms.
_SPARE_DIGITS = 4

#: Budget: points, places of the box along all axes but the first, and rows of modes that are looked
#: at together; and limbs of a table of sums along the first axis, which fewer points take where a
#: place of the second axis has many behind it.
_POINTS = 500
_PLACES = 300
_ROWS = 30
_TABLE = 4_000_000

#: Budget: waves in balls that are in memory at once.
_EXPONENTIALS = 1_000_000

#: Derived: what rounding makes of a power, in both parts (see Fixed.turns); and of a term of a sum
#: with all products behind it: up to four axes 12 at most, and a third of that, since no operation
#: is off by more than a third of its bound at 250 digits.
_OF_POWER = 4.5
_OF_TERM = 10

#: Derived: largest error of e^{2πi m·z}, m the corner of the box, at which products of errors are
#: below this part of errors.
_OPEN = 1e-3


def sums_over_modes(
    kind: Literal["cosines", "sines"],
    modes: Integers,
    coefficients: Values,
    turns: Values,
    arithmetic: Any,
) -> Values:
    """Return Σ c_m cos 2πm·z or Σ c_m sin 2πm·z at turns e^{2πiz} (N, g), shape (N,), for modes (M,
    g) and coefficients (M,).

    No two modes are equal or opposite.
    """
    part = ("cosines", "sines").index(kind)
    fixed = None
    if _fit(coefficients[:, None], arithmetic):
        fixed = _OverModes(part, modes, coefficients, arithmetic)
    result = np.empty(len(turns), dtype=object)
    points = max(1, _EXPONENTIALS // max(1, len(modes)) if fixed is None else fixed.points)
    for first in iterate(range(0, len(turns), points)):
        some = slice(first, first + points)
        if fixed is None or (found := fixed(turns[some])) is None:
            exponentials = arithmetic.exponentials(modes, turns[some])[part]
            found = arithmetic.product(exponentials.T, coefficients[:, None])[:, 0]
        result[some] = found
    return result


class SumsOverPoints:
    """Sums over turns e^{2πiz} (J, g) with weights (K, J), balls, for modes of entries up to
    ``highest``.
    """

    def __init__(self, turns: Values, weights: Values, highest: int, arithmetic: Any) -> None:
        self._in_fixed_point: _OverPoints | None = None
        # modes of one entry have nothing to share
        if turns.shape[1] > 1 and _fit(weights.T, arithmetic):
            fixed = _OverPoints(turns, weights, highest, arithmetic)
            self._in_fixed_point = fixed if fixed.are_narrow else None
        if self._in_fixed_point is None:
            self._xp, self._weights, entries = (
                arithmetic,
                weights.T,
                np.arange(highest + 1)[:, None],
            )
            self._powers = [arithmetic.exponentials(entries, turn[:, None]) for turn in turns.T]

    def cosines(self, modes: Integers) -> Values:
        """Return Σ_j w_kj cos 2πm·z_j for modes (M, g), shape (M, K)."""
        if self._in_fixed_point is not None:
            return self._in_fixed_point(modes)
        cosine = 1
        sine = 0
        for (cosines, sines), entries in zip(self._powers, modes.T, strict=True):
            x = cosines[np.abs(entries)]
            y = sines[np.abs(entries)] * np.sign(entries)[:, None]
            cosine, sine = cosine * x - sine * y, cosine * y + sine * x
        return np.asarray(self._xp.product(cosine, self._weights))


def _fit(coefficients: Values, arithmetic: Any) -> bool:
    """Return whether columns of coefficients can be put into fixed point."""
    sizes = np.sum(np.abs(coefficients.astype(float)), axis=0)
    return bool(arithmetic.digits <= _MOST_FIXED and np.all((sizes > LEAST) & (sizes < LARGEST)))


class _Scaled:
    """Coefficients (M, K) of sums over M as fixed-point numbers: of each column the absolute values
    add up to less than one.

    ``bits``: their precision, enough for sums of so many terms · ``sizes`` (M, K): their absolute
    values
    """

    def __init__(self, coefficients: Values, terms: int, arithmetic: Any) -> None:
        self._xp = arithmetic
        self._terms = terms
        self.bits = math.ceil(
            (arithmetic.digits + _SPARE_DIGITS + math.log10(terms)) * math.log2(10)
        )
        self.sizes = np.abs(coefficients.astype(float))
        self._scales = np.exp2(np.ceil(np.log2(np.sum(self.sizes, axis=0))) + 1)
        middle = arithmetic.midpoints(coefficients)
        self.numbers = FixedPoint.of_numbers(middle / self._scales, self.bits)
        self._open = np.sum(arithmetic.upper_bound(coefficients - middle), axis=0)
        self.sizes /= self._scales

    def balls(self, sums: FixedPoint, slack: Array) -> Values:
        """Return sums (N, K) that their turns leave open by ``slack`` of a unit, of which every
        term was rounded.
        """
        xp = self._xp
        rounding = _OF_TERM * self._terms * 2.0**-self.bits
        result = xp.zero_ball(xp.array(slack * (1 + _OPEN) * UPWARDS + rounding))
        for values in sums.parts():
            result = result + values
        # In doubles the last digits of small sums would be lost.
        return np.asarray(xp.add_error(result * xp.array(self._scales), self._open))


class _Turns:
    """Powers of turns (N, g), balls, up to whole exponents (g,): their values, and ``errors`` of
    the first ones, (N, g).
    """

    def __init__(self, turns: Values, highest: Integers, bits: int) -> None:
        both = np.stack([_real(turns), _imaginary(turns)])
        self._fixed = FixedPoint.of_numbers(both, bits)
        self._highest = highest
        # An error of a power is that of the first one, times the exponent, as long as it is small.
        self.errors = 2 * np.max(_radius(both).astype(float), axis=0) + _OF_POWER * 2.0**-bits
        self.are_narrow = bool(np.max(self.errors @ highest, initial=0.0) < _OPEN)

    def powers(self, axis: int) -> FixedPoint:
        """Return the powers of the turns along an axis from the zeroth on, shape (2, B+1, N)."""
        cosines, sines = (self._fixed[part, :, axis] for part in (0, 1))
        return cosines.turns(sines, int(self._highest[axis]) + 1)


class _OverModes:
    def __init__(self, part: int, modes: Integers, coefficients: Values, arithmetic: Any) -> None:
        highest = self._highest = np.max(np.abs(modes), axis=0)
        # m and −m are one wave: the first entry is made positive. The box has 0 … B along the first
        # axis, −B … B along others.
        signs = np.where(modes[:, 0] < 0, -1, 1)
        self._shape = (int(highest[0]) + 1, *(2 * highest[1:] + 1).tolist())
        self._scaled = _Scaled(coefficients[:, None], math.prod(self._shape), arithmetic)
        # a sine changes sign with m
        self._part, self._limbs = part, self._scaled.numbers.limbs[:, :, 0] * signs**part
        self._places = (modes * signs[:, None]).T
        self._places[1:] += highest[1:, None]
        self._sensitivity = np.abs(modes).T @ self._scaled.sizes
        self._behind = math.prod(self._shape[2:], start=1)
        #: Points that are looked at together.
        self.points = min(_POINTS, _TABLE // (2 * len(self._limbs) * self._behind))

    def __call__(self, points: Values) -> Values | None:
        """Return the sums at turns (N, g); None where these are too open."""
        turns = _Turns(points, self._highest, self._scaled.bits)
        if not turns.are_narrow:
            return None
        return self._scaled.balls(self._sum(turns)[:, None], turns.errors @ self._sensitivity)[:, 0]

    def _sum(self, turns: _Turns) -> FixedPoint:
        """Return the sums, shape (N,), places along the second axis of the box some at a time."""
        first = turns.powers(0).limbs
        size = len(turns.errors)
        part = self._part
        count = len(self._limbs)
        genus = len(self._shape)
        table = FixedPoint(np.moveaxis(first, 2, 1).reshape(count, -1, 2 * size))
        if genus == 1:
            weights = np.zeros((count, self._shape[0], 1))
            weights[:, self._places[0], 0] = self._limbs
            return table.weighted_sums(FixedPoint(weights))[part * size : (part + 1) * size, 0]
        others = [_from_lowest(turns.powers(k)) for k in range(1, genus)]
        step = max(1, _PLACES // self._behind)
        total = np.zeros((count, size))
        for start in iterate(range(0, self._shape[1], step)):
            box = self._box(start, min(step, self._shape[1] - start))
            sums = table.weighted_sums(FixedPoint(box.reshape(*box.shape[:2], -1)))
            inner = sums.limbs.reshape(count, 2, size, *box.shape[2:])
            for power in reversed(others[1:]):
                inner = np.stack([_contract(inner, power, k) for k in (0, 1)], axis=1)
            total += _contract(inner, others[0][..., start : start + step], part)
        return FixedPoint(total).carry()

    def _box(self, start: int, step: int) -> Array:
        """Return limbs (L, B+1, step, …) of the coefficients with some places along the second
        axis, from the modes.
        """
        chosen = (self._places[1] >= start) & (self._places[1] < start + step)
        place = self._places[:, chosen]
        box = np.zeros((len(self._limbs), self._shape[0], step, *self._shape[2:]))
        box[:, place[0], place[1] - start, *place[2:]] = self._limbs[:, chosen]
        return box


def _from_lowest(powers: FixedPoint) -> Array:
    """Return limbs of w^−B … w^B, shape (L, 2, N, 2B+1), from powers (2, B+1, N)."""
    limbs = np.moveaxis(powers.limbs, 2, 3)
    inverse = limbs[..., :0:-1] * np.array([1.0, -1.0])[:, None, None]
    return np.concatenate([inverse, limbs], axis=3)


def _contract(z: Array, w: Array, part: int) -> Array:
    """Return limbs of a part of Σ_k z_…k w_k, for those of z (2, N, …, K) and w (2, N, K)."""
    w = w.reshape(*w.shape[:3], *(1,) * (z.ndim - 4), w.shape[3])
    # Re zw = Re z Re w − Im z Im w, Im zw = Re z Im w + Im z Re w.
    pair = (w[:, 0], -w[:, 1]) if part == 0 else (w[:, 1], w[:, 0])
    return (
        FixedPoint(np.concatenate([z[:, 0], z[:, 1]], axis=-1))
        .dot(FixedPoint(np.concatenate(pair, axis=-1)))
        .limbs
    )


class _OverPoints:
    """Neighbours share all entries but the last: for those the sums with all last entries are two
    products of matrices.
    """

    def __init__(self, points: Values, weights: Values, highest: int, arithmetic: Any) -> None:
        count, genus = points.shape
        self._scaled = _Scaled(weights.T, count * genus, arithmetic)
        turns = _Turns(points, np.full(genus, highest), self._scaled.bits)
        self._sensitivity = turns.errors.T @ self._scaled.sizes
        self.are_narrow = turns.are_narrow
        self._powers = [turns.powers(axis) for axis in range(genus)]
        #: Limbs of Σ_j w_kj cos(m'·z_j) cos(m_g z_jg), and of the same with sines, (L, 2, B+1, K),
        #: by all entries but the last.
        self._rows: dict[tuple[int, ...], Array] = {}

    def __call__(self, modes: Integers) -> Values:
        """Return the sums of modes (M, g)."""
        leading = modes[:, :-1].tolist()
        last = modes[:, -1]
        missing = [row for row in dict.fromkeys(map(tuple, leading)) if row not in self._rows]
        for first in range(0, len(missing), _ROWS):
            checkpoint()
            self._add(missing[first : first + _ROWS])
        limbs = np.empty(
            (len(self._scaled.numbers.limbs), *modes.shape[:1], self._sensitivity.shape[1])
        )
        for place, (row, entry) in enumerate(zip(leading, last.tolist(), strict=True)):
            sums = self._rows[tuple(row)][:, :, abs(entry)]
            limbs[:, place] = sums[:, 0] + sums[:, 1] if entry < 0 else sums[:, 0] - sums[:, 1]
        return self._scaled.balls(FixedPoint(limbs), np.abs(modes) @ self._sensitivity)

    def _add(self, rows: list[tuple[int, ...]]) -> None:
        """Form the sums of some rows."""
        numbers = self._scaled.numbers
        count, points, columns = numbers.limbs.shape
        exponentials = self._leading(np.array(rows))
        last = self._powers[-1].limbs
        found = np.empty((count, 2, last.shape[2], len(rows), columns))
        for part in (0, 1):
            # Of shape (L, J, rows, K).
            weights = (
                FixedPoint(np.swapaxes(exponentials.limbs[:, part], 1, 2)[..., None])
                * numbers[:, None]
            )
            table = FixedPoint(np.swapaxes(last[:, part], 1, 2))
            sums = table.weighted_sums(FixedPoint(weights.limbs.reshape(count, points, -1)))
            found[:, part] = sums.limbs.reshape(count, -1, len(rows), columns)
        self._rows.update(
            (row, np.ascontiguousarray(found[:, :, :, place])) for place, row in enumerate(rows)
        )

    def _leading(self, modes: Integers) -> FixedPoint:
        """Return e^{2πi m'·z} of all axes but the last, shape (2, M, J)."""
        exponentials = self._power(modes, 0)
        for axis in range(1, modes.shape[1]):
            factor = self._power(modes, axis)
            exponentials = FixedPoint(
                np.stack(
                    [exponentials.part_of_product(factor, part).limbs for part in (0, 1)], axis=1
                )
            )
        return exponentials

    def _power(self, modes: Integers, axis: int) -> FixedPoint:
        """Return the factors of one axis, shape (2, M, J)."""
        entries = modes[:, axis]
        limbs = self._powers[axis].limbs[:, :, np.abs(entries)]
        limbs[:, 1] *= np.where(entries < 0, -1.0, 1.0)[:, None]
        return FixedPoint(limbs)


_real = np.frompyfunc(lambda x: x.real, 1, 1)
_imaginary = np.frompyfunc(lambda x: x.imag, 1, 1)
_radius = np.frompyfunc(lambda x: float(x.rad()), 1, 1)
