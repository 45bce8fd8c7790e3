"""The attitude in ball arithmetic: from angles or phases along the directions that move, to the
frame of the body, e_1 … e_n along the principal axes, and the series of a trajectory.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.balls import Values
from veselova.analytic.closed.base import Attitude
from veselova.analytic.curve.branch_points import zeros_of_position
from veselova.analytic.curve.hyperelliptic import functions_of_attitude
from veselova.analytic.curve.moving_part import Moving, moving_part
from veselova.analytic.digits.torus import TorusInBalls
from veselova.analytic.theta.siegel_terms import ThetaInBalls
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.systems.torus_problem import TorusProblem

__all__ = [
    "BodyFrame",
    "ThetaQuotients",
    "frame_around",
    "resting_series",
    "series_of",
    "to_all_directions",
]

#: Derived: a column of the natural frame in double precision this near to a normal, or to a
#: direction that rests, is that one. Beyond, constants of motion are so close together that the
#: frame in double precision is taken for a given one.
_NEARLY_NATURAL = 1e-9


@dataclass(frozen=True)
class ThetaQuotients:
    """The attitude of one torus as theta quotients with one common denominator; agrees with the
    frame after Abel–Jacobi inversion, and shares only κ with it.

        q_i = κ_i θ[η(I_i)]/θ,   v_k = (q', n_k) = κ_k θ[η(c_k)]/θ,
        (n_k)_i = κ_ik θ[η(I_i)+η(c_k)]/θ,   γ the case c_1 = 0.

    The constants κ come from half periods z = ½ν, where every λ_s is a branch point and the frame
    is exact: for each function the half period at which it is largest against its denominator.
    """

    theta: ThetaInBalls
    torus: TorusInBalls

    @cached_property
    def _functions(self) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
        """Return the ``functions_of_attitude``."""
        known = self.torus.numbers
        return functions_of_attitude(known.of_I.tolist(), known.of_c.tolist())

    def _raw(self, z: Values) -> Values:
        """Return θ[η]/θ in the order of the constants, shape (N, n + g + n·g)."""
        functions, places = self._functions
        values = self.theta.values(z, functions)
        return np.asarray((values / values[:, :1])[:, places])

    @cached_property
    def constants(self) -> Values:
        """Return the κ's in the order of the functions."""
        xp, g = self.torus.arithmetic, self.theta.genus
        # ν ∈ {0, 1}^g, (2^g, g)
        half_periods = xp.array(np.arange(2**g)[:, None] >> np.arange(g)[::-1] & 1)
        attitude = self.torus.attitude(xp.pi * half_periods)
        exact = np.concatenate(
            [attitude.q, attitude.components, attitude.normals.reshape(len(half_periods), -1)],
            axis=1,
        )
        raw = self._raw(half_periods / 2)
        best = np.argmax(np.abs(raw.astype(float)), axis=0)
        columns = np.arange(raw.shape[1])
        return np.asarray(exact[best, columns] / raw[best, columns])

    def root_of_qAq(self, z: Values) -> Values:
        """Return |θ[η(0)]/θ| at points z of shape (N, g), where c_1 = 0: it is √(q,Aq) but for a
        constant, and never zero.

        For (q,Aq) = Π λ_s/Π I_i, and Π_s (λ_s − b) is a constant times (θ[η(b)]/θ)² at every branch
        point b.
        """
        functions, places = self._functions
        values = self.theta.values(z, functions[[0, places[2 * self.theta.genus]]])
        return np.asarray(np.abs(values[:, 1] / values[:, 0]))

    def at(self, z: Values) -> Attitude:
        """Return the attitude at points z of shape (N, g), modulo 2; spheroconic coordinates are
        left to the caller (empty).
        """
        g = self.theta.genus
        q, components, normals = np.split(self._raw(z) * self.constants, [g + 1, 2 * g + 1], axis=1)
        return Attitude(q, normals.reshape(-1, g + 1, g), components, np.empty((len(z), 0)))


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
        return np.asarray(self.normals.T @ (self.directions.T @ self.start))

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


def to_all_directions(points: Values, frozen: tuple[Fraction, ...], arithmetic: Any) -> Values:
    """Return the λ's of all directions, (N, n−1), increasing, from those of the directions that
    move, (N, m−1).
    """
    resting = np.tile(arithmetic.array([1 / a for a in frozen]), (len(points), 1))
    coordinates = np.concatenate([points, resting], axis=1)
    order = np.argsort(coordinates.astype(float), axis=1, kind="stable")
    return np.asarray(np.take_along_axis(coordinates, order, axis=1))


def series_of(problem: TorusProblem, states: Mapping[str, Values]) -> Mapping[str, Values]:
    """Return the series of a problem by name, in the order of its outputs, from those along the
    principal axes: ``tau1`` (N,), ``q_dot`` (N, n) in the problem's own time, ``frame``,
    ``spheroconic`` (N, n−1), and of a rolling ball ``displacement`` (N, n−1).
    """
    series = dict(problem.complete(states))
    for name in problem.derived:
        series[name] = problem.derive(name, series)
    return {name: series[name] for name in problem.outputs}


def resting_series(problem: TorusProblem, count: int, arithmetic: Any) -> Mapping[str, Values]:
    """Return the series of a problem at rest, by name, at ``count`` times; raises Unsolved where no
    frame can be known.

    Neumann's point rests where q is an eigenvector of A: so are the others, and the natural frame
    is one of axes. A body rests anywhere, and its natural frame is known in double precision only.
    """
    xp, exact, moving = arithmetic, problem.exact, moving_part(problem)
    q = xp.array(exact.q)
    q = q / xp.sqrt(np.sum(q * q))
    if exact.frame is not None:
        frame = frame_around(q, exact.frame, xp)
    elif problem.time == "tau1":
        body = BodyFrame(problem, moving, xp.array([1]), xp.array(np.zeros((1, 0))), xp)
        frame = np.column_stack([q, body.start])
    else:
        raise Unsolved(
            "at-rest",
            "nothing moves, and a resting body's natural frame is known in double precision only; "
            "give a frame, or ask for 15 digits, not certified",
        )
    points = xp.array(np.zeros((1, 0)))
    if moving.size > 1:
        found = np.array(zeros_of_position([1 / a for a in moving.A], moving.q_squared))
        points = found[None] / xp.number(moving.unit)
    points = np.repeat(to_all_directions(points, moving.frozen, xp), count, axis=0)
    zeros = xp.array(np.zeros((count, problem.n)))
    frames = np.repeat(frame[None], count, axis=0)
    states = {"tau1": zeros[:, 0], "q_dot": zeros, "frame": frames, "spheroconic": points}
    return series_of(problem, states)
