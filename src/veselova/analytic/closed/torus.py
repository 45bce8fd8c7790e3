"""The invariant torus of a motion, by the kernel."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.closed.motion import KernelMotion, kernel_motion
from veselova.analytic.kernel import panels, riemann
from veselova.analytic.kernel.frame import set_frame
from veselova.analytic.kernel.many import set_actions
from veselova.analytic.kernel.series import chebyshev
from veselova.mechanics.core.budget import checkpoint, stated_s
from veselova.mechanics.core.errors import OverBudget, Unsolved
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.results.drift import Drift
from veselova.mechanics.results.torus import Torus
from veselova.mechanics.systems.torus_problem import TorusProblem

__all__ = [
    "riemann_matrix",
    "torus_motion",
    "torus_of",
]

Array = NDArray[np.float64]

#: Derived: an attitude that is not back differs by signs of whole components.
BACK = 1e-4

#: Calibrated: seconds that all periods take at the size from which they are counted; they grow like
#: its cube.
_SECONDS, _SIZE = 0.06, 50


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


def riemann_matrix(motion: KernelMotion) -> tuple[Array, float, float]:
    """Return T (g, g), and of it what ``kernel.riemann.set_riemann_matrix`` returns."""
    T = np.zeros((motion.genus, motion.genus))
    return T, *riemann.set_riemann_matrix(motion.torus, T)


def torus_of(given: Problem, motion: KernelMotion, drift: Drift | None) -> Torus:
    """Return the torus on which a motion of a given problem runs; ``drift``: of ``Torus``.

    Directions that do not move belong to no torus: the curve is that of the moving part. Digits: to
    about 1e-15 relative, tested for n = 2…8.
    """
    problem, moving, torus, g = motion.problem, motion.moving, motion.torus, motion.genus
    T, residual, _ = riemann_matrix(motion)
    periods, actions = np.zeros((g, g)), np.zeros(g)
    riemann.set_monomial_periods(torus, periods)
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
        drift=drift,
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
