"""The start in doubles of what moves: by the kernel from data that are doubles, else from exact
branch points, those of a start moved by far less than any digit where they coincide or are too near
one another; and how far the two may part.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from flint import arb
from numpy.typing import NDArray

from veselova.analytic.arithmetic.balls import Balls
from veselova.analytic.curve.branch_points import Spectrum, resolve_spectrum, spectrum
from veselova.analytic.curve.kernel_text import text_over
from veselova.analytic.curve.moving_part import Moving, rational
from veselova.analytic.kernel.start import Start, begin, is_wide, make_start
from veselova.mechanics.core.arguments import FEWEST_DIGITS
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.systems.torus_problem import TorusProblem

__all__ = [
    "MovingStart",
    "departure",
    "exact_start",
    "flow_of",
    "log_drift",
    "scale_of",
    "start_of",
    "start_of_doubles",
]

Array = NDArray[np.float64]

#: Derived: digits after which starts are moved, the first that leaves no cut or gap narrower than
#: ``NARROWEST`` of ``kernel.start``: they open by this or by its square.
_DIGITS = (120, 60)

#: Derived: digits that every difference of neighbours has of its own, and those of zeros at most.
_OWN, _MOST_DIGITS = 27, 4000

#: Derived: equal A's differ by the first then: theta functions lose few digits; no others
#: are nearer than the second.
_SEPARATED, _EQUAL = Fraction(1, 10**40), Fraction(1, 10**1000)

#: Derived: how far frames part for starts that are as far apart, and A's of ratio one, with all
#: factors of ``log_drift``.
_FACTOR = 1e3

#: Derived: how far data are moved where coincidences are opened, for each direction that moves.
_STARTS = 10.0

#: Derived: more than what a dozen operations in double precision round.
_UP = 1 + 1e-12


class MovingStart(NamedTuple):
    """A start in doubles and the directions along which it moves, of ``Moving``.

    - moved: by how much, where that is on a separatrix, else zero
    - spectrum: None where the start was found in doubles
    """

    start: Start
    directions: Array
    axes: tuple[int, ...]
    unit: Fraction
    frozen: tuple[Fraction, ...] = ()
    rotated: bool = False
    moved: Fraction = Fraction(0)
    spectrum: Spectrum | None = None

    @property
    def size(self) -> int:
        """Return m, the dimension of what moves: genus + 1."""
        return len(self.axes)


def start_of_doubles(problem: TorusProblem) -> MovingStart | None:
    """Return the start of data that are doubles, all of them moving, None for others and where
    branch points are near one another.
    """
    exact, n = problem.exact, len(problem.exact.A)
    if problem.time != "t" or problem.axes is not None:
        return None
    numbers = (*exact.A, *exact.q, *exact.q_dot)
    doubles: list[float] = np.array(numbers, dtype=np.float64).tolist()
    ratios = map(Fraction.as_integer_ratio, numbers)
    if list(map(float.as_integer_ratio, doubles)) != list(ratios) or len(set(doubles[:n])) < n:
        return None
    A, q, v = np.array(doubles).reshape(3, n)
    signs, order, start = np.where(q < 0, -1.0, 1.0), np.zeros(n, np.int64), make_start(n)
    if not begin(A, q * signs, v * signs, order, start):
        return None
    if not is_wide(start.d, start.points, start.on_cuts, start.rate):
        return None
    directions = np.zeros((n, n))
    directions[order, np.arange(n)] = signs[order]
    axes = tuple(order.tolist())
    return MovingStart(start, directions, axes, exact.A[axes[-1]])


def exact_start(moving: Moving) -> MovingStart:
    """Return the start of what moves, moved where branch points coincide or are too near one
    another for doubles. Raises Unsolved as ``resolve_spectrum``.
    """
    moving = moving.separate(_SEPARATED, _EQUAL)
    for digits in _DIGITS:
        beyond, coincide = digits - 2 * FEWEST_DIGITS - 10, 2 * digits + 20
        found = resolve_spectrum(moving, FEWEST_DIGITS, beyond=beyond, coincide=coincide)
        known = found.spectrum
        if not known.is_known(_OWN):
            known = spectrum(found.moving, _OWN // 2, _MOST_DIGITS)
        start = _in_doubles(start_of(known))
        if known.is_known(_OWN) and is_wide(start.d, start.points, start.on_cuts, start.rate):
            moved = Fraction(1, 10**digits) if found.separatrices else Fraction(0)
            part = found.moving
            along = part.directions, part.axes, part.unit, part.frozen, part.rotated
            return MovingStart(start, *along, moved, known)
    raise Unsolved("beyond-floats", "branch points are too near one another, or |q'| is too large")


def start_of(found: Spectrum) -> Start:
    """Return the start of a spectrum, in its balls."""
    points = np.array(found.points)
    place = {(kind, index): j for j, (_, kind, index) in enumerate(found.branch_points)}
    with found.arithmetic:
        return Start(
            points - points[:, None],
            points,
            np.array([place["I", i] for i in range(found.inverse.size)]),
            np.array([place["c", k] for k in range(found.constants.size)]),
            np.array(found.signs, dtype=np.float64),
            np.array(found.on_cuts).T,
            np.array(found.increasing),
            np.array([1 / found.time_rate]),
        )


def scale_of(start: Start, time: int, xp: Balls) -> Any:
    """Return d(time)/dτ₁ over Π_s ``rate_factor`` of the kernel's time, of a start in balls; call
    it ``with xp:``.
    """
    scale = start.rate[0]
    for s, below in enumerate(start.on_cuts[0]):
        scale = scale / text_over(xp).rate_factor(start.points, time, s, below)
    return scale


def _in_doubles(start: Start) -> Start:
    """Return a start with every number rounded once."""
    numbers = {name: getattr(start, name) for name in ("d", "points", "on_cuts", "rate")}
    rounded = {name: x.astype(np.float64, order="C") for name, x in numbers.items()}
    return start._replace(**rounded)


def flow_of(
    problem: TorusProblem, points: Sequence[arb], unit: Fraction, frozen: Sequence[Fraction]
) -> list[arb]:
    """Return du/dτ₁ = L(p_k) for the nodal differentials p_k dλ/2w, (g,), from branch points in
    balls; unit, frozen: of ``Moving``.

    Where a direction is frozen λ stays at its I, and L of what is left is P ↦ L((λ−I)P).
    """
    g = len(points) // 2
    first, last = map(rational, problem.direction(g, unit, frozen))
    nodes = [(points[2 * k] + points[2 * k + 1]) / 2 for k in range(1, g)]
    flow = [
        first * math.prod((-x for j, x in enumerate(nodes) if j != k), start=arb(1))
        for k in range(g)
    ]
    flow[-1] += last
    return flow


def departure(width: float, energy: float, distance: float, tau1: float) -> float:
    """Return how far two motions may part until τ₁ that are ``distance`` from one another at the
    start; I from 1 − ``width`` to 1, E the energy of Neumann's system. By Gronwall's bound: of
    |u'' | ≤ M|u|, or where β − a_i is near −ω² of u'' + ω²u, |β − a_i + ω²| ≤ 3/2 of the width.
    """
    low = 1 - width
    _, level = bend_and_level(low, energy)
    growth, square = math.sqrt(level), energy - (1 + low) / 2
    if square > 0:
        growth = min(growth, 3.5 * width / math.sqrt(square))
    exponent = math.log(_FACTOR * distance / low) + growth * tau1
    return math.exp(exponent) if exponent < 0 else math.inf


def log_drift(spectrum: Spectrum, tau1: Array, of_frame: float = 0.0) -> Array:
    """Return the natural logarithm of a bound of how far τ₁, q', the frame and the λ's, in units
    where the largest I is 1, may part from those of another start until Neumann times (N,), over
    the distance of the starts: each A, q, and q̇ against itself. ``of_frame``: by how much the frame
    at the start turns where A⁻¹ on q⊥ less q'q'ᵀ and q are moved by a unit.

    Both are motions of Neumann's system (Theorem LR→Nn), q'' = (β−a)q with a = A⁻¹, β = 2(aq,q) − E
    and E = (q',q') + (aq,q) constant. For u = q₀−q₁ and w = u', with |a₀−a₁| ≤ δ and (q₀+q₁, u) =
    0, |w'| ≤ M|u| + 3δ + |E₀−E₁|, M of ``bend_and_level``. So |u| ≤ D, |w| ≤ μD with D = (|u(0)| +
    |w(0)|/μ + (3δ + |E₀−E₁|)/M) e^{μ|τ₁|}, μ = √M. The frame turns with E' = (q'qᵀ − qq'ᵀ)E, skew:
    two frames part by at most ∫2(|w| + |q'||u|). Time maps part by ∫|ρ₀−ρ₁|, where ρ = d(time)/dτ₁
    is a constant times a power between −1 and ½ of (q,Aq), itself between 1 and A_1; and every
    series by what it moves in that time.
    """
    inverse, q, p = (x.astype(float) for x in (spectrum.inverse, spectrum.q, spectrum.q_prime))
    low, energy = float(inverse[0]), float(np.sum(p * p) + np.sum(inverse * q * q))
    bend, level = bend_and_level(low, energy)
    growth, speed = math.sqrt(level), math.sqrt(max(0.0, energy - low))
    # q' is |q'| times as far, and E by 2|q'|² + 4
    apart = 1 + speed / growth + (7 + 2 * speed**2) / level
    late = (11 * tau1 + 2 * apart / growth) / low**2
    frame = 2 * (1 + speed / growth) * apart + speed * late + (7 + 2 * speed**2) * of_frame
    velocity = growth * apart + bend * late + speed * (11 + 2 * frame) / low
    together = _STARTS * q.size / low * (late + 4 * frame + velocity + 1)
    return np.asarray(np.log(together) + growth * tau1)


def bend_and_level(low: float, energy: float) -> tuple[float, float]:
    """Return max |β−a_i| and M = max |β−a_i| + 2(max a − min a), for a within [low, 1]: 2 low − E ≤
    β ≤ 2 − E.
    """
    bend = max(2 - energy - low, energy - 2 * low + 1) * _UP
    return bend, (bend + 2 * (1 - low)) * _UP
