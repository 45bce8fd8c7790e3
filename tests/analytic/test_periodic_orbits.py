"""Resonances of tori, and periods of the orbits on resonant ones."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq, root

import veselova as vs
from veselova import Unsolved, solve, torus
from veselova.service.api.json_documents import torus_of

A3 = [3.0, 2.0, 1.0]


def resonant(ratio: float, phases: Any = (0.1, 0.3), A: Any = A3) -> vs.Veselova:
    """Return a body whose rotation number Ω_2/Ω_1 is the ratio."""

    def body(c_2: float) -> vs.Veselova:
        return vs.from_torus(A, 0.7, [c_2], phases, [1, 1, 1])

    return body(
        brentq(lambda c_2: torus(body(c_2)).rotation_numbers[1] - ratio, *bracket(ratio, body, A))
    )


def bracket(ratio: float, body: Any, A: Any) -> tuple[float, float]:
    """Return constants on one side of I_2 between which the rotation number passes the ratio."""
    first = 1 / A[0] + 0.01
    for low, high in ((first, 0.49), (0.51, 0.98)):
        values = [torus(body(c)).rotation_numbers[1] - ratio for c in (low, high)]
        if values[0] * values[1] < 0:
            return low, high
    raise AssertionError("no such resonance")


RATIOS = [3 / 2, 4 / 3, 6 / 5]


@pytest.mark.parametrize("ratio", RATIOS)
def test_after_its_period_a_motion_is_where_it_was(ratio: float) -> None:
    problem = resonant(ratio)
    found = torus(problem)
    period = found.period(max_order=10)
    times = np.array([0.0, 0.37, period, period + 0.37, -period])
    motion = solve(problem, times)
    for name in ("q", "q_dot", "frame"):
        values = motion[name]
        assert np.max(np.abs(values[2] - values[0])) < 1e-10
        assert np.max(np.abs(values[3] - values[1])) < 1e-10
        assert np.max(np.abs(values[4] - values[0])) < 1e-10
    # It is the least: after half of it, or a third, the attitude is another.
    for part in (2, 3):
        there = solve(problem, period / part)
        assert np.max(np.abs(there.frame[0] - motion.frame[0])) > 1e-2


def test_every_motion_of_two_dimensions_is_periodic() -> None:
    problem = vs.Veselova([2, 1], [0.6, 0.8], [0.8, -0.6])
    period = torus(problem).period()
    motion = solve(problem, [0, period / 2, period])
    assert np.allclose(motion.frame[2], motion.frame[0], atol=1e-13)
    assert np.allclose(motion.frame[1], -motion.frame[0], atol=1e-13)


@pytest.mark.parametrize("system", ["neumann", "geodesic", "ball", "area"])
def test_periods_are_in_the_time_of_the_system(system: str) -> None:
    def problem(tilt: float) -> Any:
        if system == "neumann":
            return vs.NeumannSystem(
                A3, [0.6, 0.48, 0.64], [0.8 + tilt, -0.36, -0.48], normalize=True
            )
        if system == "geodesic":
            return vs.EllipsoidGeodesic(A3, [1, 1, 1], [1, -1, 0.2 + tilt], normalize=True)
        Omega = np.array([0.4, 1.0 + tilt, -0.6])
        gamma = np.array([0.6, 0.0, 0.8])
        if system == "ball":
            return vs.RubberBall([1, 2, 3], 1, 0.5, gamma, Omega - gamma * (Omega @ gamma))
        return vs.VeselovaSO3([1, 2, 3], gamma, Omega + 0.3 * gamma)

    def ratio(tilt: float) -> float:
        return float(torus(problem(tilt)).rotation_numbers[1])

    low, high = ratio(0.0), ratio(0.2)
    order = next(m for m in range(2, 400) if int(m * low) != int(m * high))
    target = max(int(order * low), int(order * high)) / order
    found = problem(brentq(lambda tilt: ratio(tilt) - target, 0.0, 0.2, xtol=1e-16))
    period = torus(found).period(max_order=1000)
    name = {"geodesic": "X"}.get(system, "frame")
    motion = solve(found, [0, period])
    assert np.max(np.abs(motion[name][1] - motion[name][0])) < 1e-9 * max(1.0, period)


def test_a_motion_that_does_not_return_is_named() -> None:
    found = torus(vs.Veselova(A3, [0.6, 0.0, 0.8], [0.8, 1.0, -0.6]))
    with pytest.raises(Unsolved, match="not-periodic: the frequencies are in no ratio"):
        found.period()
    resonance = torus(resonant(3 / 2))
    assert resonance.resonance().windings is not None
    assert resonance.resonance().windings.tolist() == [2, 3]  # type: ignore[union-attr]
    with pytest.raises(Unsolved, match="from a document"):
        torus_of(resonance.as_dict()).period()
    assert pickle.loads(pickle.dumps(resonance)).period(10) == resonance.period(10)


@pytest.mark.slow
def test_a_body_in_four_dimensions_returns_too() -> None:
    def body(constants: Any) -> vs.Veselova:
        return vs.from_torus([4, 3, 2, 1], 0.5, constants, [0.1, 0.2, 0.3], [1, 1, 1, 1])

    start = np.array([0.29, 0.45])
    ratios = torus(body(start)).rotation_numbers[1:]
    target = np.rint(ratios * 12) / 12
    solution = root(lambda c: torus(body(c)).rotation_numbers[1:] - target, start, tol=1e-14)
    assert np.max(np.abs(solution.fun)) < 1e-13
    problem = body(solution.x)
    period = torus(problem).period(max_order=50)
    motion = solve(problem, [0, period])
    assert np.max(np.abs(motion.frame[1] - motion.frame[0])) < 1e-9
