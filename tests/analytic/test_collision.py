"""Motions that run into a plane where the potential is −∞: answered up to the collision, which is
named beyond.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import orjson
import pytest
from scipy.integrate import quad

from conftest import Server
from deviations import agree
from veselova import SeparableVeselova, Unsolved, solve
from veselova.mechanics.geometry import integrals_of_motion as integrals


def time_named(problem: Any, time: float, method: str | None = None) -> tuple[str, float]:
    """Return the plane and the time in the refusal of a time."""
    with pytest.raises(Unsolved, match=r"^collision: the motion runs into ") as caught:
        solve(problem, [0.0, time], None if method is None else "numeric", method)
    found = re.search(r"into (.*) = 0 at .*t = ([-\d.e]+), where", str(caught.value))
    assert found is not None
    return found[1], float(found[2])


def has_closed_form(problem: Any) -> bool:
    """Return whether the closed form serves a motion; it names a collision otherwise."""
    try:
        solve(problem, [0.0], "analytic")
    except Unsolved as refused:
        if refused.outcome != "collision":
            raise
        return False
    return True


def test_the_time_of_a_plane_collision_is_the_quadrature_of_energy() -> None:
    """n = 2: T = ½M(φ)φ'², so t = ∫ √(M/(2(h−V))) dφ."""
    A = np.array([2.0, 0.7])
    start, speed = 0.9, -0.4
    q = np.array([np.cos(start), np.sin(start)])
    tangent = np.array([-q[1], q[0]])
    potential = {"quadratic": 0.3, "centrifugal": [0, -0.1]}
    problem = SeparableVeselova(A, q, speed * tangent, potential, normalize=True)

    def slowness(root: float) -> float:
        phi = root * root  # q_2 = sin φ: V is −∞ at φ = 0, and dφ = 2√φ d√φ
        x = np.array([np.cos(phi), np.sin(phi)])
        M = 2 * float(integrals.energy(A, x, np.array([-x[1], x[0]])))
        V = float(problem.separable_potential.value(A, x))
        return float(2 * root * np.sqrt(M / (2 * (problem.energy - V))))

    expected = quad(slowness, 0, np.sqrt(start), epsabs=1e-13, epsrel=1e-13)[0]
    assert abs(time_named(problem, 10.0)[1] - expected) < 1e-6


def test_planes_that_are_not_reached_end_nothing() -> None:
    """A root of R keeps the coordinate away from an attracting plane."""
    problem = SeparableVeselova(
        [1, 2, 3], ["0.7", "0.1", "0.1"], [1, -1, 1],
        {"quadratic": -1, "centrifugal": ["-0.001", 0, 0]}, normalize=True,
    )  # fmt: skip
    times = [-30.0, 30.0]
    closed, found = solve(problem, times, "analytic"), solve(problem, times, "numeric", "taylor")
    agree(closed, found, "q")


def test_every_door_answers_before_the_collision_and_names_it_beyond(server: Server) -> None:
    document = {
        "system": "separable",
        "A": [1, 2, 3],
        "q": [0.6, 0.48, 0.64],
        "q_dot": [0.48, -0.6, 0],
        "potential": {"centrifugal": [0, 0, -0.2]},
    }
    problem = SeparableVeselova(*(document[name] for name in ("A", "q", "q_dot", "potential")))
    end = time_named(problem, 100.0)[1]
    ask = {"problem": document, "times": [0, 0.9 * end]}
    answer = server.ask("POST", "/v1/trajectories", json=ask)
    assert answer.status_code == 200
    assert orjson.loads(answer.content)["engine"] == "numeric"
    refused = server.ask("POST", "/v1/trajectories", json={**ask, "times": [2 * end]})
    assert refused.status_code == 422
    assert "collision" in refused.text
    assert f"t = {end:.7g}" in refused.text


@pytest.mark.parametrize("beta", ["1e-30", "3.87e-152", "1e-200"])
def test_the_weakest_wall_repels(beta: str) -> None:
    """Its turning point is nearer to the plane than roots have digits, and on the side of the
    point.
    """
    rng = np.random.default_rng(2)
    for _ in range(6):
        q, v = rng.uniform(0.3, 1, 3), rng.normal(size=3)
        A = np.sort(rng.uniform(0.4, 3, 3))
        for signs in ((1, 1, 1), (1, -1, 0), (0, 0, -1)):
            betas = [f"{'-' * (sign < 0)}{beta}" if sign else "0" for sign in signs]
            problem = SeparableVeselova(A, q, v, {"centrifugal": betas}, normalize=True)
            assert has_closed_form(problem) or -1 in signs
