"""Theta functions of τ = iT at real points to any number of digits: the sums of
analytic.theta.siegel_theta in balls.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import flint
import numpy as np

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.theta.characteristic import Characteristic
from veselova.analytic.theta.lattice import largest_corner, points_near_cell, points_within
from veselova.analytic.theta.siegel_reduction import Member, SiegelReduction, to_doubles
from veselova.analytic.theta.siegel_terms import TermTable
from veselova.mechanics.core.budget import checkpoint
from veselova.mechanics.core.errors import Unsolved

__all__ = ["ThetaInBalls"]

#: Derived: terms below e^(−nats−4) of the largest are left out: as many as there are near the edge
#: add less than the precision.
_BEYOND_PRECISION = 4.0

#: Budget: most terms of one sum: a second for each point.
_MOST_TERMS = 300_000

#: Budget: entries of one block of (points × half vectors).
_BLOCK = 10_000

_phase_factors = np.frompyfunc(lambda x: (2 * x).exp_pi_i(), 1, 1)


class ThetaInBalls:
    """The theta functions of T, shape (g, g), balls of ``arithmetic``. What is left out of the sums
    is estimated, not bounded.
    """

    def __init__(self, T: Values, arithmetic: Any) -> None:
        self.genus, self._xp = len(T), arithmetic
        reduction = SiegelReduction.of(flint.acb_mat((T * flint.acb(0, 1)).tolist()))
        if reduction is None:
            raise ZeroDivisionError("a Riemann matrix of too few digits")
        self._reduction = reduction
        tau = reduction.matrices()[0]
        form = to_doubles(tau).imag
        radius = math.sqrt((arithmetic.nats + _BEYOND_PRECISION) / math.pi)
        count = points_within(form, radius + math.sqrt(largest_corner(form)))
        if not count <= _MOST_TERMS:
            reason = f"theta sums of {arithmetic.digits} digits would have {count:.1e} terms"
            raise Unsolved("narrow-gap", f"{reason} at this gap")
        points = points_near_cell(form, radius)
        k = points.astype(np.int64).astype(object)
        rows = np.array(tau.tolist(), dtype=object)
        self._table = TermTable.of(points, _phase_factors(np.sum((k @ rows) * k, axis=1) / 2))

    def values(self, z: Values, characteristics: Sequence[Characteristic]) -> Values:
        """Return θ[ε;δ](z) at points of shape (N, g) for each characteristic, shape (N,
        len(characteristics)).

        The first characteristic must be zero: what the sums leave out is measured against its
        values, which have no zeros.
        """
        xp = self._xp
        size = max(1, _BLOCK // self._table.width)
        result = np.empty((len(z), len(characteristics)), dtype=object)
        # by even numbers characteristics are not turned
        near = z - 2 * xp.floor(z / 2 + xp.number(1) / 2)
        halves = np.array([[c.epsilon, c.delta] for c in characteristics]) / 2
        for members in self._reduction.alike(halves):
            for first in range(0, len(z), size):
                checkpoint()
                rows = slice(first, first + size)
                self._fill(result[rows], flint.acb_mat(near[rows].tolist()), members)
        return np.asarray(xp.add_error(result, np.abs(result[:, :1]) * xp.epsilon))

    def _fill(self, result: Values, points: Any, members: list[Member]) -> None:
        """Write the values of characteristics that are alike to their places."""
        first = members[0]
        at = self._reduction.arguments(points, first)
        delta = first.doubles[1]
        turns = np.array([2 * (c.doubles[1] - delta) for c in members]).round().astype(np.int64)
        u = _phase_factors(np.array(at.v.tolist(), dtype=object))
        sums = self._table.moments(u, 0, turns)[0]
        common = _phase_factors(np.array(at.turns, dtype=object))
        odd = at.nearest.astype(np.int64) @ turns.T % 2
        for member, half_turns, of_k, sign in zip(members, turns, sums, 1 - 2 * odd.T, strict=True):
            own = sum((x * int(h) for x, h in zip(first.reduced, half_turns)), 2 * member.turns)
            turn = flint.acb(flint.fmpq(*Fraction(own).as_integer_ratio())).exp_pi_i()
            values = common * of_k * turn
            result[:, member.place] = [x.real * int(s) for x, s in zip(values, sign, strict=True)]
