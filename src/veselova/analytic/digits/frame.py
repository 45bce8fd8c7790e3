"""The body's frame in ball arithmetic: from the normals along its moving directions to e_1 … e_n
along the principal axes.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.attitude.frame import Attitude
from veselova.analytic.spectrum.moving_part import Moving
from veselova.mechanics.systems.torus_problem import TorusProblem

__all__ = ["BodyFrame", "frame_around", "orthonormal"]

#: Derived: a column of the natural frame in double precision this near to a normal, or to a
#: direction that rests, is that one. Beyond, constants of motion are so close together that the
#: frame in double precision is taken for a given one.
_NEARLY_NATURAL = 1e-9


@dataclass(frozen=True)
class BodyFrame:
    """The frame of a problem, (e_2 … e_n) = D N ℜ + R: D the directions that move, N the normals
    along them, ℜ and R constant.

    q (m,), normals (m, g): those of the start, along the directions that move
    """

    problem: TorusProblem
    moving: Moving
    q: Values
    normals: Values
    arithmetic: Any

    @cached_property
    def directions(self) -> Values:
        """Return D, (n, m)."""
        xp = self.arithmetic
        columns = xp.array(np.zeros((self.moving.n, self.moving.size)))
        for column, vector in zip(columns.T, self.moving.vectors, strict=True):
            length = xp.sqrt(xp.number(sum((x * x for x in vector.values()), Fraction())))
            column[list(vector)] = xp.array(list(vector.values())) / length
        return np.asarray(columns)

    def to_axes(self, vectors: Values) -> Values:
        """Return vectors (N, m, …) along the directions that move by their components along the
        principal axes, (N, n, …).
        """
        return np.asarray(np.moveaxis(np.tensordot(self.directions, vectors, (1, 1)), 0, 1))

    def frames(self, attitude: Attitude) -> Values:
        """Return the frames (N, n, n) of an attitude along the directions that move."""
        n = self.moving.n
        result = np.empty((len(attitude.q), n, n), dtype=object)
        result[:, :, 0] = self.to_axes(attitude.q)
        result[:, :, 1:] = self.to_axes(attitude.normals @ self.rotation)
        if self.moving.frozen:  # what stays of e_2 … e_n
            D = self.directions
            result[:, :, 1:] += self.start - D @ (D.T @ self.start)
        return result

    @cached_property
    def start(self) -> Values:
        """Return e_2 … e_n at the start, (n, n−1): normals and resting directions exactly, other
        columns made orthonormal.
        """
        xp, D, n = self.arithmetic, self.directions, self.moving.n
        natural, across = self._natural
        columns = np.empty((n, n - 1), dtype=object)
        for j, (k, sign) in natural.items():
            columns[:, j] = sign * (D @ self.normals[:, k])
        rest = [j for j in range(n - 1) if j not in natural]
        if not rest:
            return columns
        known = np.column_stack([D @ self.q, columns[:, list(natural)]])
        exact = self.problem.exact.frame
        rows = np.asarray(self.problem.frame if exact is None else exact, dtype=object)
        given = xp.array(rows[:, [j + 1 for j in rest]])
        for place, j in enumerate(rest):
            if j in across:
                given[across[j], place] = xp.number(0)
                given[:, place] -= D @ (D.T @ given[:, place])
        given = given - known @ (known.T @ given)
        columns[:, rest] = orthonormal(np.column_stack([known, given]), xp)[:, known.shape[1] :]
        return columns

    @cached_property
    def _natural(self) -> tuple[dict[int, tuple[int, int]], dict[int, NDArray[np.intp]]]:
        """Return which columns of a natural frame are normals but for signs, column j normal k
        times its sign; and which rest within the axes of one A, eigenvectors of A⁻¹ that the motion
        never feels, and the other axes.
        """
        normals: dict[int, tuple[int, int]] = {}
        across: dict[int, NDArray[np.intp]] = {}
        if not self.problem.exact.natural:
            return normals, across
        values, columns = self.problem.exact.A, self.problem.frame[:, 1:].T
        directions = self.moving.directions @ self.normals.astype(float)
        for j, column in enumerate(columns):
            along = column @ directions
            signs = np.rint(along)
            (places,) = np.nonzero(signs)
            if np.max(np.abs(along - signs), initial=0) >= _NEARLY_NATURAL or places.size > 1:
                continue
            if places.size:
                normals[j] = int(places[0]), int(signs[places[0]])
                continue
            value = values[int(np.argmax(np.abs(column)))]
            others = np.flatnonzero([a != value for a in values])
            if np.max(np.abs(column[others]), initial=0) < _NEARLY_NATURAL:
                across[j] = others
        return normals, across

    @cached_property
    def rotation(self) -> Values:
        """Return the constant ℜ of (orth, printed 7.6), (g, n−1)."""
        xp, (natural, across) = self.arithmetic, self._natural
        result = xp.array(np.zeros((self.normals.shape[1], self.moving.n - 1)))
        for j in range(self.moving.n - 1):
            if j in natural:
                k, sign = natural[j]
                result[k, j] = xp.number(sign)
            elif j not in across:
                result[:, j] = self.normals.T @ (self.directions.T @ self.start[:, j])
        return np.asarray(result)

    def sensitivity(self, constants: Values) -> float:
        """Return a bound of how far this frame turns where A⁻¹ on q⊥ less q'q'ᵀ and q are moved by
        a unit, from its eigenvalues (g,), c_1 first.

        A natural column is an eigenvector, and turns by at most 2√2 over the distance of its
        eigenvalue (Davis, Kahan; Yu, Wang, Samworth). Columns that are given are projected along
        the others, and made orthonormal, which at most doubles what that makes of them.
        """
        g, n = len(constants), self.moving.n
        normals = [(k + 1) % g for k, _ in self._natural[0].values()]  # c_2 … c_g, c_1
        pairs = [(k, i) for k in normals for i in range(g) if i != k]
        inverse = sum(float(1 / abs(constants[i] - constants[k])) for i, k in pairs)
        return 8 * n * (n + 3 * g * (1 + inverse))


def frame_around(q: Values, rows: Any, arithmetic: Any) -> Values:
    """Return the frame with first column q, a unit vector, and the other columns of ``rows`` made
    exactly orthonormal.
    """
    normals = arithmetic.array(rows)[:, 1:]
    return orthonormal(np.column_stack([q, normals - np.outer(q, q @ normals)]), arithmetic)


def orthonormal(frame: Values, arithmetic: Any) -> Values:
    """Return the polar factor P of a nearly orthogonal X = PS, by Newton–Schulz steps E(3 − EᵀE)/2.

    For the E found, |E − P| ≤ |EᵀE − 1| + 2|EᵀX − XᵀE|, both zero for P itself (entries summed, S
    within a half of 1).
    """
    one = np.eye(frame.shape[0], dtype=int)
    nearly = arithmetic.midpoints(frame)
    for _ in range(3 + arithmetic.digits.bit_length()):
        nearly = arithmetic.midpoints(nearly @ (3 * one - nearly.T @ nearly) / 2)
    product = nearly.T @ frame
    bound = np.sum(np.abs(nearly.T @ nearly - one)) + 2 * np.sum(np.abs(product - product.T))
    return np.asarray(arithmetic.add_error(nearly, bound))
