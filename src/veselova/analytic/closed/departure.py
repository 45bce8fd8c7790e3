"""Starts whose branch points coincide, or are too near one another for doubles: the motion of a
start moved by far less than any digit, and how far the two may part.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import NamedTuple

from veselova.analytic.closed.spectrum import Start, exact_start, to_doubles
from veselova.analytic.kernel import rule
from veselova.analytic.spectrum.branch_points import resolve_spectrum
from veselova.analytic.spectrum.moving_part import Moving
from veselova.mechanics.core.decimals import FEWEST_DIGITS
from veselova.mechanics.core.errors import Unsolved

__all__ = ["UP", "bend_and_level", "departure", "opened_start"]

#: Derived: digits after which starts are moved, the first that leaves no cut or gap narrower than
#: ``rule.NARROWEST``: they open by this or by its square.
_DIGITS = (120, 60)

#: Derived: A's nearer than the second, relatively, are separated by the first.
_SEPARATED, _TOGETHER = Fraction(1, 10**40), Fraction(1, 10**30)

#: Derived: how far frames part for starts that are as far apart, and A's of ratio one, with all
#: factors of ``drift_bound``.
_FACTOR = 1e3

#: Derived: more than what a dozen operations in double precision round.
UP = 1 + 1e-12


class Opened(NamedTuple):
    """A start in balls and its doubles, of what moves; moved: by how much, where that is on a
    separatrix, else zero.
    """

    moving: Moving
    exact: Start
    near: Start
    moved: Fraction


def opened_start(moving: Moving, separate: bool) -> Opened:
    """Return the start of what moves, moved where branch points coincide or are too near one
    another for doubles; ``separate``: whether A's that nearly agree are told apart. Raises Unsolved
    as ``resolve_spectrum``.
    """
    given = moving
    if moving.size > 1:
        moving = moving.separate(_SEPARATED, _TOGETHER) if separate else moving
        if found := _in_doubles(moving, Fraction(0)):
            return found
    for digits in _DIGITS:
        beyond, coincide = digits - 2 * FEWEST_DIGITS - 10, 2 * digits + 20
        opened = resolve_spectrum(given, FEWEST_DIGITS, beyond=beyond, coincide=coincide)
        moved = Fraction(1, 10**digits) if opened.separatrices else Fraction(0)
        if found := _in_doubles(opened.moving, moved):
            return found
    raise Unsolved("beyond-floats", "branch points are too near one another, or |q'| is too large")


def _in_doubles(moving: Moving, moved: Fraction) -> Opened | None:
    """Return the start of what moves, None where doubles do not hold its branch points."""
    exact = exact_start(moving)
    if exact is None:
        return None
    near = to_doubles(exact)
    fits = rule.is_wide(near.d, near.points, near.on_cuts, near.rate)
    return Opened(moving, exact, near, moved) if fits else None


def departure(width: float, energy: float, distance: float, tau1: float) -> float:
    """Return how far two motions may part until τ₁ that are ``distance`` from one another at the
    start; I from 1 − ``width`` to 1, E the energy of Neumann's system. By Gronwall's bound: of
    |u'' | ≤ M|u|, or where β − a_i is near −ω² of u'' + ω²u, |β − a_i + ω²| ≤ 3/2 of the width.
    """
    low = 1 - width
    _, level = bend_and_level(low, 1.0, energy, energy)
    growth, square = math.sqrt(level), energy - (1 + low) / 2
    if square > 0:
        growth = min(growth, 3.5 * width / math.sqrt(square))
    exponent = math.log(_FACTOR * distance / low) + growth * tau1
    return math.exp(exponent) if exponent < 0 else math.inf


def bend_and_level(low: float, high: float, least: float, most: float) -> tuple[float, float]:
    """Return max |β−a_i| and M, for a within [low, high] and E within [least, most]: 2 low − E ≤ β
    ≤ 2 high − E.
    """
    bend = max(2 * high - least - low, most - 2 * low + high) * UP
    return bend, (bend + 2 * (high - low)) * UP
