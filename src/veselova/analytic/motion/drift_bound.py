"""How far the motion of a start that was moved may be from that of the start itself: a bound, for
certified answers.

Both are motions of Neumann's system (Theorem LR→Nn), q'' = (β−a)q with a = A⁻¹, β = 2(aq,q) − E and
E = (q',q') + (aq,q) constant. For u = q₀−q₁ and w = u', with |a₀−a₁| ≤ δ and (q₀+q₁, u) = 0,

    |w'| ≤ M|u| + f,   M = max|β−a_i| + 2(max a − min a),   f = 3δ + |E₀−E₁|,

so |u| ≤ D, |w| ≤ μD with D = (|u(0)| + |w(0)|/μ + f/M) e^{μ|τ₁|}, μ = √M. The frame turns with E' =
(q'qᵀ − qq'ᵀ)E, skew: two frames part by at most ∫2(|w| + |q'||u|). Time maps part by ∫|ρ₀−ρ₁|, ρ =
d(time)/dτ₁ (see _Rates), and every series by what it moves in that time. F_0 may have any value:
only E enters. Coarse numbers are doubles, rounded up by far more than they are rounded.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.closed.departure import UP, bend_and_level
from veselova.analytic.spectrum.branch_points import Spectrum, tangent
from veselova.analytic.spectrum.moving_part import Moving
from veselova.analytic.time_map.rate import TIME_RATE_POWERS

__all__ = ["PerturbationBound", "estimate_growth"]

#: Derived: digits in which starts are compared, in digits of the arithmetic and besides: they
#: differ by 10^(−2·digits−20) or less.
_TIMES = 6
_BESIDE = 120


@dataclass(frozen=True)
class PerturbationBound:
    """The bounds for one start, in units where the largest I of the moved one is 1; small numbers
    are balls, others doubles.

    - apart: |u(0)| + |w(0)|/μ + f/M
    - matrix: δT, how far A⁻¹ on q⊥ less q'q'ᵀ is moved, whose eigenvectors natural frames are
    - frames: how far the frames are from each other at t = 0
    - growth: μ
    - speed: a bound of |q'|
    - bend: one of |q''|
    - time_maps, time_slope: |ρ₀−ρ₁| ≤ time_maps + time_slope·|u|
    - slowest: the least d(time)/dτ₁
    - inverses: δ
    - highest: max a
    """

    apart: Any
    matrix: Any
    frames: Any
    growth: float
    speed: float
    bend: float
    time_maps: Any
    time_slope: float
    slowest: float
    inverses: Any
    highest: float

    @classmethod
    def of(cls, given: Moving, moved: Moving, arithmetic: Any) -> PerturbationBound:
        """Return the bounds for a start and the one that it was moved to, frames set aside."""
        with arithmetic.at(_TIMES * arithmetic.digits + _BESIDE) as xp:
            unit = xp.sqrt(xp.number(moved.unit / given.unit))
            q0, p0, rate0 = tangent(given, xp)
            p0 = p0 * unit
            rate0 = rate0 / unit
            a0 = xp.array([moved.unit / (a * given.unit) for a in given.A])
            q1, p1, rate1 = tangent(moved, xp)
            places, signs = _match_directions(given, moved)
            a1, (q1, p1) = a0.copy(), (_spread(x * signs, places, len(q0)) for x in (q1, p1))
            a1[places] = xp.array([1 / a for a in moved.A])
            energies = [
                np.sum(p * p) + np.sum(a * q * q) for a, q, p in ((a0, q0, p0), (a1, q1, p1))
            ]
            values = [np.sum(q * q / a) for a, q in ((a0, q0), (a1, q1))]
            rates = _Rates.of(given.time, [rate0, rate1], values, xp)
            u, w, inverses, A = (_norm(x, xp) for x in (q0 - q1, p0 - p1, a0 - a1, 1 / a0 - 1 / a1))
            low, high = _range([*a0, *a1])
            least, most = _range(energies)
            speed, (bend, level) = (
                math.sqrt(most - low) * UP,
                bend_and_level(low, high, least, most),
            )
            growth = math.sqrt(level) * UP
            force = 3 * inverses + abs(energies[0] - energies[1])
            # (q,Aq) is moved by |A₀−A₁| + 2 max A |u|.
            steepest = rates.steepest(low, high)
            bounds = {
                "apart": u + w / growth + force / (level / UP**2),
                "matrix": inverses + (4 * high + 2) * UP * u + 2 * speed * w,
                "time_maps": rates.apart * rates.largest_power(low, high) + steepest * A,
                "inverses": inverses,
            }
            small = {name: xp.upper_bound(value).item() for name, value in bounds.items()}
        coarse = {
            "growth": growth,
            "speed": speed,
            "bend": bend,
            "slowest": rates.slowest(low, high),
            "highest": high,
        }
        return cls(
            frames=arithmetic.number(0),
            time_slope=2 * steepest / low * UP,
            **coarse,
            **small,
        )

    def bounds(self, tau1: Values, xp: Any) -> tuple[Values, Values, Values, Values]:
        """Return how far τ₁, q̇, the frame (as an operator, so each entry) and the λ's may be from
        those at Neumann times (N,) of the moved start, at the same times of the time map, each
        (N,).
        """
        steps = xp.upper_bound(np.abs(tau1))
        apart = self.apart * xp.exp(self.growth * steps)
        late = (steps * self.time_maps + self.time_slope * apart / self.growth) / self.slowest
        rotated = self.frames + 2 * (1 + self.speed / self.growth) * apart + self.speed * late
        slope = (self.time_maps + self.time_slope * rotated) / self.slowest / self.slowest
        velocity = (self.growth * apart + self.bend * late) / self.slowest + self.speed * slope
        return late, velocity, rotated, 4 * self.highest * rotated + self.inverses


@dataclass(frozen=True)
class _Rates:
    """ρ = d(time)/dτ₁ = k (q,Aq)^p of both motions: p = 1/2 for t, −1 for arc length s, and 0 for
    τ₁ itself. With a in [low, high], (q,Aq) lies between 1/high and 1/low.

    - power: p
    - apart: |k₀−k₁|, a ball
    - least, most: doubles below and above both k
    """

    power: float
    apart: Any
    least: float
    most: float

    @classmethod
    def of(cls, time: str, rates: list[Any], values: list[Any], xp: Any) -> _Rates:
        """Return the rates of motions with dτ₁/d(time) and (q,Aq) at the start."""
        powers = {"t": xp.sqrt, "s": lambda x: 1 / x, "tau1": lambda x: xp.number(1)}
        constants = [
            1 / (rate * powers[time](value)) for rate, value in zip(rates, values, strict=True)
        ]
        return cls(TIME_RATE_POWERS[time] / 2, abs(constants[0] - constants[1]), *_range(constants))

    def largest_power(self, low: float, high: float) -> float:
        """Return a bound of (q,Aq)^p."""
        return float((1 / low if self.power > 0 else 1 / high) ** self.power) * UP

    def slowest(self, low: float, high: float) -> float:
        """Return a number below ρ."""
        return self.least * float((1 / high if self.power > 0 else 1 / low) ** self.power) / UP

    def steepest(self, low: float, high: float) -> float:
        """Return a bound of |dρ/d(q,Aq)| = |kp| (q,Aq)^(p−1), which is largest where (q,Aq) is
        least: p < 1.
        """
        return self.most * abs(self.power) * float(high ** (1 - self.power)) * UP


def estimate_growth(spectrum: Spectrum, tau1: float) -> int:
    """Return the digits by which two motions part until a Neumann time, by the bound above."""
    inverse, q, p = (x.astype(float) for x in (spectrum.inverse, spectrum.q, spectrum.q_prime))
    low = float(inverse[0])
    energy = float(np.sum(p * p) + np.sum(inverse * q * q))
    _, level = bend_and_level(low, 1.0, energy, energy)
    return math.ceil(math.sqrt(level) * abs(tau1) / math.log(10))


def _match_directions(given: Moving, moved: Moving) -> tuple[list[int], Values]:
    """Return where the directions that are left were among the given ones, and the signs of those
    that were turned round.
    """
    places = []
    signs = []
    for vector in moved.vectors:
        for place, before in enumerate(given.vectors):
            if vector == before or vector == {axis: -x for axis, x in before.items()}:
                places.append(place)
                signs.append(1 if vector == before else -1)
    return places, np.array(signs, dtype=object)


def _spread(values: Values, places: list[int], size: int) -> Values:
    result = np.array([0 * values[0]] * size, dtype=object)
    result[places] = values
    return result


def _norm(vector: Values, xp: Any) -> Any:
    return xp.sqrt(np.sum(vector * vector))


def _range(numbers: list[Any]) -> tuple[float, float]:
    """Return doubles below and above all numbers, which are positive."""
    return min(float(x.lower()) for x in numbers) / UP, max(float(x.upper()) for x in numbers) * UP
