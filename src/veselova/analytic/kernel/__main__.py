"""Compile the kernel ahead: ``python -m veselova.analytic.kernel``, a minute a version."""

from __future__ import annotations

import os

# LLVM's further levels take a quarter longer and make nothing faster.
os.environ.setdefault("NUMBA_OPT", "1")

import numpy as np


def main() -> None:
    """Compile all functions by using them."""
    from veselova.analytic.closed.closed_form import closed_form
    from veselova.analytic.closed.many import states_of_starts, tori
    from veselova.analytic.closed.motion import kernel_motion
    from veselova.analytic.closed.quotients import ByTheta
    from veselova.analytic.closed.torus import torus
    from veselova.geodesics import Ellipsoid
    from veselova.mechanics.core.times import TimeGrid
    from veselova.mechanics.systems.neumann import NeumannSystem
    from veselova.mechanics.systems.rolling_veselova import RollingVeselova
    from veselova.mechanics.systems.veselova import Veselova

    A, q, q_dot = [3.0, 2.0, 1.0], [0.6, 0.1, 0.8], [0.1, 1.0, -0.2]
    times, late = np.array([-1.0, 1.0]), np.zeros(2)
    for numbers in (A, ["3.1", "2", "1"]):  # doubles, and other exact data
        for system in (Veselova, NeumannSystem):
            motion = kernel_motion(system(numbers, q, q_dot, normalize=True))
            for time_map in ("panels", "fourier") if system is Veselova else (None,):
                motion.states(times, late, time_map, ByTheta(motion.filler))
            closed_form(motion.problem)
            found = torus(motion.problem)
            assert found.close_orbit is not None
            found.close_orbit(np.array([1, 1]))
    ball = kernel_motion(RollingVeselova(A, q, q_dot, normalize=True))
    ball.states(np.array([1e3]), late[:1])
    ball.states(np.linspace(0.0, 1.0, 64), np.zeros(64))  # by series of states
    start = np.array([[A], [q], [q_dot]])
    list(states_of_starts(start[0], start[1], start[2], TimeGrid.of(times)))
    tori(start[0], start[1], start[2])
    line = Ellipsoid((3, 2, 1)).inverse([10, 20], [-35, 160])
    Ellipsoid("WGS84").direct([90, 20], line.azi1, line.s12)


if __name__ == "__main__":
    from veselova.analytic.kernel.compiler import claim

    with claim():
        main()
