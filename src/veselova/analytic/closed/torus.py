"""The invariant torus of a motion, by the kernel, and the mean velocity of a rolling ball: in one
direction always, and more in a resonance.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.balls import least_square
from veselova.analytic.closed.bodies import roll
from veselova.analytic.closed.motion import KernelMotion, kernel_motion
from veselova.analytic.closed.quotients import riemann_matrix
from veselova.analytic.closed.series import ODD, RATE, Series, series_of
from veselova.analytic.kernel import document, panels
from veselova.analytic.kernel.frame import set_frame
from veselova.analytic.kernel.many import set_actions
from veselova.analytic.kernel.series import chebyshev
from veselova.mechanics.core.budget import checkpoint, stated_s
from veselova.mechanics.core.errors import OverBudget, Unsolved
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.results.torus import Drift, Torus
from veselova.mechanics.systems.chaplygin_ball import ChaplyginBall
from veselova.mechanics.systems.rolling_ball_n import RollingBallN
from veselova.mechanics.systems.rubber_ball import RubberBall
from veselova.mechanics.systems.torus_problem import TorusProblem, on_torus

__all__ = [
    "drift",
    "may_resonate",
    "torus",
    "torus_motion",
]

Array = NDArray[np.float64]

#: Derived: an attitude that is not back differs by signs of whole components.
BACK = 1e-4

#: Calibrated: seconds that all periods take at the size from which they are counted; they grow like
#: its cube.
_SECONDS, _SIZE = 0.06, 50

#: Derived: roundings of Σ|M_s f_s| below which M·f counts as zero.
_ROUNDINGS = 32.0

#: Budget: genus and entries of orders, doubled, among which a resonance can be ruled out before any
#: series is known. The modes of n = 4 have entries of some fifty, 200 at a relative gap of 1e-12.
_MOST_PHASES = 3
_LARGEST_ORDER = 1000

#: Method: bits that the search for resonances takes of a frequency.
_BITS = 46


def torus_motion(problem: TorusProblem) -> KernelMotion:
    """Return the motion of whose torus the kernel has all numbers. Raises Unsolved as
    ``kernel_motion``, OverBudget where periods would take too long.
    """
    _require_time(problem)
    return kernel_motion(problem, proven=False)


def _require_time(problem: TorusProblem) -> None:
    """Raise OverBudget where compiled periods, which nothing stops, would take too long."""
    size = min(problem.n, 2 * len(set(problem.exact.A)))
    seconds = _SECONDS * (size / _SIZE) ** 3
    if size > _SIZE and seconds > stated_s():
        raise OverBudget(stated_s(), seconds, " of the periods, or allow more")


def torus(given: Problem) -> Torus:
    """Return the invariant torus on which a motion runs, and where it starts there, with the drift
    of a ball where that takes about as long. Raises Unsolved at rest.

    Directions that do not move belong to no torus: the curve is that of the moving part. Digits: to
    about 1e-15 relative, tested for n = 2…8.
    """
    motion, drifts = torus_motion(on_torus(given)), None
    quick = not motion.on_separatrix and motion.genus <= _MOST_PHASES
    if quick and isinstance(given, (RubberBall, ChaplyginBall, RollingBallN)):
        drifts = drift(given, motion)
    problem, moving, torus, g = motion.problem, motion.moving, motion.torus, motion.genus
    T, residual, _ = riemann_matrix(torus)
    periods, actions = np.zeros((g, g)), np.zeros(g)
    document.set_monomial_periods(torus, periods)
    set_actions(torus.d, torus.of_c, torus.cuts, torus.angles.counts, actions)
    unit = float(moving.unit)
    root = math.sqrt(moving.unit)
    # With λ in units of the largest I, λ^{k−1}dλ/√R scales like I^{k−g−½}.
    with np.errstate(over="ignore", under="ignore"):
        periods *= np.exp(math.log(unit) * (g + 0.5 - np.arange(1, g + 1)))[:, None]
    # The curve itself depends on ratios of A alone, and so does all that follows.
    in_range = bool(
        np.all(np.isfinite(periods))
        and np.all(np.any(np.abs(periods) >= np.finfo(float).tiny, axis=1))
    )
    known = 0 if problem.time == "tau1" else 1  # c_1 = 0 goes without saying
    frozen = [1 / float(a) for a in moving.frozen]
    origins = [""] * torus.points.size
    for i, place in enumerate(torus.of_I.tolist()):
        origins[place] = f"I{moving.axes[i] + 1}"
    for k, place in enumerate(torus.of_c.tolist()):
        origins[place] = f"c{k + 1}"
    in_time = torus.frequencies / torus.mean
    return Torus(
        n=problem.n,
        **{"energy": None, given.energy_name: problem.energy},
        constants=np.sort([*(torus.points[torus.of_c[known:]] / unit), *frozen]),
        branch_points=torus.points / unit,
        origins=tuple(origins),
        periods=periods if in_range else None,
        actions=actions / root,
        rotation_numbers=in_time / in_time[0],
        signs=_signs(problem),
        riemann_matrix=T,
        riemann_matrix_residual=float(residual),
        frequencies_tau1=torus.frequencies / root,
        frequencies_t=in_time,
        phases=np.mod(np.mod(torus.z, 1.0), 1.0),  # the first mod of −1e-20 is 1.0
        mean_rate=float(torus.mean[0]) / root,
        regime=motion.regime,
        close_orbit=partial(close_orbit, problem),
        drift=drifts,
    )


def _signs(problem: TorusProblem) -> NDArray[np.int64]:
    """Return the sign of each q_i at the start, of q̇_i where q_i = 0, and 0 where the coordinate
    rests in its plane.
    """
    pairs = zip(problem.exact.q, problem.exact.tangent, strict=True)
    return np.array([(x > 0) - (x < 0) or (v > 0) - (v < 0) for x, v in pairs], dtype=np.int64)


def close_orbit(problem: TorusProblem, windings: NDArray[np.int64]) -> tuple[float, bool]:
    """Return the time in which each phase goes round so many times, and whether the attitude is
    then the same.

    On a resonance dt/dτ₁ has a mean along the orbit that is not its mean over the torus. So its
    integral over the orbit is taken. The attitude is that at the phases z⁰ + windings: it has
    period 2 in each of them.
    """
    motion = torus_motion(problem)
    torus, room, g = motion.torus, motion.room, motion.genus
    f = torus.frequencies
    tau1 = float(windings @ f) / float(f @ f)
    frames = np.empty((2, g + 1, g + 1))
    for frame, psi in zip(frames, (torus.psi, torus.psi + 2 * np.pi * windings), strict=True):
        set_frame(torus, psi, room, frame, np.empty(g + 1))
    return _time_along(motion, tau1), bool(np.max(np.abs(frames[1] - frames[0])) < BACK)


def _time_along(motion: KernelMotion, tau1: float) -> float:
    """Return the problem's time after τ₁ along the orbit: the integral of its rate on panels."""
    if motion.problem.time == "tau1":
        return tau1 * float(motion.torus.mean[0])
    walk = panels.make_walk(motion.torus, 1 if tau1 > 0 else -1, 0)
    left = walk.left
    while abs(left[panels.LEFT] + left[panels.LENGTH]) < abs(tau1):
        checkpoint()
        if not panels.next_panel(motion.torus, walk, motion.room):
            raise Unsolved("too-far", "panels do not resolve the orbit")
    x = 2 * (tau1 - left[panels.LEFT]) / left[panels.LENGTH] - 1
    elapsed = chebyshev(walk.integral, walk.integral.size, x)
    return float(left[panels.BEFORE] + elapsed)


Integers = NDArray[np.int64]


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
