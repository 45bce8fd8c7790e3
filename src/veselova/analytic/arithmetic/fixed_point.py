"""Fixed-point numbers of many digits whose sums of products are products of matrices of doubles.

A number is Σ_i a_i 2^(−22i), i = 0 … L−1, with whole a_i in doubles: a table of numbers is L tables
of doubles. After a carry they are at most 2²¹, all but the first, after a sum of two 2²². Sums of L
products of such limbs are far below 2⁵³, so they are exact in doubles. What lies beyond the last
limb is dropped.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["LARGEST", "LEAST", "UPWARDS", "FixedPoint"]

Array = NDArray[np.float64]

#: Derived: bits of a limb.
_BITS = 22
_BASE = 2.0**_BITS
_OF_BASE = 2.0**-_BITS

#: Derived: a product with L limbs, one of the factors a sum, drops (L−1) 2^(21 − 22L), the products
#: beyond the limb after the last, and that limb. With so many bits beyond those asked for, 22(L−1)
#: or more in all, that is below 2^−bits for any L up to 2⁷.
_DROPPED_BITS = 6

#: Derived: bits of a double that is one part of a number.
_PART_BITS = 52

#: Derived: products of limbs up to 2²¹ of which a sum is exact.
_EXACT = 2**11

#: Budget: doubles of the weights that are spread out at once.
_SPREAD = 4_000_000

#: Derived: sizes that doubles can be scaled from to one, and what makes up for rounding in bounds
#: of doubles.
LEAST = 1e-150
LARGEST = 1e150
UPWARDS = 1 + 1e-6


@dataclass(frozen=True)
class FixedPoint:
    """A table of numbers below 2⁸, ``limbs`` of shape (L, …)."""

    limbs: Array

    @classmethod
    def of(cls, parts: Sequence[Array], bits: int) -> FixedPoint:
        """Return sums of doubles, exact but for the last bit; no operation on them adds an error
        above 2^−bits.
        """
        limbs = np.zeros((math.ceil((bits + _DROPPED_BITS) / _BITS) + 1, *parts[0].shape))
        for rest in parts:
            for i, limb in enumerate(limbs):
                whole = np.rint(rest * _BASE**i)
                limb += whole
                rest = rest - whole * _OF_BASE**i
        return cls(_carry(limbs))

    @classmethod
    def of_numbers(cls, values: NDArray[Any], bits: int) -> FixedPoint:
        """Return numbers of any kind that turn into doubles, and of which doubles can
        be taken off.
        """
        parts = []
        for _ in range(math.ceil(bits / _PART_BITS) + 1):
            parts.append(values.astype(float))
            values = values - parts[-1]
        return cls.of(parts, bits)

    def parts(self) -> list[Array]:
        """Return doubles whose sums are the numbers, exactly."""
        weighted = self.limbs * _OF_BASE ** np.arange(len(self.limbs)).reshape(
            -1, *(1,) * (self.limbs.ndim - 1)
        )
        return [
            weighted[:3].sum(axis=0),
            *(weighted[i : i + 2].sum(axis=0) for i in range(3, len(weighted), 2)),
        ]

    def carry(self) -> FixedPoint:
        """Return the same numbers with limbs that products take."""
        return FixedPoint(_carry(self.limbs.copy()))

    def __mul__(self, other: FixedPoint) -> FixedPoint:
        return FixedPoint(_carry(_products(self.limbs, other.limbs))[:-1])

    def __getitem__(self, where: tuple[slice | int | None, ...]) -> FixedPoint:
        return FixedPoint(self.limbs[:, *where])

    def part_of_product(self, other: FixedPoint, part: int) -> FixedPoint:
        """Return the real part (0) or the imaginary part (1) of products of complex numbers, whose
        parts come first, (2, …).
        """
        a = self.limbs
        b = other.limbs
        if part == 0:
            sums = _products(a[:, 0], b[:, 0]) - _products(a[:, 1], b[:, 1])
        else:
            sums = _products(a[:, 0], b[:, 1]) + _products(a[:, 1], b[:, 0])
        return FixedPoint(_carry(sums)[:-1])

    def turns(self, sines: FixedPoint, count: int) -> FixedPoint:
        """Return cos mφ and sin mφ, m = 0 … count−1, shape (2, count, N), of cosines (N,) and
        sines: w^{h+i} = w^h w^i.

        For |w| ≤ 1 the error of w^m is mε + (m−1)δ, but for products of errors, with that of w, ε,
        and that of two operations in both parts, δ.
        """
        table = np.zeros((len(self.limbs), 2, max(count, 2), self.limbs.shape[1]))
        table[0, 0, 0], table[:, 0, 1], table[:, 1, 1] = 1, self.limbs, sines.limbs
        for last, rows in _ranges(count):
            known = FixedPoint(table[:, :, 1 : rows + 1])
            power = FixedPoint(table[:, :, last : last + 1])
            for part in (0, 1):
                table[:, part, last + 1 : last + 1 + rows] = known.part_of_product(
                    power, part
                ).limbs
        return FixedPoint(table[:, :, :count])

    def dot(self, other: FixedPoint) -> FixedPoint:
        """Return Σ_k x_…k y_…k over the last axis."""
        count = len(self.limbs)
        terms = self.limbs.shape[-1]
        x = np.moveaxis(self.limbs, 0, -2)
        y = np.moveaxis(other.limbs, 0, -1)
        most = _EXACT // count
        total = np.zeros((count, *np.broadcast_shapes(x.shape[:-2], y.shape[:-2])))
        for first in range(0, terms, most):
            # of limbs i and j, which go to place i + j
            pairs = x[..., first : first + most] @ y[..., first : first + most, :]
            sums = np.zeros((count + 1, *total.shape[1:]))
            for i in range(count):
                placed = np.moveaxis(pairs[..., i, : count + 1 - i], -1, 0)
                sums[i : i + len(placed)] += placed
            total += _carry(sums)[:-1]
        return FixedPoint(_carry(total))

    def weighted_sums(self, weights: FixedPoint) -> FixedPoint:
        """Return Σ_k x_kn w_kj, shape (N, J), for numbers (K, N) and weights (K, J)."""
        count, terms, columns = weights.limbs.shape
        most = min(terms, _EXACT // count)
        width = max(1, _SPREAD // (count * (count + 1) * most))
        parts = [
            self._sum_block(weights.limbs[:, :, first : first + width], most)
            for first in range(0, columns, width)
        ]
        return FixedPoint(parts[0] if len(parts) == 1 else np.concatenate(parts, axis=2))

    def _sum_block(self, weights: Array, most: int) -> Array:
        """Return limbs of the sums, which take so many terms at a time."""
        count, terms, columns = weights.shape
        size = self.limbs.shape[2]
        total = np.zeros((count, size, columns))
        for first in range(0, terms, most):
            some = slice(first, first + most)
            factors = self.limbs[:, some]
            table = weights[:, some]
            # Limb i of x times limb j of w goes to place i + j.
            shifted = np.zeros((*table.shape[:2], count + 1, columns))
            for i in range(count):
                placed = np.moveaxis(table[: count + 1 - i], 0, 1)
                shifted[i, :, i : i + placed.shape[1]] = placed
            sums = factors.reshape(-1, size).T @ shifted.reshape(-1, (count + 1) * columns)
            total += _carry(np.moveaxis(sums.reshape(size, count + 1, columns), 1, 0).copy())[
                :count
            ]
        return _carry(total) if terms > most else total


def _ranges(count: int) -> Iterator[tuple[int, int]]:
    """Return the h from which those of h + i follow, and how many, until there are so many
    powers.
    """
    last = 1
    while last < count - 1:
        rows = min(last, count - 1 - last)
        yield last, rows
        last += rows


def _products(a: Array, b: Array) -> Array:
    """Return the products of two tables of limbs, L and one more, not carried."""
    count = len(a)
    shape = np.broadcast_shapes(a.shape[1:], b.shape[1:])
    sums = np.zeros((count + 1, *shape))
    products = np.empty((count, *shape))
    for i in range(count):
        most = min(count, count + 1 - i)
        sums[i : i + most] += np.multiply(a[i], b[:most], out=products[:most])
    return sums


def _carry(limbs: Array) -> Array:
    """Return limbs at most half the base, in place, but for the first; the last one is exact."""
    for i in range(len(limbs) - 1, 0, -1):
        over = np.rint(limbs[i] * _OF_BASE)
        limbs[i - 1] += over
        over *= _BASE
        limbs[i] -= over
    return limbs
