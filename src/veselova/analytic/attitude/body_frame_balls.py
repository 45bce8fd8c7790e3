"""The body's frame in ball arithmetic: from the normals along its moving directions to e_1 … e_n
along the principal axes.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.attitude.frame import Attitude
from veselova.analytic.attitude.frame_balls import directions, orthonormal, to_axes
from veselova.analytic.spectrum.moving_part import Moving
from veselova.mechanics.systems.torus_problem import TorusProblem

__all__ = ["BodyFrame"]

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
        return directions(self.moving, self.arithmetic)

    def to_axes(self, vectors: Values) -> Values:
        """Return vectors (N, m, …) along the directions that move by their components along the
        principal axes, (N, n, …).
        """
        return to_axes(self.moving, self.directions, vectors)

    def frames(self, attitude: Attitude) -> Values:
        """Return the frames (N, n, n) of an attitude along the directions that move."""
        n = self.moving.n
        result = np.empty((len(attitude.q), n, n), dtype=object)
        result[:, :, 0] = self.to_axes(attitude.q)
        result[:, :, 1:] = self.to_axes(attitude.normals @ self.rotation)
        if self.moving.frozen:
            result[:, :, 1:] += self.frozen_part
        return result

    @cached_property
    def frozen_part(self) -> Values:
        """Return what stays of e_2 … e_n, (n, n−1): their components along the directions that do
        not move.
        """
        if not self.moving.frozen:
            return np.asarray(self.arithmetic.array(np.zeros((self.moving.n, self.moving.n - 1))))
        return np.asarray(self.start - self.directions @ (self.directions.T @ self.start))

    @cached_property
    def start(self) -> Values:
        """Return e_2 … e_n at the start, (n, n−1): normals and resting directions exactly, other
        columns made orthonormal.
        """
        xp = self.arithmetic
        columns = np.empty((self.moving.n, self.moving.n - 1), dtype=object)
        for j, (k, sign) in self.exact.items():
            columns[:, j] = sign * (self.directions @ self.normals[:, k])
        rest = [j for j in range(self.moving.n - 1) if j not in self.exact]
        if not rest:
            return columns
        known = np.column_stack([self.directions @ self.q, columns[:, list(self.exact)]])
        given = xp.array(np.asarray(self._rows, dtype=object)[:, [j + 1 for j in rest]])
        for place, j in enumerate(rest):
            if j in self._resting:
                others = np.setdiff1d(np.arange(self.moving.n), self._resting[j])
                given[others, place] = xp.number(0)
                given[:, place] -= self.directions @ (self.directions.T @ given[:, place])
        given = given - known @ (known.T @ given)
        columns[:, rest] = orthonormal(np.column_stack([known, given]), xp)[:, known.shape[1] :]
        return columns

    @property
    def _rows(self) -> Any:
        return (
            self.problem.exact.frame if self.problem.exact.frame is not None else self.problem.frame
        )

    @cached_property
    def _along_normals(self) -> NDArray[np.float64]:
        """Return the columns of the natural frame in double precision along the
        normals, (g, n−1).
        """
        return np.asarray(
            self.normals.astype(float).T @ self.moving.directions.T @ self.problem.frame[:, 1:]
        )

    @cached_property
    def exact(self) -> dict[int, tuple[int, int]]:
        """Return which columns are normals but for signs: column j is normal k times its sign."""
        if not self.problem.exact.natural:
            return {}
        signs = np.rint(self._along_normals)
        found = {}
        for j in np.flatnonzero(
            np.max(np.abs(self._along_normals - signs), axis=0, initial=0) < _NEARLY_NATURAL
        ).tolist():
            (places,) = np.nonzero(signs[:, j])
            if places.size == 1:
                found[j] = int(places[0]), int(signs[places[0], j])
        return found

    @cached_property
    def _resting(self) -> dict[int, NDArray[np.intp]]:
        """Return which columns rest within the axes of one A, and these axes: eigenvectors of A⁻¹
        that the motion never feels.
        """
        if not self.problem.exact.natural:
            return {}
        values = self.problem.exact.A
        found = {}
        for j in np.flatnonzero(
            np.max(np.abs(self._along_normals), axis=0, initial=0) < _NEARLY_NATURAL
        ).tolist():
            column = self.problem.frame[:, j + 1]
            value = values[int(np.argmax(np.abs(column)))]
            within = np.array([a == value for a in values])
            if np.max(np.abs(column[~within]), initial=0) < _NEARLY_NATURAL:
                found[j] = np.flatnonzero(within)
        return found

    @cached_property
    def given(self) -> list[int]:
        """Return the columns that are taken as given."""
        return [
            j for j in range(self.moving.n - 1) if j not in self.exact and j not in self._resting
        ]

    @cached_property
    def rotation(self) -> Values:
        """Return the constant ℜ of (orth, printed 7.6), (g, n−1)."""
        xp = self.arithmetic
        result = xp.array(np.zeros((self.normals.shape[1], self.moving.n - 1)))
        for j, (k, sign) in self.exact.items():
            result[k, j] = xp.number(sign)
        if self.given:
            result[:, self.given] = self.normals.T @ (self.directions.T @ self.start[:, self.given])
        return np.asarray(result)

    def turn(self, matrix: Any, constants: Values, other: Values) -> Any:
        """Return a bound of how far this frame is from that of another start, as operators.

        matrix: how far A⁻¹ on q⊥ less q'q'ᵀ is moved, whose eigenvectors normals are · constants
        (g,): its eigenvalues, c_1 first · other (n,): the other start's q, along the principal
        axes. An eigenvector turns by at most 2√2 δT over the distance of its eigenvalue (Davis,
        Kahan; Yu, Wang, Samworth). Columns that are given are projected along the others, which are
        at most so far away, and made orthonormal, which at most doubles what that makes of them.
        """
        xp = self.arithmetic
        g = len(constants)
        result = xp.number(0)
        if self.exact:
            normals = {(k + 1) % g for k, _ in self.exact.values()}  # c_2 … c_g, c_1
            pairs = [pair for pair in itertools.combinations(range(g), 2) if normals & set(pair)]
            inverse = sum((1 / abs(constants[i] - constants[j]) for i, j in pairs), xp.number(1))
            result = matrix * (1 + 3 * g * inverse)
        if self.given:
            apart = np.sum(xp.upper_bound(other - self.directions @ self.q))
            result = 8 * self.moving.n * (result + apart)
        return result
