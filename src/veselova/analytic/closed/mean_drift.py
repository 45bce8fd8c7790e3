"""The invariant torus of a motion, and the mean velocity of a rolling ball: in one direction
always, and more in a resonance.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.balls import least_square
from veselova.analytic.closed.bodies import roll
from veselova.analytic.closed.motion import KernelMotion
from veselova.analytic.closed.series import ODD, RATE, Series, series_of
from veselova.analytic.closed.shell_motion import ShellMotion
from veselova.analytic.closed.torus import torus_motion, torus_of
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.results.drift import Drift
from veselova.mechanics.results.torus import Torus
from veselova.mechanics.systems.ball_on_sphere import RubberBallOnSphere
from veselova.mechanics.systems.chaplygin_ball import ChaplyginBall
from veselova.mechanics.systems.rolling_ball_n import RollingBallN
from veselova.mechanics.systems.rubber_ball import RubberBall
from veselova.mechanics.systems.torus_problem import on_torus

__all__ = ["drift", "may_resonate", "torus"]

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Derived: roundings of Σ|M_s f_s| below which M·f counts as zero.
_ROUNDINGS = 32.0

#: Budget: genus and entries of orders, doubled, among which a resonance can be ruled out before any
#: series is known. The modes of n = 4 have entries of some fifty, 200 at a relative gap of 1e-12.
_MOST_PHASES = 3
_LARGEST_ORDER = 1000

#: Method: bits that the search for resonances takes of a frequency.
_BITS = 46


def torus(given: Problem) -> Torus:
    """Return the invariant torus on which a motion runs, and where it starts there, with the drift
    of a ball where that takes about as long. Raises Unsolved at rest.
    """
    if isinstance(given, RubberBallOnSphere):
        return ShellMotion(given).torus
    motion, drifts = torus_motion(on_torus(given)), None
    known = not motion.on_separatrix and motion.genus <= _MOST_PHASES
    if known and isinstance(given, (RubberBall, ChaplyginBall, RollingBallN)):
        drifts = drift(given, motion)
    return torus_of(given, motion, drifts)


def drift(
    ball: RubberBall | ChaplyginBall | RollingBallN, motion: KernelMotion | None = None
) -> Drift:
    """Return the mean velocity of the contact point.

    The uniform part is a·2h/|p| along the momentum, or aμ1k_h along n with an area constant. The
    modes with M·f = 0 of the other parts are averaged over the orbit. Raises Unsolved on a
    separatrix. ``motion``: that of the problem on the torus.
    """
    if not ball.moves:
        return Drift(np.zeros_like(ball.start["position"][0]))
    if motion is None:
        motion = torus_motion(ball.on_torus())
        if motion.on_separatrix:
            raise Unsolved("no-closed-form", "on a separatrix motions have no mean over all times")
    torus, path = motion.torus, motion.path
    assert path is not None
    means, resonance = np.zeros((len(path.factors), 1)), None
    if means.size and may_resonate(torus.frequencies):
        found = [series_of(torus, k + 1) for k in range(min(len(means), motion.genus - 1))]
        if torus.tilt[0]:
            found.append(series_of(torus, ODD))
        resonance = _resonance(found, torus)
        means[: len(found), 0] = [_mean(series, torus) for series in found]
        rate = float(torus.mean[0])
        if resonance is not None:
            rate += _mean(series_of(torus, RATE), torus) + (means[-1, 0] if torus.tilt[0] else 0.0)
        means /= rate
    moved, _ = path.at(np.ones(1), means, np.zeros(means.shape))
    return Drift(roll(ball, motion.problem, moved)[0], resonance)


def may_resonate(f: Array) -> bool:
    """Return False where no order M, |M_s| ≤ 1000, can be orthogonal to f to its rounding.

    Such an order is a short vector (M, Σ M_s k_s) of a lattice, k the first bits of f. A basis that
    is reduced has one that is at most 2^((g−1)/2) times as long.
    """
    g = f.size
    if g > _MOST_PHASES:
        return True
    units = np.rint(np.ldexp(f / np.max(np.abs(f)), _BITS))
    rows = [[int(s == j) for j in range(g)] + [int(unit)] for s, unit in enumerate(units)]
    rounding = 0.5 + math.ldexp(_ROUNDINGS * np.finfo(float).eps, _BITS)
    longest = _LARGEST_ORDER * (math.sqrt(g) + rounding * g)
    return bool(least_square(rows) <= 2 ** (g - 1) * longest**2)


def _resonance(found: list[Series], torus: Any) -> tuple[int, ...] | None:
    """Return the largest resonant order, doubled; None where none is resonant."""
    resonance = None
    for series in found:
        same = _resonant(series.orders, torus.frequencies)
        if same.any():
            first = series.orders[same][np.argmax(np.abs(series.coefficients[same]))]
            resonance = tuple(int(x) for x in first)
    return resonance


def _mean(series: Series, torus: Any) -> float:
    """Return the mean of a series along the orbit, per unit of τ₁: that of its resonant modes."""
    same = _resonant(series.orders, torus.frequencies)
    angles = np.pi * (series.orders[same] @ torus.z + 2 * series.turn)
    return float(2 * series.coefficients[same] @ np.cos(angles))


def _resonant(orders: Integers, f: Array) -> NDArray[np.bool_]:
    """Return which orders (K, g) are orthogonal to f, to its rounding."""
    sizes = np.abs(orders) @ np.abs(f)
    return np.asarray(np.abs(orders @ f) <= _ROUNDINGS * np.finfo(float).eps * sizes)
