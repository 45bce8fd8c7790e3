"""The mean velocity of a rolling ball: in one direction always, and more in a resonance."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.balls import least_square
from veselova.analytic.motion.area_motion import roll
from veselova.analytic.motion.area_solution import AreaSolution, solution_of
from veselova.analytic.motion.displacement import displacement_of
from veselova.analytic.motion.torus_solution import Solution
from veselova.analytic.time_map.fourier import find_modes
from veselova.analytic.time_map.fourier_modes import Integers, TorusSeries
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.results.drift import Drift
from veselova.mechanics.systems.chaplygin_ball import ChaplyginBall
from veselova.mechanics.systems.rolling_ball_n import RollingBallN
from veselova.mechanics.systems.rubber_ball import RubberBall

__all__ = ["MOST_PHASES", "drift", "may_resonate"]

Array = NDArray[np.float64]

#: Derived: roundings of Σ|M_s f_s| below which M·f counts as zero.
_ROUNDINGS = 32.0

#: Budget: genus and entries of orders, doubled, among which a resonance can be ruled out before any
#: series is known. The modes of n = 4 have entries of some fifty, 200 at a relative gap of 1e-12.
MOST_PHASES = 3
_LARGEST_ORDER = 1000

#: Method: bits that the search for resonances takes of a frequency.
_BITS = 46


def drift(
    ball: RubberBall | ChaplyginBall | RollingBallN, solution: Solution | None = None
) -> Drift:
    """Return the mean velocity of the contact point.

    The uniform part is a·2h/|p| along the momentum, or aμ1k_h along n with an area constant. The
    modes with M·f = 0 of the other parts are averaged over the orbit. Raises Unsolved on a
    separatrix. ``solution``: that of the problem on the torus.
    """
    if not ball.moves:
        return Drift(np.zeros_like(ball.start["position"][0]))
    solution = solution or solution_of(ball.on_torus())
    if solution.separatrices:
        raise Unsolved("no-closed-form", "on a separatrix motions have no mean over all times")
    displacement = displacement_of(solution)
    assert displacement is not None
    if not may_resonate(solution.in_tau1.rates):
        moved = displacement.at(np.ones(1), None, np.zeros((1, displacement.count)))
        return Drift(roll(ball, solution.problem, moved)[0])
    found = displacement.series
    resonance = _resonance(found, solution)
    means = np.array([_mean(series, solution) for series in found])
    rate = solution.mean_rate
    if resonance is not None:
        modes, coefficients, *_ = find_modes(solution.rate)
        same = _resonant(modes, solution.in_tau1.rates)
        angles = 2 * np.pi * (modes[same] @ solution.in_tau1.start)
        rate += float(2 * coefficients[same] @ np.cos(angles))
        if isinstance(solution, AreaSolution) and solution.odd_peak:
            rate += solution.odd_peak * _mean(solution.odd_series, solution)
    moved = displacement.at(np.ones(1), None, means[None] / rate)
    return Drift(roll(ball, solution.problem, moved)[0], resonance)


def may_resonate(f: Array) -> bool:
    """Return False where no order M, |M_s| ≤ 1000, can be orthogonal to f to its rounding.

    Such an order is a short vector (M, Σ M_s k_s) of a lattice, k the first bits of f. A basis that
    is reduced has one that is at most 2^((g−1)/2) times as long.
    """
    g = f.size
    if g > MOST_PHASES:
        return True
    units = np.rint(np.ldexp(f / np.max(np.abs(f)), _BITS))
    rows = [[int(s == j) for j in range(g)] + [int(unit)] for s, unit in enumerate(units)]
    rounding = 0.5 + math.ldexp(_ROUNDINGS * np.finfo(float).eps, _BITS)
    longest = _LARGEST_ORDER * (math.sqrt(g) + rounding * g)
    return bool(least_square(rows) <= 2 ** (g - 1) * longest**2)


def _resonance(found: list[TorusSeries], solution: Solution) -> tuple[int, ...] | None:
    """Return the largest resonant order, doubled; None where none is resonant."""
    resonance = None
    for series in found:
        same = _resonant(series.orders, solution.in_tau1.rates)
        if same.any():
            first = series.orders[same][np.argmax(np.abs(series.coefficients[same]))]
            resonance = tuple(int(x) for x in first)
    return resonance


def _mean(series: TorusSeries, solution: Solution) -> float:
    """Return the mean of a series along the orbit, per unit of τ₁: that of its resonant modes."""
    same = _resonant(series.orders, solution.in_tau1.rates)
    angles = np.pi * (series.orders[same] @ solution.in_tau1.start + 2 * series.turns[same])
    return float(2 * series.coefficients[same] @ np.cos(angles))


def _resonant(orders: Integers, f: Array) -> NDArray[np.bool_]:
    """Return which orders (K, g) are orthogonal to f, to its rounding."""
    sizes = np.abs(orders) @ np.abs(f)
    return np.asarray(np.abs(orders @ f) <= _ROUNDINGS * np.finfo(float).eps * sizes)
