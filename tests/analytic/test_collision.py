"""Motions that run into a plane where the potential is −∞, in closed form up to the collision."""

from __future__ import annotations

import re
from fractions import Fraction
from typing import Any

import numpy as np
import orjson
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad

from conftest import Server, slow
from separable_truth import true_motion_in_potential
from veselova import SeparableVeselova, Unsolved, VeselovaSO3, solve
from veselova.analytic.separable.periods import SeparatedPeriods
from veselova.mechanics.geometry import integrals_of_motion as integrals

Array = NDArray[np.float64]

#: Parts of the time to a collision, down to where q_i is about 1e-6.
PARTS = 1 - np.logspace(-13, -0.05, 9)


def attracted(rng: np.random.Generator, n: int, speed: float) -> SeparableVeselova:
    """Return a point that one plane attracts, and others perhaps."""
    betas = rng.choice([0, 0.01, -0.02, -0.1, 0.1], n)
    betas[rng.integers(n)] = -0.05
    potential = {"quadratic": float(rng.choice([0, 0.5, -0.5])), "centrifugal": betas.tolist()}
    q = rng.uniform(0.2, 1, n) * rng.choice([-1, 1], n)
    velocity = speed * rng.normal(size=n)
    return SeparableVeselova(rng.uniform(0.4, 3, n), q, velocity, potential, normalize=True)


def collisions_of(problem: Any) -> tuple[float, float] | None:
    """Return the times of the collisions before and after the start, from the closed form."""
    found = solve(problem, [0.0], "analytic").provenance.details.get("collisions")
    return None if found is None else (found[0], found[1])


def times_between(ends: tuple[float, float], parts: Array = PARTS) -> Array:
    return np.sort(np.concatenate([ends[0] * parts, [0.0], ends[1] * parts]))


def solve_up_to(problem: Any, ends: tuple[float, float]) -> Any:
    """Return the motion up to both collisions. The last time before one, 1e-13 of the way from it,
    may be nearer than the error of its time: then it is refused by name.
    """
    try:
        return solve(problem, times_between(ends))
    except Unsolved as refused:
        if refused.outcome != "collision":
            raise
        return solve(problem, times_between(ends, PARTS[1:]))


def time_named(problem: Any, time: float, engine: str | None = None) -> tuple[str, float]:
    """Return the plane and the time in the refusal of a time."""
    with pytest.raises(Unsolved, match=r"^collision: the motion runs into ") as caught:
        solve(problem, [time], engine)
    found = re.search(r"into (.*) = 0 at .*t = ([-\d.e]+), where", str(caught.value))
    assert found is not None
    return found[1], float(found[2])


@pytest.mark.parametrize("seed", [0, 1, *map(slow, range(2, 12))])
@pytest.mark.parametrize("n", [2, 3, 4, slow(5), slow(6)])
def test_the_error_holds_up_to_the_collision(n: int, seed: int) -> None:
    """Against binary128, with coordinates that turn before it and without."""
    rng = np.random.default_rng([n, seed])
    turned = set()
    for speed in (0.0, 0.3, 2.0):
        problem = attracted(rng, n, speed)
        ends = collisions_of(problem)
        if ends is None:
            continue
        closed = solve_up_to(problem, ends)
        exact = problem.exact
        q, _ = true_motion_in_potential(
            exact.A, exact.q, exact.tangent, problem.potential, closed.times
        )
        assert np.all(np.max(np.abs(closed.q - q), axis=1) <= closed.error)
        assert np.max(closed.error[2:-2]) < 1e-6  # like ε/q_i
        assert np.max(closed.error[5:-5]) < 1e-10
        nearest = int(np.argmin(np.abs(q[-1])))
        distances = np.abs(q[closed.times >= 0][:, nearest])
        turned.add(bool(np.max(distances) > distances[0]))
    assert turned


def test_points_turn_before_the_collision_or_go_straight_to_it() -> None:
    """The same start with opposite velocities: what comes after one is what came before the
    other.
    """
    data: list[Any] = [[1, 2, 3], ["0.5", "-0.4", "0.6"]]
    potential = {"quadratic": "1/3", "centrifugal": [0, "-0.05", "0.01"]}
    v = np.array([0.1, 0.6, 0.3])
    inward, outward = (
        SeparableVeselova(*data, sign * v, potential, normalize=True) for sign in (1, -1)
    )
    straight, back = (collisions_of(problem) for problem in (inward, outward))
    assert straight is not None
    assert back is not None
    assert np.allclose([straight[1], straight[0]], [-back[0], -back[1]], rtol=1e-12)
    assert straight[1] < back[1]
    towards = solve(inward, np.linspace(0, 0.99 * straight[1], 20)).q[:, 1]
    assert np.all(np.diff(np.abs(towards)) < 0)
    away = np.abs(solve(outward, np.linspace(0, 0.99 * back[1], 20)).q[:, 1])
    assert 0 < int(np.argmax(away)) < 19


@pytest.mark.parametrize("seed", [0, 1, *map(slow, range(2, 10))])
@pytest.mark.parametrize("n", [2, 3, 4, slow(5)])
def test_both_engines_name_the_same_plane_and_time(n: int, seed: int) -> None:
    rng = np.random.default_rng([7, n, seed])
    ends = None
    while ends is None:
        problem = attracted(rng, n, 1.0)
        ends = collisions_of(problem)
    for end in ends:
        ours, theirs = (time_named(problem, 1.5 * end, engine) for engine in (None, "numeric"))
        assert ours[0] == theirs[0]
        assert abs(ours[1] - theirs[1]) < 1e-6 * abs(theirs[1])
        assert abs(ours[1] - end) < 1e-11 * abs(end)
        assert time_named(problem, end)[1] == ours[1]
        solve(problem, [end * (1 - 1e-11)])
    with pytest.raises(Unsolved, match="collision"):  # one such time among others
        solve(problem, [0.0, 2 * ends[1]])


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
    assert abs(time_named(problem, 10.0)[1] - expected) < 1e-11


@pytest.mark.parametrize(("quartic", "times"), [(0, (-0.2, 1.0)), ("-0.137", (-1e-3, 2e-3))])
def test_other_coordinates_oscillate_many_times_before_it(
    quartic: Any, times: tuple[float, float]
) -> None:
    """33 cycles of the fastest; and 3000, of which only the part that is asked for is covered."""
    problem = SeparableVeselova(
        ["1/500", 50, 50_000_000, 100],
        [-0.65, 0.22, -0.54, -0.49],
        [0.1, 0.7, -0.1, 0.3],
        {"quartic": quartic, "centrifugal": ["0.002", "-0.008", "0.003", "-0.007"]},
        normalize=True,
    )
    closed = solve(problem, times)
    assert ("collisions" in closed.provenance.details) == (quartic == 0)
    exact = problem.exact
    q, _ = true_motion_in_potential(
        exact.A, exact.q, exact.tangent, problem.potential, np.array(times)
    )
    assert np.all(np.max(np.abs(closed.q - q), axis=1) <= closed.error)
    assert np.max(closed.error) < 1e-10


@pytest.mark.parametrize("seed", [0, 1, *map(slow, range(2, 12))])
def test_frames_of_bodies_are_right_up_to_the_collision(seed: int) -> None:
    """γ, and e_2 and e_3, which are carried along it."""
    rng = np.random.default_rng([11, seed])
    A = [Fraction(int(x), 1000) for x in rng.integers(400, 3000, 3)]
    gamma = [Fraction(*x) for x in ((2, 7), (3, 7), (-6, 7))]
    Omega = np.cross([float(x) for x in gamma], rng.integers(-900, 900, 3) * 7)
    Omega_exact = [Fraction(round(x), 1000) for x in Omega]
    alphas = [Fraction(0), Fraction(1, 3), *(Fraction(int(x), 1000) for x in (-50, 20, -10))]
    body = VeselovaSO3(
        [str(1 / a) for a in A],
        [str(x) for x in gamma],
        [str(x) for x in Omega_exact],
        {"family": [str(x) for x in alphas]},
    )
    assert body.linear == 0
    ends = collisions_of(body)
    assert ends is not None
    closed = solve_up_to(body, ends)
    velocity = [
        gamma[i - 2] * Omega_exact[i - 1] - gamma[i - 1] * Omega_exact[i - 2] for i in range(3)
    ]
    potential = (alphas[0], alphas[1], alphas[2:])
    q, e = true_motion_in_potential(A, gamma, velocity, potential, closed.times, body.frame[:, 1:])
    frame = np.concatenate([q[:, :, None], e], axis=2)
    assert np.all(np.max(np.abs(closed.frame - frame), axis=(1, 2)) <= closed.error)
    assert np.max(closed.error[6:-6]) < 5e-9


@pytest.mark.parametrize("small", ["-1e-3", "7.8e-7", "1e-9", "1e-12"])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_beside_a_plane_two_coordinates_share_it(small: str, axis: int) -> None:
    """q_i is small, the point hardly leaves the plane, and where I_i is in the middle both
    coordinates run into it: their intervals are 1e-13 and 0.06 wide, phases swing by 1e5 cycles.
    """
    q: list[Any] = ["0.45", "0.89"]
    betas: list[Any] = ["-0.5", 0]
    q.insert(axis, small)
    betas.insert(axis, "-0.123")
    potential = {"quartic": "-0.585", "quadratic": "0.72", "centrifugal": betas}
    A = ["0.92", "0.84", "0.776"]
    problem = SeparableVeselova(A, q, ["0.3", "0.5", "-0.2"], potential, normalize=True)
    ends = collisions_of(problem)
    assert ends is not None
    closed = solve(problem, np.array([0.9, 0.5]) * ends)
    exact = problem.exact
    truth, _ = true_motion_in_potential(
        exact.A, exact.q, exact.tangent, problem.potential, closed.times
    )
    assert np.all(np.max(np.abs(closed.q - truth), axis=1) <= closed.error)
    assert np.max(closed.error) < 1e-11


def test_angles_without_a_remedy_name_no_theta_quotients() -> None:
    """These have none in a potential."""
    assert SeparatedPeriods.without_angles == "integrate numerically"


def test_frames_beside_a_plane_are_right() -> None:
    """All that the body turns by is far below a radian, and values next to the plane have no
    digit.
    """
    body = VeselovaSO3(
        ["1.19", "1.288", "1.087"],
        ["-1e-6", "0.45", "0.89"],
        [0, "0.89", "-0.45"],
        {"family": ["0.72", "-0.123", "-0.526", "0.833", "-0.26"]},
        normalize=True,
    )
    ends = collisions_of(body)
    assert ends is not None
    closed = solve(body, np.array([0.9, 0.5]) * ends)
    truth = solve(body, closed.times, "numeric", "taylor")
    off = np.max(np.abs(closed.frame - truth.frame), axis=(1, 2))
    assert np.all(off <= closed.error + truth.error)
    assert np.max(closed.error) < 1e-12


def test_planes_that_are_not_reached_end_nothing() -> None:
    """A root of R keeps the coordinate away from an attracting plane."""
    problem = SeparableVeselova(
        [1, 2, 3], ["0.1", "0.7", "0.7"], [2.0, -1.0, 1.0],
        {"centrifugal": ["1", "-0.001", 0]}, normalize=True,
    )  # fmt: skip
    ends = collisions_of(problem)
    times = [-30.0, 30.0] if ends is None else [0.9 * ends[0], 0.9 * ends[1]]
    closed, found = solve(problem, times), solve(problem, times, "numeric", "taylor")
    assert np.all(np.max(np.abs(closed.q - found.q), axis=1) <= closed.error + found.error)


def test_every_door_answers_before_the_collision_and_names_it_beyond(server: Server) -> None:
    document = {
        "system": "separable",
        "A": [1, 2, 3],
        "q": [0.6, 0.48, 0.64],
        "q_dot": [0.48, -0.6, 0],
        "potential": {"centrifugal": [0, 0, -0.2]},
    }
    problem = SeparableVeselova(*(document[name] for name in ("A", "q", "q_dot", "potential")))
    ends = collisions_of(problem)
    assert ends is not None
    ask = {"problem": document, "times": [0.9 * ends[0], 0.9 * ends[1]]}
    answer = server.ask("POST", "/v1/trajectories", json=ask)
    assert answer.status_code == 200
    assert orjson.loads(answer.content)["engine"] == "analytic"
    refused = server.ask("POST", "/v1/trajectories", json={**ask, "times": [2 * ends[1]]})
    assert refused.status_code == 422
    assert "collision" in refused.text
    assert f"t = {ends[1]:.12g}" in refused.text


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
            collides = collisions_of(problem) is not None
            assert collides <= (-1 in signs)
