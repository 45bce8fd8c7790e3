"""An interval on which λ_s moves that ends in a plane where V is −∞: λ_s runs into it with R > 0,
in finite time.

In the series of its angle λ_s turns back there, as a ball at a wall: the angle then has period 2π
as on a cut between two roots, and the motion before the collision is the first part of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.curve.elliptic_angle import FourPoints

__all__ = ["OpenInterval"]

Array = NDArray[np.float64]

#: Derived: the distance from a plane that counts as none, in widths: with it quotients of roots of
#: zero are numbers.
_LEAST = 1e-40


@dataclass(frozen=True)
class OpenInterval:
    """The interval [a, b] on which λ_s moves, of which one end or both lie in an attracting plane.

    Its angle θ runs from 0 at a to π at b, in proportion to the elliptic angle of four points
    around it: its ends where λ_s turns, and beyond a plane the next real root of R, or a point at
    the distance of a width where that is nearer.

    - ends: a and b, exact
    - lower, width: a and b−a
    - planes: whether a and b lie in planes
    - points: the four points
    - margins: a−p_1 and p_2−b for the inner two of them, zero at turning points
    - left: (…) a−r of the real roots r ≤ a but a turning point
    - right: (…) r−b of those r ≥ b
    - rest_left, rest_right: those of them that are none of the four points
    - extra_left, extra_right: a−p and p−b of the points p that are no roots
    - pairs: (…, 2) a−Re r, Im r of complex ones
    - leading: |leading coefficient of R|
    - below, above: λ_s−a and b−λ_s at the start
    - axes: the numbers of the I's that are turning points a and b, None where an end is none
    """

    ends: tuple[Fraction, Fraction]
    planes: tuple[bool, bool]
    lower: float
    width: float
    points: FourPoints
    margins: tuple[float, float]
    left: Array
    right: Array
    rest_left: Array
    rest_right: Array
    extra_left: Array
    extra_right: Array
    pairs: Array
    leading: float
    below: float
    above: float
    axes: tuple[int | None, int | None]

    @classmethod
    def of(
        cls,
        ends: tuple[Fraction, Fraction],
        planes: tuple[bool, bool],
        point: Fraction,
        real: Sequence[Fraction],
        pairs: Sequence[tuple[Fraction, Fraction]],
        leading: float,
        axes: tuple[int | None, int | None],
    ) -> OpenInterval:
        """Return the interval of a start from the roots of R, the real ones increasing."""
        lower, upper = ends
        width = upper - lower
        roots_below = [lower - x for x in reversed(real) if x <= lower]
        roots_above = [x - upper for x in real if x >= upper]
        below = _nearest(roots_below, width, planes[0])
        above = _nearest(roots_above, width, planes[1])
        if len(below) == 1:  # one of both outer points has to be finite
            below.append(below[0] + width)
        span = below[0] + width + above[0]
        outer = float(above[1] - above[0]) if len(above) == 2 else None
        left, right = roots_below[not planes[0] :], roots_above[not planes[1] :]
        return cls(
            ends,
            planes,
            float(lower),
            float(width),
            FourPoints(DOUBLE, float(below[1] - below[0]), float(span), outer),
            (float(below[0]), float(above[0])),
            _floats(left),
            _floats(right),
            _floats(_without(roots_below, below)),
            _floats(_without(roots_above, above)),
            _floats(_without(below, roots_below)),
            _floats(_without(above, roots_above)),
            np.array([(float(lower - x), float(y)) for x, y in pairs]).reshape(-1, 2),
            leading,
            float(point - lower),
            float(upper - point),
            axes,
        )

    @cached_property
    def _range(self) -> tuple[float, float]:
        """Return the elliptic angles of a and b."""
        before, after = self.margins
        angle = self.points.angle
        return (
            float(angle(before, self.width + after, True)),
            float(angle(before + self.width, after, True)),
        )

    @property
    def _angle_ratio(self) -> float:
        """Return dθ/dψ."""
        first, last = self._range
        return float(np.pi / (last - first))

    def start_angle(self, increasing: bool) -> float:
        """Return θ in (−π, π] at the start, negative where λ_s decreases."""
        before, after = self.margins
        psi = float(self.points.angle(before + self.below, self.above + after, True))
        theta = min(max((psi - self._range[0]) * self._angle_ratio, 0.0), float(np.pi))
        return theta if increasing else -theta

    def arrivals(self, theta: float) -> tuple[float, float]:
        """Return the angles of the planes into which λ_s runs from there, backwards and forwards
        in time.
        """
        turns = int(self.planes[0]) + int(self.planes[1])
        first = 0.0 if self.planes[0] else float(np.pi)
        step = 2 * float(np.pi) / turns
        count = np.floor((theta - first) / step)
        return float(first + count * step), float(first + (count + 1) * step)

    def _elliptic(self, theta: Array) -> Array:
        """Return the elliptic angle at angles θ, which λ_s passes forth and back."""
        folded = np.abs(theta - 2 * np.pi * np.rint(theta / (2 * np.pi)))
        return np.asarray(self._range[0] + folded / self._angle_ratio)

    def point(self, theta: Array) -> tuple[Array, Array]:
        """Return λ−a and b−λ at angles θ."""
        below, above = (np.abs(root) for root in self.points.roots(self._elliptic(theta)))
        least = _LEAST * self.width
        return (
            np.maximum(below * below - self.margins[0], least if self.planes[0] else 0.0),
            np.maximum(above * above - self.margins[1], least if self.planes[1] else 0.0),
        )

    def roots(self, theta: Array) -> tuple[Array, Array]:
        """Return √(λ−a) and √(b−λ), with the signs of sin θ/2 and cos θ/2."""
        below, above = self.point(theta)
        lower, upper = self._signs(theta)
        return lower * np.sqrt(below), upper * np.sqrt(above)

    def _signs(self, theta: Array) -> tuple[Array, Array]:
        half = theta / (2 * np.pi)
        return 1.0 - 2 * (np.floor(half) % 2), 1.0 - 2 * (np.floor(half + 0.5) % 2)

    def outer_root(self, theta: Array) -> Array:
        """Return √R over the roots of the ends where λ_s turns, at angles θ."""
        return self._root_of(theta, self.left, self.right)

    def _root_of(self, theta: Array, left: Array, right: Array) -> Array:
        below, above = (x[..., None] for x in self.point(theta))
        real = np.prod(np.sqrt(below + left), axis=-1) * np.prod(np.sqrt(above + right), axis=-1)
        complex_ones = np.prod(np.hypot(below + self.pairs[:, 0], self.pairs[:, 1]), axis=-1)
        return np.asarray(np.sqrt(self.leading) * real * complex_ones)

    def moving_root(self, theta: Array) -> Array:
        """Return √R with the sign of λ_s', over the roots of the ends that are I's, at angles θ."""
        result = self.outer_root(theta)
        ends = zip(self.roots(theta), self._signs(theta), self.planes, self.axes, strict=True)
        for root, sign, plane, axis in ends:
            if axis is None:
                result = result * (sign if plane else root)
        return result

    def speed(self, theta: Array) -> Array:
        """Return √R dθ/dλ at angles θ."""
        below, above = (x[..., None] for x in self.point(theta))
        extra = np.prod(np.sqrt(below + self.extra_left), axis=-1)
        extra = extra * np.prod(np.sqrt(above + self.extra_right), axis=-1)
        rest = self._root_of(theta, self.rest_left, self.rest_right)
        return np.asarray(self._angle_ratio * rest / extra / (2 * self.points.density))


def _nearest(distances: Sequence[Fraction], width: Fraction, plane: bool) -> list[Fraction]:
    """Return the distances of the one or two points on one side: the nearest roots, or a width
    beyond a plane.
    """
    points = list(distances[:2])
    if plane and not (points and points[0] <= width):
        points = [width, *points[:1]]
    return points


def _without(values: Sequence[Fraction], others: Sequence[Fraction]) -> list[Fraction]:
    """Return the values that are none of the others, each of which takes one away."""
    rest = list(values)
    for x in others:
        if x in rest:
            rest.remove(x)
    return rest


def _floats(values: Sequence[Fraction]) -> Array:
    return np.array([float(x) for x in values])
