"""Bodies with an area constant and rolling balls by the kernel."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import veselova as vs
from problems import BALLS_IN_MORE_DIMENSIONS
from veselova.analytic.closed.motion import kernel_motion
from veselova.analytic.kernel import abel, frame, modes, rate, rule, weights
from veselova.analytic.solve import solve
from veselova.mechanics.core.problem import Problem

Array = np.ndarray[Any, Any]

SYSTEMS = ("veselova-so3", "rubber-ball", "chaplygin-ball")


def draw(rng: np.random.Generator, system: str, size: float = 1.0) -> Any:
    """Return a body in space with any (Ω,γ) that the system has."""
    inertia = np.sort(rng.uniform(0.3, 1.0, 3))
    inertia[2] = min(inertia[2], 0.95 * (inertia[0] + inertia[1]))
    gamma, Omega = rng.normal(size=3), size * rng.normal(size=3)
    if system == "veselova-so3":
        return vs.VeselovaSO3(inertia, gamma, Omega, normalize=True)
    kind, Omega = (
        (vs.ChaplyginBall, Omega)
        if system == "chaplygin-ball"
        else (vs.RubberBall, Omega - (Omega @ gamma) / (gamma @ gamma) * gamma)
    )
    mass, radius = rng.uniform(0.5, 2.0, 2)
    return kind(inertia, mass, radius, gamma, Omega, normalize=True)


def of_bounded(problem: Problem, found: vs.Trajectory, other: vs.Trajectory) -> Array:
    """Return the largest difference of the bounded series at each time."""
    apart = [np.abs(found[name] - other[name]) for name in problem.bounded]
    return np.max([x.reshape(len(found.times), -1).max(axis=1) for x in apart], axis=0)


@pytest.mark.parametrize("system", SYSTEMS)
def test_series_are_those_of_the_functions(system: str, rng: np.random.Generator) -> None:
    """(q',n_2), the odd part of dt/dτ₁ and the rate, by determinants and by the frame."""
    motion = kernel_motion(draw(rng, system).on_torus())
    assert motion is not None
    torus, room = motion.torus, motion.room
    flow = torus.frequencies / torus.mean, np.zeros(2)
    room_of_sums = None
    for which in (weights.RATE, 1, weights.ODD):
        if which == weights.ODD and not torus.tilt[0]:
            continue
        found = modes.make_modes(torus, which, *flow, rule.SIDES[2], rule.MOST_MODES[2])
        assert found.reach[0] >= 0
        room_of_sums = modes.mode_room(found, found)
        values = []
        for psi in rng.uniform(0, 4 * np.pi, (50, 2)):
            z = np.zeros(2)
            abel.abel(torus.angles, psi, z, room.slopes)
            frame.set_frame(torus, psi, room, room.frame, room.velocity)
            slope = modes.sum_modes(found, found.spans[1], found.used[1], z, *room_of_sums)[1]
            even = rate.even_rate(torus, psi)
            direct = {
                weights.RATE: even - torus.mean[0],
                1: room.v[1],
                weights.ODD: -rate.tilted(torus, room.frame) * even,
            }[which]
            values.append((slope, direct))
        sums, direct = np.array(values).T
        assert np.max(np.abs(sums - direct)) < 1e-13 * max(np.max(np.abs(direct)), torus.mean[0])


@pytest.mark.parametrize("system", SYSTEMS)
@pytest.mark.parametrize(
    "times",
    [np.array([-3.0, 0.0, 0.4, 11.0]), np.linspace(0.0, 30.0, 500), np.array([700.0, -2e4])],
    ids=["few", "dense", "far"],
)
def test_bodies_have_the_motions_of_digits(
    system: str, times: Array, rng: np.random.Generator
) -> None:
    problem = draw(rng, system)
    found = vs.solve(problem, times)
    some = np.unique(np.linspace(0, times.size - 1, 4).astype(int))
    exact = vs.solve(problem, times[some], digits=20)
    off = of_bounded(problem, vs.solve(problem, times[some]), exact)
    assert np.all(off <= found.error[some])
    assert np.all(found.error <= 1e-11 * np.maximum(1.0, np.abs(times)))


@pytest.mark.parametrize("system", SYSTEMS)
def test_both_time_maps_lead_to_one_motion(system: str, rng: np.random.Generator) -> None:
    problem, times = draw(rng, system, 3.0), np.linspace(-20.0, 60.0, 33)
    first, second = (solve(problem, times, time_map=name) for name in ("panels", "fourier"))
    assert np.all(of_bounded(problem, first, second) <= first.error + second.error)


@pytest.mark.parametrize("system", SYSTEMS[1:])
@pytest.mark.parametrize("name", ["generic-4", "generic-5", "two-equal"])
def test_balls_in_n_dimensions(name: str, system: str) -> None:
    """Few times, many times and theta quotients."""
    (case,) = (case for case in BALLS_IN_MORE_DIMENSIONS if case.name == name)
    problem, times = case.problem(system), np.linspace(-5.0, 20.0, 400)
    dense, few = vs.solve(problem, times), vs.solve(problem, times[::80])
    theta = vs.solve(problem, times, method="theta")
    assert theta.provenance.method == "theta"
    for other, rows in ((few, slice(None, None, 80)), (theta, slice(None))):
        for name in problem.bounded:
            off = np.abs(dense[name][rows] - other[name]).reshape(len(other.times), -1)
            assert np.all(off.max(axis=1) <= dense.error[rows] + other.error)


@pytest.mark.parametrize("angle", ["0", "1e-40", "1e-25", "1e-12", "1e-6", "1e-3"])
def test_a_momentum_along_gamma(angle: str) -> None:
    """A' is isotropic to the square of the angle, and du/dτ₁ cancels to it."""
    times = [0.5, 3.0, 20.0, 500.0]
    frame = [[0, 1, 0], [0, 0, 1], [1, 0, 0]]
    data = ["1", "1.4", "2"], "0.7", "0.8", ["0", "0", "1"]
    exact = vs.solve(vs.ChaplyginBall(*data, ["0", "0", "2"], frame), times)
    found = vs.solve(vs.ChaplyginBall(*data, [angle, "0", "2"], frame), times)
    apart = of_bounded(found.problem, found, exact)
    assert np.all(apart <= found.error + exact.error + 1e4 * float(angle))
    assert np.max(found.error) < 1e-12
