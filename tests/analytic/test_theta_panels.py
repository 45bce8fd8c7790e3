"""States by theta quotients on panels are those by angles, where both serve; separatrices."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import veselova as vs
from draws import random_problem
from veselova.analytic.closed.motion import kernel_motion
from veselova.analytic.closed.theta_panels import ThetaPanels

TIMES = np.array([-4.0, -0.3, 0.0, 1.0, 7.0])


def motions(rng: np.random.Generator, n: int) -> dict[str, Any]:
    """Return problems on tori by name."""
    body = random_problem(rng, n, 5.0)
    data: Any = (body.A, body.q, body.q_dot)
    found: dict[str, Any] = {
        "veselova": body,
        "neumann": vs.NeumannSystem(*data, normalize=True),
        "geodesic": vs.EllipsoidGeodesic(*data, normalize=True),
    }
    if n == 3:
        ball = [1.0, 1.3, 1.7], 0.5, 1.0, rng.normal(size=3), rng.normal(size=3)
        found["rubber"] = vs.RubberBall(*ball, normalize=True).on_torus()
        found["chaplygin"] = vs.ChaplyginBall(*ball, normalize=True).on_torus()
    return found


@pytest.mark.parametrize("n", [2, 3, 4, 5])
def test_states_by_theta_quotients_are_those_by_angles(n: int, rng: np.random.Generator) -> None:
    for name, problem in motions(rng, n).items():
        motion, none = kernel_motion(problem), np.zeros(TIMES.size)
        found, (angles, _) = ThetaPanels(motion)(TIMES, none), motion.states(TIMES, none)
        assert np.max(np.abs(found.frames - angles.frames)) < 1e-12, name
        assert np.allclose(found.velocities, angles.velocities, rtol=0, atol=1e-12), name
        assert np.allclose(found.tau1, angles.tau1, rtol=1e-13, atol=1e-13), name
        off = np.abs(found.paths - angles.paths)
        assert np.all(off <= found.errors_of_paths + angles.errors_of_paths), name


@pytest.mark.parametrize("time", [0.5, 3.0, 30.0])
def test_a_separatrix_of_neumanns_point_is_a_hyperbolic_secant(time: float) -> None:
    found = vs.solve(vs.NeumannSystem([1, "1/2"], [1, 0], [0, 1]), [time, -time])
    exact = np.array([[1 / np.cosh(t), np.tanh(t)] for t in (time, -time)])
    assert np.all(np.max(np.abs(found.q - exact), axis=1) <= found.error)
    assert np.max(found.error) < 1e-11


def test_an_umbilic_geodesic_in_doubles_is_that_of_many_digits() -> None:
    A, q, q_dot = ["9", "4", "1"], ["3/5", 0, "4/5"], ["0.4", "1", "-0.3"]
    umbilic = vs.Veselova(["1", "1/10", "1/26"], q, q_dot, normalize=True)
    for problem in (umbilic, vs.Veselova(A, [0, 1, 0], [1, 0, 3])):
        found, finer = (vs.solve(problem, [-3, 8], digits=d) for d in (15, 25))
        assert np.all(np.max(np.abs(found.frame - finer.frame), axis=(1, 2)) <= found.error)
        assert np.max(found.error) < 1e-10


def test_the_mean_of_the_rate_is_served_beyond_gaps_that_angles_see() -> None:
    near = vs.Veselova([3, 2, 1], ["0.6", "1e-31", "0.8"], ["0.8", "1e-31", "-0.6"])
    found, finer = (vs.solve(near, [2.0, 20.0], digits=d) for d in (15, 25))
    assert np.all(np.max(np.abs(found.frame - finer.frame), axis=(1, 2)) <= found.error)
