"""The time in which the phases of a torus go round a whole number of times, along one orbit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.closed.torus import BACK
from veselova.analytic.motion.area_solution import solution_of
from veselova.analytic.time_map.panel_quadrature import integrate_on_panels
from veselova.mechanics.systems.torus_problem import TorusProblem

__all__ = ["close_orbit"]


def close_orbit(problem: TorusProblem, windings: NDArray[np.int64]) -> tuple[float, bool]:
    """Return the time in which each phase goes round so many times, and whether the attitude is
    then the same.

    On a resonance dt/dτ₁ has a mean along the orbit that is not its mean over the torus. So its
    integral over the orbit is taken. The attitude is that at the phases z⁰ + windings: it has
    period 2 in each of them.
    """
    solution = solution_of(problem)
    flow = solution.in_tau1
    f = flow.rates
    tau1 = float(windings @ f) / float(f @ f)
    time = tau1 * solution.mean_rate
    if problem.time != "tau1":
        in_angles = solution.takes_rate_from_angles()
        low, high = min(tau1, 0.0), max(tau1, 0.0)
        panels = integrate_on_panels(lambda z: solution.rate_at(z, in_angles), flow, low, high)
        time = float(panels.at(np.array([tau1]))[0])
    z = np.stack([flow.start, flow.start + windings])
    frames = solution.states(solution.attitude(z, solution.default_method()))[2]
    return time, bool(np.max(np.abs(frames[1] - frames[0])) < BACK)
