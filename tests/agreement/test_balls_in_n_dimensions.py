"""Balls in ℝⁿ, n ≥ 4: every engine, formulation and door through their table, against the ball with
its contact forces; their routes are in test_bodies.py.
"""

from __future__ import annotations

import json
import math
import pickle
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import veselova as vs
from conftest import Server, command_line
from deviations import agree, apart, largest
from problems import BALLS_IN_MORE_DIMENSIONS, BODIES, BallCaseN
from rolling_truth import roll
from veselova import InvalidInput, Unsolved
from veselova.mechanics.systems.catalogue import read_problem

SYSTEMS = ("rubber-ball", "chaplygin-ball")
CASES = {case.name: case for case in BALLS_IN_MORE_DIMENSIONS}

#: What the integration of the ball itself is off by, over lengths and radians of order 20.
TRUTH = 1e-11


@cache
def problem_of(name: str, system: str) -> Any:
    return CASES[name].problem(system)


@cache
def truth(name: str, system: str) -> Any:
    """Return the motion of the ball itself."""
    return roll(problem_of(name, system), CASES[name].times())


@pytest.mark.parametrize("system", SYSTEMS)
@pytest.mark.daily(4)
@pytest.mark.parametrize("name", CASES)
def test_true_errors_never_exceed_reported_ones(name: str, system: str) -> None:
    problem, true = problem_of(name, system), truth(name, system)
    found = vs.solve(problem, CASES[name].times())
    assert found.provenance.engine == "analytic"
    assert np.all(apart(found, true, problem.bounded) <= found.error + TRUTH)
    assert np.max(found.error) < 1e-10
    size = 1 + problem.turning
    assert largest(found.Omega - true.Omega) < 1e-10 * size
    assert largest(found.velocity - true.velocity) < 1e-10 * size
    forces = float(problem.ball.mass) * size**2
    assert largest(found.force - true.force) < 1e-10 * forces
    assert max(found.drift.values()) < 1e-11


@pytest.mark.daily(4)
@pytest.mark.parametrize("system", SYSTEMS)
@pytest.mark.parametrize("name", ["generic-4", "generic-5", "frozen", "heavy"])
def test_every_formulation_integrates_the_same_motion(name: str, system: str) -> None:
    problem, true = problem_of(name, system), truth(name, system)
    for formulation in problem.formulations:
        found = vs.solve(problem, CASES[name].times(), "numeric", formulation=formulation)
        assert np.all(apart(found, true, problem.bounded) <= found.error + TRUTH), formulation
        assert largest(found.Omega - true.Omega) < 1e-9
        assert max(found.drift.values()) < 1e-11


@pytest.mark.daily(3)
@pytest.mark.parametrize("case", [CASES["generic-4"], BODIES[0]], ids=["n = 4", "n = 3"])
@pytest.mark.parametrize("system", SYSTEMS)
def test_taylor_integrates_every_formulation(system: str, case: Any) -> None:
    pytest.importorskip("heyoka")
    problem = case.problem(system)
    expected = vs.solve(problem, [3.0])
    for formulation in problem.formulations:
        found = vs.solve(problem, [3.0], "numeric", "taylor", formulation=formulation)
        assert largest(found.position - expected.position) < 1e-12


@pytest.mark.parametrize("system", SYSTEMS)
def test_along_the_momentum_it_moves_uniformly_and_across_it_hardly(system: str) -> None:
    problem = problem_of("generic-4", system)
    times = np.linspace(0, 3000, 400)
    found = vs.solve(problem, times)
    P = found.integrals["space_momentum"][0]
    energy = found.integrals["energy"][0]
    along = -P[1:] / np.linalg.norm(P)
    speed = 0.8 * 2 * energy / np.linalg.norm(P)  # (p,q̇) = 2·energy for both balls
    moved = found.position - found.position[0]
    assert largest(moved @ along - speed * times) < 1e-12 * 3000 * speed
    assert largest(moved - np.outer(moved @ along, along)) < 3
    assert np.allclose(problem.drift.velocity, speed * along, rtol=0, atol=1e-13)
    assert problem.drift.resonance is None


@pytest.mark.parametrize("system", SYSTEMS)
def test_in_a_resonance_it_drifts_across_as_predicted(system: str) -> None:
    """n = 4 with a frozen direction has two phases; their ratio is made p/q."""
    case = CASES["frozen"]

    def made(angle: float) -> Any:
        gamma = np.array(case.gamma)
        velocity = np.array([math.cos(angle), 0, math.sin(angle), 0])
        velocity -= (velocity @ gamma) / (gamma @ gamma) * gamma
        return BallCaseN("resonant", case.A, gamma, velocity).problem(system)

    def ratio(angle: float) -> float:
        f = vs.torus(made(angle)).frequencies_t
        return float(f[0] / f[1])

    angles = np.linspace(0.1, 3.0, 40)
    ratios = np.array([ratio(angle) for angle in angles])
    found = []
    for p, q in ((3, 4), (4, 5), (5, 6), (5, 7), (3, 2), (4, 3), (5, 3), (7, 4), (2, 1)):
        for k in np.flatnonzero((ratios[:-1] - p / q) * (ratios[1:] - p / q) < 0)[:2]:
            ends = angles[k], angles[k + 1]
            problem = made(brentq(lambda x, aim=p / q: ratio(x) - aim, *ends, xtol=1e-15))
            torus = vs.torus(problem)
            assert torus.close_orbit is not None
            period = torus.close_orbit(np.array([2 * p, 2 * q]))[0]
            measured = np.diff(vs.solve(problem, [0.0, period]).position, axis=0)[0] / period
            assert largest(measured - problem.drift.velocity) < 1e-12
            found.append(problem.drift.resonance is not None)
    assert set(found) == {False, True}


@pytest.mark.parametrize("system", SYSTEMS)
def test_far_times_cost_no_more_digits_than_the_time_itself(system: str) -> None:
    problem = problem_of("generic-4", system)
    found = vs.solve(problem, [1e9])
    assert found.error[0] < 100 * np.finfo(float).eps * 1e9 * problem.drift.speed
    before = vs.solve(problem, [1e9 - 10, 1e9])
    again = CASES["generic-4"].problem(
        system, gamma=before.gamma[0], Omega=before.Omega[0], frame=before.frame[0], position=(0, 0)
    )
    step = vs.solve(again, [10.0])
    assert largest(step.frame - before.frame[1]) <= 3 * before.error[0]
    assert largest(step.position[0] - np.diff(before.position, axis=0)) <= 3 * before.error[0]


@pytest.mark.parametrize("system", SYSTEMS)
@pytest.mark.parametrize("name", ["generic-4", "two-equal", "frozen"])
def test_the_document_holds_attitude_velocity_and_path(name: str, system: str) -> None:
    problem = problem_of(name, system)
    times = np.array([-3.0, 0.0, 1.0, 20.0, 400.0])
    found = vs.solve(problem, times)
    document = vs.closed_form(problem)
    written = vs.ClosedForm.from_json(document.to_json()).at(times)
    agree(found, written, *problem.bounded)
    assert largest(written.Omega - found.Omega) < 1e-10
    broken = json.loads(document.to_json())
    broken["ball"].pop("roots")
    with pytest.raises(InvalidInput, match="roots"):
        vs.ClosedForm.from_json(json.dumps(broken))


def test_both_balls_of_the_same_numbers_share_a_torus() -> None:
    rubber, free = (problem_of("generic-4", system) for system in SYSTEMS)
    added = rubber.ball.added
    products = [x * y for x, y in zip(rubber.ball.moments, free.ball.moments, strict=True)]
    assert products == [added**2] * 6
    # the free ball with the momentum of the other one
    x, q = rubber.ball.roots, rubber.gamma
    p = rubber.frame @ rubber.momentum_in_space
    xi = p / x - (p @ (q / x)) * q
    xi /= q @ (x * q)
    turning = np.outer(x * q, x * xi) / float(added) - np.outer(q, xi)
    other = CASES["generic-4"].problem(
        "chaplygin-ball", Omega=(turning - turning.T).tolist(), normalize=False
    )
    one, two = vs.torus(rubber), vs.torus(other)
    assert np.allclose(one.riemann_matrix, two.riemann_matrix, rtol=1e-13, atol=1e-13)
    assert np.allclose(one.constants, two.constants, rtol=1e-12)


@pytest.mark.parametrize("system", SYSTEMS)
def test_a_skew_matrix_states_the_same_velocity(system: str) -> None:
    problem = problem_of("generic-4", system)
    omega = np.zeros((4, 4))
    omega[np.triu_indices(4, 1)] = problem.Omega
    same = CASES["generic-4"].problem(system, Omega=omega - omega.T, normalize=True)
    assert np.allclose(same.Omega, problem.Omega, rtol=1e-14, atol=1e-15)


def test_more_digits_are_refused_by_name() -> None:
    for system in SYSTEMS:
        for options in ({"digits": 30}, {"certified": True}):
            with pytest.raises(InvalidInput, match="contact point"):
                vs.solve(problem_of("generic-4", system), [1.0], **options)
        with pytest.raises(Unsolved, match="separatrix"):
            _ = problem_of("separatrix", system).drift
    assert np.array_equal(problem_of("at-rest", "rubber-ball").drift.velocity, np.zeros(3))


@pytest.mark.parametrize("system", SYSTEMS)
def test_it_passes_every_door(system: str, server: Server) -> None:
    problem = problem_of("generic-4", system)
    document = problem.as_request()
    assert type(read_problem(document)) is type(pickle.loads(pickle.dumps(problem)))
    times = [0.0, 1.0, 5.0]
    expected = vs.solve(problem, times)
    ask = {"problem": document, "times": times}
    answer = server.ask("POST", "/v1/trajectories", json=ask).json()
    for name in problem.outputs:
        assert np.allclose(answer["series"][name], expected.series(name), rtol=0, atol=1e-11)
    assert server.ask("POST", "/v1/comparisons", json=ask).json()["agrees"]
    torus = server.ask("POST", "/v1/tori", json={"problem": document}).json()
    assert torus["frequencies_t"] == vs.torus(problem).frequencies_t.tolist()
    closed = server.ask("POST", "/v1/closed-forms", json={"problem": document}).json()
    assert closed["ball"]["roots"] == problem.ball.roots.tolist()
    with vs.Client(server.url) as client:
        found = client.trajectory(problem, times)
        assert np.array_equal(found.position, expected.position)
    printed = command_line("solve", "-", "--json", stdin=ask)
    assert json.loads(printed.stdout)["series"]["force"][2] == expected.force[2].tolist()
