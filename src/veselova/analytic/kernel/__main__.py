"""Compile the kernel ahead: ``python -m veselova.analytic.kernel``.

The halves run side by side: what both compile has one signature, so that neither keeps what the
other would take for its own.
"""

from __future__ import annotations

import os

# LLVM's further levels take a quarter longer and make nothing faster.
os.environ.setdefault("NUMBA_OPT", "1")

import numpy as np

from veselova.analytic.closed.closed_form import closed_form
from veselova.analytic.closed.many import states_of_starts, tori
from veselova.analytic.closed.motion import kernel_motion
from veselova.analytic.closed.quotients import ByTheta
from veselova.analytic.closed.torus import torus
from veselova.analytic.curve.periods import AbelInDoubles
from veselova.analytic.kernel.compiler import HALF, prepare
from veselova.geodesics import Ellipsoid
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.systems.neumann import NeumannSystem
from veselova.mechanics.systems.rolling_veselova import RollingVeselova
from veselova.mechanics.systems.veselova import Veselova

A, Q, V = [3.0, 2.0, 1.0], [0.6, 0.1, 0.8], [0.1, 1.0, -0.2]
TIMES, LATE = np.array([-1.0, 1.0]), np.zeros(2)


def one() -> None:
    """Compile panels, theta functions, documents of one motion and geodesics by using them."""
    for numbers in (A, ["3.1", "2", "1"]):  # doubles, and other exact data
        for system in (Veselova, NeumannSystem):
            motion = kernel_motion(system(numbers, Q, V, normalize=True))
            time_map = "panels" if system is Veselova else None
            motion.states(TIMES, LATE, time_map, ByTheta(motion.filler))
            closed_form(motion.problem)
            found = torus(motion.problem)
            assert found.close_orbit is not None
            found.close_orbit(np.array([1, 1]))
    AbelInDoubles([np.array([[0.16, 0.01]])], 1.0).invert(np.array([[0.25]]))
    ball = kernel_motion(RollingVeselova(A, Q, V, normalize=True))
    ball.states(np.linspace(0.0, 1.0, 64), np.zeros(64))  # by series of states
    line = Ellipsoid((3, 2, 1)).inverse([10, 20], [-35, 160])
    Ellipsoid("WGS84").direct([90, 20], line.azi1, line.s12)


def many() -> None:
    """Compile Fourier modes and many starts by using them."""
    for numbers in (A, ["3.1", "2", "1"]):
        kernel_motion(Veselova(numbers, Q, V, normalize=True)).states(TIMES, LATE, "fourier")
    start = np.array([[A], [Q], [V]])
    tori(start[0], start[1], start[2])
    list(states_of_starts(start[0], start[1], start[2], TimeGrid.of(TIMES)))
    ball = kernel_motion(RollingVeselova(A, Q, V, normalize=True))
    ball.states(np.append(1e3, np.linspace(1e6, 1e6 + 1, 64)), np.zeros(65))


def main() -> None:
    """Compile all of it, and have it in this process."""
    prepare()
    one()
    many()


if __name__ == "__main__":
    {"one": one, "many": many}.get(os.environ.get(HALF, ""), main)()
