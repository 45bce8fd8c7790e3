"""What of a start moves, in exact rationals: frozen directions are dropped, equal A's turned,
coincidences opened.

A coordinate with q_i = q̇_i = 0 stays zero for ever (there c_k = λ_s = I_i: a closed cut). Inside a
group of equal A's the motion stays in the span of q and q̇ there: a turn of the axes leaves at most
two moving coordinates. What is left may still have coinciding branch points, I_i = I_{i+1} or c_k =
I_i or c_k = c_{k+1}; a start moved by far less than any digit asked for has none, and its motion is
the same to all of them (on a separatrix, for as long as the digits of the data last).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from flint import fmpq
from numpy.typing import NDArray

from veselova.mechanics.core.exact_input import to_float
from veselova.mechanics.systems.torus_problem import TorusProblem

__all__ = ["Moving", "moving_part", "rational", "rationals", "squared_rates"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Moving:
    """A start along its m moving directions, sorted by decreasing A; exact, with A in units of its
    smallest entry.

    - A: (m,)
    - q_squared, v_squared, qv: (m,) q_a², q̇_a², q_aq̇_a. Directions are chosen so that q_a ≥ 0,
      and q̇_a > 0 where q_a = 0
    - vectors: (m,) orthogonal vectors, of any length, as {principal axis: component}
    - n: the number of principal axes
    - axes: (m,) the principal axis of each, or the first of its group
    - unit: the A that counts as 1
    - frozen: the A's of the directions that do not move, in the problem's units
    - rotated: whether a group of equal A's has two moving directions
    - time: the time of the problem: t, s (arc length), or tau1, in which q̇ is q' itself and
      c_1 need not be zero
    """

    A: tuple[Fraction, ...]
    q_squared: tuple[Fraction, ...]
    v_squared: tuple[Fraction, ...]
    qv: tuple[Fraction, ...]
    vectors: tuple[Mapping[int, Fraction], ...]
    n: int
    axes: tuple[int, ...]
    unit: Fraction
    frozen: tuple[Fraction, ...]
    rotated: bool
    time: str

    @cached_property
    def directions(self) -> Array:
        """Return the orthonormal columns along the vectors, shape (n, m)."""
        directions = np.zeros((self.n, self.size))
        for column, vector in zip(directions.T, self.vectors, strict=True):
            column[list(vector)] = _unit(list(vector.values()))
        return directions

    @property
    def size(self) -> int:
        """Return m, the dimension of what moves: genus + 1."""
        return len(self.A)

    @cached_property
    def rate_variation(self) -> float:
        """Return by how much dt/dτ₁ may vary at most: it goes like the root of (q,Aq) for t, and
        like 1/(q,Aq) for s.
        """
        power = {"t": 0.5, "s": 1.0, "tau1": 0.0}[self.time]
        return math.exp(power * (math.log(self.A[0].numerator) - math.log(self.A[0].denominator)))

    def separate(self, distance: Fraction, closeness: Fraction) -> Moving:
        """Return the part with A's that are nearer than ``closeness``, relatively, separated by
        ``distance``.
        """
        A = list(self.A)
        for i in range(1, len(A)):
            # or above it, where the one before has just moved
            if A[i] > A[i - 1] * (1 - closeness):
                A[i] = A[i - 1] * (1 - distance)
        if tuple(A) == self.A:
            return self
        unit = A[-1]
        return replace(self, A=tuple(a / unit for a in A), unit=self.unit * unit)

    def hardly_moves(self, axis: int, share: Fraction) -> bool:
        """Return whether q_i and q̇_i are both below √share of |q| and |q̇|, or of |q|√I where q̇
        is Neumann's and may vanish.
        """
        q_total, v_total = sum(self.q_squared, Fraction()), sum(self.v_squared, Fraction())
        v_total += q_total / self.unit if self.time == "tau1" else 0
        return self.q_squared[axis] < share * q_total and self.v_squared[axis] < share * v_total

    def _with(self, axis: int, **numbers: Any) -> Moving:
        """Return the part with other numbers, by the names of fields, of one direction."""
        rows = {name: list(getattr(self, name)) for name in numbers}
        for name, number in numbers.items():
            rows[name][axis] = number
        changed: dict[str, Any] = {name: tuple(row) for name, row in rows.items()}
        return replace(self, **changed)

    def lift_axis(self, axis: int, distance: Fraction) -> Moving:
        """Return the part with q_i at ``distance``·|q|, where it hardly is."""
        square = distance**2 * sum(self.q_squared, Fraction())
        return self._with(axis, q_squared=square, v_squared=Fraction(), qv=Fraction())

    def without(self, axis: int) -> Moving:
        """Return the part without a direction that moves less than any digit shows."""
        names = "A", "q_squared", "v_squared", "qv", "vectors", "axes"
        rows = {name: list(getattr(self, name)) for name in names}
        frozen = rows["A"][axis] * self.unit
        for row in rows.values():
            del row[axis]
        unit = rows["A"][-1]
        rows["A"] = [a / unit for a in rows["A"]]
        kept: dict[str, Any] = {name: tuple(row) for name, row in rows.items()}
        return replace(self, unit=self.unit * unit, frozen=(*self.frozen, frozen), **kept)

    def perturb(self, axis: int, distance: Fraction) -> Moving:
        """Return the part with q_i scaled by 1 + ``distance``, or moved by ``distance``·q̇_i/|q̇|
        where it is smaller than that.

        Alone on its axis, q is a unit vector whatever its scale. There a component of q̇ is scaled
        in its place, and all of q̇ where it is Neumann's q'.
        """
        square, product, speed = self.q_squared[axis], self.qv[axis], self.v_squared[axis]
        total, scale = sum(self.q_squared, Fraction()), 1 + distance
        if square >= distance**2 * total:
            if self.time == "tau1":
                v_squared = tuple(v * scale**2 for v in self.v_squared)
                return replace(self, v_squared=v_squared, qv=tuple(x * scale for x in self.qv))
            if square == total:
                other = next(i for i in range(self.size) if i != axis)
                return self._with(other, v_squared=self.v_squared[other] * scale**2)
            return self._with(axis, q_squared=square * scale**2, qv=product * scale)
        s = distance / _near_root(sum(self.v_squared, Fraction()))
        moved = square + 2 * s * product + s * s * speed
        found = self._with(axis, q_squared=moved, qv=product + s * speed)
        if square + s * product >= 0:
            return found
        # q_i keeps its sign by the choice of the direction
        return found._with(axis, vectors={i: -x for i, x in self.vectors[axis].items()})


def moving_part(problem: TorusProblem) -> Moving:
    """Return what moves of a problem that moves: at least two directions, and no more than two for
    any value of A.
    """
    exact = problem.exact
    groups: dict[Fraction, list[int]] = {}
    for i, a in enumerate(exact.A):
        groups.setdefault(a, []).append(i)
    selected: list[tuple[Any, ...]] = []
    frozen: list[Fraction] = []
    for a in sorted(groups, reverse=True):
        axes = groups[a]
        rotated = _rotate_group([exact.q[i] for i in axes], [exact.tangent[i] for i in axes])
        frozen += [a] * (len(axes) - len(rotated))
        for squares, vector in rotated:
            selected.append((a, *squares, dict(zip(axes, vector, strict=True)), axes[0]))
    A, q_squared, v_squared, qv, vectors, first = zip(*selected, strict=True)
    return Moving(
        A=tuple(a / A[-1] for a in A),
        q_squared=q_squared,
        v_squared=v_squared,
        qv=qv,
        vectors=vectors,
        n=problem.n,
        axes=first,
        unit=A[-1],
        frozen=tuple(frozen),
        rotated=len(set(A)) < len(A),
        time=problem.time,
    )


def squared_rates(moving: Moving) -> tuple[Any, Any]:
    """Return (dτ₁/dt)² of the velocity q̇, so that q' = q̇ over its root, and the square of
    dτ₁/d(time), exact, as FLINT's rationals.

    With w the part of q̇ that is A-orthogonal to q, (dτ₁/dt)² = (w,Aw); along a geodesic, whose
    tangent is along Aw, (dτ₁/ds)² = J(q,Aq)² with J of Joachimsthal is (w,Aw)(q,Aq)/(Aw,Aw) for |q|
    = 1.
    """
    unit = rational(moving.unit)
    if moving.time == "tau1":
        return 1 / unit, 1 / unit
    A, q2, v2, qv = (
        rationals(x) for x in (moving.A, moving.q_squared, moving.v_squared, moving.qv)
    )
    qAq, vAv, qAv = (_dot(A, values) for values in (q2, v2, qv))
    speed = vAv - qAv * qAv / qAq
    if moving.time != "s":
        return speed, speed
    share = qAv / qAq  # w = q̇ − share·q
    squares = [v - 2 * share * x + share * share * q for q, v, x in zip(q2, v2, qv, strict=True)]
    return speed, speed * qAq / (sum(q2) * _dot([a * a for a in A], squares) * unit)


def rational(x: Any) -> Any:
    """Return a fraction as FLINT's."""
    return x if isinstance(x, fmpq) else fmpq(x.numerator, x.denominator)


def rationals(values: Sequence[Any]) -> list[Any]:
    """Return fractions as FLINT's."""
    return [rational(x) for x in values]


def _rotate_group(
    q: Sequence[Fraction], velocity: Sequence[Fraction]
) -> list[tuple[tuple[Fraction, Fraction, Fraction], Sequence[Fraction]]]:
    """Return (q², q̇², qq̇) and a vector along each moving direction of one group: q first, then q̇
    across it.
    """
    if len(q) == 1 and q[0]:
        return [((q[0] * q[0], velocity[0] * velocity[0], q[0] * velocity[0]), q)]
    qq = _dot(q, q)
    qv = _dot(q, velocity)
    vv = _dot(velocity, velocity)
    zero = Fraction()
    if qq == 0:
        return [((zero, vv, zero), velocity)] if vv else []
    rotated: list[tuple[tuple[Fraction, Fraction, Fraction], Sequence[Fraction]]] = [
        ((qq, qv * qv / qq, qv), q)
    ]
    if vv * qq != qv * qv:
        rotated.append(
            (
                (zero, vv - qv * qv / qq, zero),
                [qq * d - qv * x for x, d in zip(q, velocity, strict=True)],
            )
        )
    return rotated


def _dot(a: Sequence[Any], b: Sequence[Any]) -> Any:
    return sum((x * y for x, y in zip(a, b, strict=True) if x and y), 0 * a[0])


def _unit(vector: Sequence[Fraction]) -> Array:
    if len(vector) == 1:
        return np.array([1.0 if vector[0] > 0 else -1.0])
    largest = max(abs(x) for x in vector)
    scaled = to_float([x / largest for x in vector])
    return np.asarray(scaled / np.linalg.norm(scaled))


def _near_root(value: Fraction) -> Fraction:
    """Return a power of two within a factor of two of √value."""
    bits = (value.numerator.bit_length() - value.denominator.bit_length()) // 2
    return Fraction(2) ** bits
