"""The mean velocity of a rolling ball: along its momentum always, across it in a resonance."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.motion.torus_solution import Solution
from veselova.analytic.time_map.fourier import find_modes
from veselova.analytic.time_map.fourier_modes import Integers
from veselova.analytic.time_map.torus_series import NormalComponent, find_series
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.results.drift import Drift
from veselova.mechanics.systems.rolling_veselova import RollingVeselova
from veselova.mechanics.systems.rubber_ball import RubberBall

__all__ = ["drift"]

Array = NDArray[np.float64]

#: Roundings of Σ|M_s f_s| below which M·f counts as zero.
_ROUNDINGS = 32.0


def drift(ball: RubberBall) -> Drift:
    """Return the mean velocity of the contact point.

    Along the momentum it is a·2h/|p|. Across it the modes with M·f = 0 move the ball, which are
    averaged over the orbit. Raises Unsolved on a separatrix, and where (Ω,γ) ≠ 0.
    """
    if not ball.moves:
        return Drift(np.zeros(2))
    if not ball.has_torus:
        raise Unsolved("not-rank-one", ball.without_closed_form or "there is no torus")
    problem = ball.on_torus()
    assert isinstance(problem, RollingVeselova)
    solution = Solution(problem)
    if solution.separatrices:
        raise Unsolved("no-closed-form", "on a separatrix motions have no mean over all times")
    f = solution.in_tau1.rates
    start = solution.in_tau1.start
    across = np.zeros(solution.curve.genus - 1)
    resonance: tuple[int, ...] | None = None
    for k in range(solution.curve.genus - 1):
        series = find_series(NormalComponent.of(solution.frame, solution.inversion, k + 1))
        resonant = _resonant(series.orders, f)
        if resonant.any():
            angles = np.pi * (series.orders[resonant] @ start + 2 * series.turns[resonant])
            across[k] = 2 * series.coefficients[resonant] @ np.cos(angles)
            first = series.orders[resonant][np.argmax(np.abs(series.coefficients[resonant]))]
            resonance = tuple(int(x) for x in first)
    rate = solution.mean_rate
    if resonance is not None:
        modes, coefficients, *_ = find_modes(solution.rate)
        same = _resonant(modes, f)
        rate += float(2 * coefficients[same] @ np.cos(2 * np.pi * (modes[same] @ start)))
    y = np.append(across / rate, problem.speed)
    return Drift(-float(ball.ball.radius) * (y @ solution.rotation), resonance)


def _resonant(orders: Integers, f: Array) -> NDArray[np.bool_]:
    """Return which orders (K, g) are orthogonal to f, to its rounding."""
    sizes = np.abs(orders) @ np.abs(f)
    return np.asarray(np.abs(orders @ f) <= _ROUNDINGS * np.finfo(float).eps * sizes)
