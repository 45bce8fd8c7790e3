"""Separable potentials in closed form: the family (3.5) on T SO(3), against integration and exact
identities.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from conftest import slow
from deviations import agree
from veselova import InvalidInput, SeparableVeselova, Unsolved, Veselova, VeselovaSO3, solve
from veselova.analytic.curve.moving_part import rationals
from veselova.analytic.separable.curve import SeparableStart
from veselova.analytic.separable.inversion import SeparableMotion

Generator = np.random.Generator

TIMES = np.array([-20.0, -3.0, 0.0, 0.4, 5.0, 20.0])

POTENTIALS: dict[str, Any] = {
    "none": None,
    "clebsch": {"clebsch": 0.5},
    "clebsch-attracting": {"clebsch": -2.0},
    "quartic": {"family": [0.3, 0, 0, 0, 0]},
    "walls": {"family": [0, 0, 0.1, 0.05, 0.1]},
    "one-wall": {"family": [0, 0, 0, 0.1, 0]},
    "all": {"family": [-0.2, 0.5, "0.02", 0.05, 0.1]},
    "sum": {"clebsch": "1/3", "family": [0.1, 0, 0, 0.3, 0]},
}


def drawn(rng: Generator, potential: Any, inertia: Any = None) -> VeselovaSO3:
    moments = rng.uniform(0.3, 2, 3) if inertia is None else inertia
    gamma = rng.normal(size=3)
    gamma /= np.linalg.norm(gamma)
    Omega = rng.normal(size=3)
    return VeselovaSO3(moments, gamma, Omega - (Omega @ gamma) * gamma, potential)


def agreement(problem: VeselovaSO3, times: Any = TIMES) -> Any:
    closed, found = solve(problem, times, "analytic"), solve(problem, times, "numeric", "taylor")
    agree(closed, found, "frame")
    return closed


@pytest.mark.parametrize("seed", [0, *map(slow, range(1, 4))])
@pytest.mark.daily(3)
@pytest.mark.parametrize("name", sorted(POTENTIALS))
def test_the_closed_form_agrees_with_integration(name: str, seed: int) -> None:
    closed = agreement(drawn(np.random.default_rng([20240517, seed]), POTENTIALS[name]))
    assert np.max(closed.error) < 1e-9
    assert max(value for key, value in closed.drift.items() if key != "multiplier") < 1e-12


@pytest.mark.daily(4)
@pytest.mark.parametrize("offset", ["1e-15", "1e-17", "1e-100"])
def test_a_point_beside_an_unstable_equilibrium_does_not_rest(offset: str) -> None:
    """It leaves, and doubles do not say when; beside a stable one it stays to the last digit."""
    start = (["1", "2", "3"], ["1", offset, "0"], [0, 0, 0])
    unstable = SeparableVeselova(*start, {"quadratic": "1"}, normalize=True)
    assert unstable.moves
    for engine in ("analytic", "numeric"):
        with pytest.raises(Unsolved, match=r"separatrix|no-digit-left"):
            solve(unstable, [0.0, 200.0], engine)
    stable = SeparableVeselova(
        ["1", "2", "3"], ["0", offset, "1"], [0, 0, 0], {"quadratic": "1"}, normalize=True
    )
    assert np.max(np.abs(solve(stable, [0.0, 200.0]).q - stable.q)) <= 2 * float(offset) + 1e-15
    exact = SeparableVeselova(["1", "2", "3"], [1, 0, 0], [0, 0, 0], {"quadratic": "1"})
    assert not exact.moves


ATTRACTING = {"family": [0.9, -0.5, 0.2, 0, -0.3]}


@pytest.mark.parametrize(
    ("fields", "outcome"),
    [
        ({"Omega": [0.3, 0.1, 0.2], "potential": {"clebsch": 0.5}}, "not-separable"),
        ({"potential": {"polynomial": [{"coefficient": 1, "powers": [1, 0, 0]}]}}, "not-separable"),
        ({"potential": {"family": [0, 0, -0.1, 0, 0]}}, "collision"),  # before t = 20
        (
            {"gamma": [0.6, 1e-30, 0.8], "Omega": [0, 0.7, 0], "potential": {"clebsch": 0.5}},
            "separatrix",
        ),
        # from q_2 = 0 towards a plane that attracts
        (
            {
                "inertia": [1.2, 0.8, 0.4],
                "gamma": [0.6, 0, -0.8],
                "Omega": [0.4, 0.1, 0.3],
                "potential": ATTRACTING,
            },
            "collision",
        ),
    ],
)
def test_what_has_no_closed_form_is_a_named_outcome(fields: dict[str, Any], outcome: str) -> None:
    gamma = np.array([0.6, 0.48, 0.64])
    data = {
        "inertia": [0.5, 1, 2],
        "gamma": gamma,
        "Omega": np.cross(gamma, [0.1, 0.5, 0.2]),
        **fields,
    }
    with pytest.raises(Unsolved) as caught:
        solve(VeselovaSO3(**data), TIMES, "analytic")
    assert caught.value.outcome == outcome


def test_methods_and_digits_that_it_has_not_are_refused(rng: Generator) -> None:
    problem = drawn(rng, {"clebsch": 0.3})
    required = "for system veselova-so3 with a potential"
    for options, sentence in (
        ({"method": "theta"}, "method: required angles for system veselova-so3; given theta"),
        ({"digits": 30}, f"digits: required 15, not certified, {required}; given 30"),
        ({"certified": True}, f"certified: required false, with 15 digits, {required}; given true"),
    ):
        with pytest.raises(InvalidInput, match=sentence):
            solve(problem, TIMES, "analytic", **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("n", [2, 3, 4, 5])
def test_quadratures_serve_any_dimension(n: int, rng: Generator) -> None:
    """Position and velocity at the start, orthogonal coordinate lines, and q' as a difference along
    the torus.
    """
    inverse = tuple(
        sorted(Fraction(int(x), 1000) for x in rng.choice(np.arange(300, 2000), n, replace=False))
    )
    q = [Fraction(int(x), 1000) for x in rng.integers(200, 900, n)]
    v = [Fraction(int(x), 1000) for x in rng.integers(-900, 900, n)]
    along = sum(a * b for a, b in zip(q, v, strict=True)) / sum(a * a for a in q)
    v = [b - along * a for a, b in zip(q, v, strict=True)]
    walls = tuple(Fraction(int(x), 100) for x in rng.integers(0, 3, n))
    polynomial = tuple(Fraction(0) for _ in range(n - 1)) + (Fraction(-1, 3),)
    start = SeparableStart(*map(rationals, (inverse, q, v, polynomial, walls)))
    motion = SeparableMotion(start)
    at = motion.attitude(motion.angles[None])
    length = np.sqrt(float(sum(x * x for x in q)))
    assert np.allclose(at.q[0], np.array([float(x) for x in q]) / length, atol=1e-13)
    frame = np.column_stack([at.q[0], at.normals[0]])
    assert np.allclose(frame.T @ frame, np.eye(n), atol=1e-12)
    rate = motion.rate(motion.angles[None])[0]
    assert np.allclose(
        at.normals[0] @ at.components[0] / rate,
        np.array([float(x) for x in v]) / length,
        atol=1e-12,
    )
    # dq/dτ along the linear flow on the torus is q' itself: the whole inversion at once.
    origin, step = motion.inversion.at(motion.angles[None])[0][0], 1e-5
    z = origin + np.array([[0.7 - step], [0.7], [0.7 + step]]) * motion.periods.frequencies
    along_flow = motion.attitude(motion.inversion.invert(z))
    difference = (along_flow.q[2] - along_flow.q[0]) / (2 * step)
    assert np.allclose(difference, along_flow.normals[1] @ along_flow.components[1], atol=1e-8)


PARTS: list[Any] = [
    None,
    {"quadratic": 0.4},
    {"quartic": 0.2, "quadratic": "1/3"},
    {"centrifugal": "walls"},
    {"quartic": -0.1, "quadratic": 0.3, "centrifugal": "one"},
]


def point(rng: Generator, n: int, parts: Any) -> SeparableVeselova:
    q, walls = (
        rng.uniform(0.3, 1, n),
        {"walls": rng.uniform(0.005, 0.02, n), "one": [0.01] + [0] * (n - 1)},
    )
    potential = (
        None
        if parts is None
        else {name: walls.get(str(value), value) for name, value in parts.items()}
    )
    return SeparableVeselova(
        rng.uniform(0.6, 2.5, n), q, 0.6 * rng.normal(size=n), potential, normalize=True
    )


def in_dimensions(count: int) -> list[Any]:
    """Return (n, part) for n = 2 … 6: usually every part once."""
    rows = [(n, part) for n in range(2, 7) for part in range(count)]
    return [(n, part) if part == (n - 2) % count else slow(n, part) for n, part in rows]


@pytest.mark.daily(3)
@pytest.mark.parametrize(("n", "part"), in_dimensions(len(PARTS)))
def test_points_in_separable_potentials_are_served_in_any_dimension(
    n: int, part: int, rng: Generator
) -> None:
    problem = point(rng, n, PARTS[part])
    closed, found = solve(problem, TIMES / 2), solve(problem, TIMES / 2, "numeric", "taylor")
    agree(closed, found, "q")
    assert np.allclose(closed.q_dot, found.q_dot, atol=1e-9)
    assert max(closed.drift.values()) < 1e-12
    assert np.max(closed.error) < 1e-10


def test_in_three_dimensions_points_are_the_gamma_of_the_body(rng: Generator) -> None:
    body = drawn(rng, POTENTIALS["all"])
    betas, velocity = [0.02, 0.05, 0.1], np.cross(body.gamma, body.Omega)
    inertia = np.diag(body.inertia)
    # A = 𝓘⁻¹ has the inertia A_iA_j/det A = 𝓘_k, so that both count the same energy.
    problem = SeparableVeselova(
        1 / inertia,
        body.gamma,
        velocity,
        {"quartic": -0.2, "quadratic": 0.5, "centrifugal": betas},
        normalize=True,
    )
    ours, theirs = solve(problem, TIMES), solve(body, TIMES, "analytic")
    assert np.all(np.abs(ours.q - theirs.gamma) <= (ours.error + theirs.error)[:, None])
    assert np.isclose(problem.energy, theirs.integrals["energy"][0] + 0, rtol=1e-12)


def served(problem: SeparableVeselova, times: Any = TIMES) -> None:
    closed, found = solve(problem, times), solve(problem, times, "numeric", "taylor")
    agree(closed, found, "q")


@pytest.mark.parametrize("distance", ["1e-18", "1e-25", "1e-34", "1e-60", "1e-110", "1e-300"])
@pytest.mark.parametrize(("sign", "velocity"), [("", 1), ("", -1), ("-", 1), ("-", -1)])
def test_a_start_next_to_a_plane_goes_where_its_velocity_says(
    sign: str, velocity: int, distance: str
) -> None:
    """λ_s is I_i there to all its digits, so that the sign of q_i says nothing."""
    q = ["0.6", sign + distance, "0.8"]
    for A in ([3, 2, 1], [2, 3, 1], [2, 1, 3]):  # the plane at every place
        served(
            SeparableVeselova(
                A, q, ["0.8", velocity, "-0.6"], {"quadratic": "0.3"}, normalize=True
            ),
            [0.0, 5.0],
        )


IN_PLANES: list[Any] = [
    ([3, 2, 1], [0, 0.6, 0.8], [0, 0.8, -0.6], None),
    ([3, 2, 1], [0, 0.6, 0.8], [0, 0.8, -0.6], {"quadratic": 0.3}),
    ([3, 2, 1], [0.6, 0.8, 0], [0.8, -0.6, 0], {"quadratic": 0.3, "quartic": -0.3}),
    ([3, 2, 1], [0.6, 0, 0.8], [0.8, 0, -0.6], None),  # across which motions are unstable
    ([3, 2, 1], [0.6, 0, 0.8], [0, 0, 0], {"quadratic": 0.3, "centrifugal": [0.1, 0, 0.2]}),
    (
        [7, 3, 2, 1, 5],
        [0.6, 0, 0.8, 0, 0],
        [0.8, 0, -0.6, 0, 0],
        {"quadratic": 0.3, "quartic": 0.2},
    ),
    ([7, 3, 2, 1], [0.6, 0, 0, 0.8], [0, 0, 0.5, 0], {"quadratic": "1/3"}),
    ([3, 2, 1], [1e-70, 0.6, 0.8], [-1e-60, 0.8, -0.6], None),  # as good as in the plane
    ([3, 2, 1], [0.6, 0.8, 1e-72], [0.8, -0.6, 0], {"quadratic": 0.3}),
]


@pytest.mark.parametrize("data", IN_PLANES)
def test_motions_in_coordinate_planes_are_served(data: Any) -> None:
    served(SeparableVeselova(*data, normalize=True), [-3.0, 0.0, 5.0])


def test_attracting_planes_end_a_motion_by_name() -> None:
    problem = SeparableVeselova(
        [1, 2, 3], [0.6, 0.48, 0.64], [0, 0.64, -0.48], {"centrifugal": [-0.1, 0, 0]}
    )
    for options in ({}, {"engine": "numeric"}, {"engine": "numeric", "method": "taylor"}):
        with pytest.raises(Unsolved, match="collision"):
            solve(problem, [0.0, 50.0], **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("n", [2, 3, 4])
def test_far_times_are_those_of_theta_functions_where_there_is_no_potential(
    n: int, rng: Generator
) -> None:
    """Without potential the same motion has digits that theta functions know: the error of far
    times holds against them.
    """
    A, q, v = np.linspace(0.7, 2.1, n) ** 1.1, rng.uniform(0.4, 1.0, n), rng.normal(size=n)
    times = [1e5, 1e7, 1e9]
    found = solve(SeparableVeselova(A, q, v, normalize=True), times)
    known = solve(Veselova(A, q, v, normalize=True), times)
    assert found.provenance.details["time_map"] == "fourier"
    agree(found, known, "q")
    assert np.all(found.error < 1e-12 * np.array(times))


@pytest.mark.parametrize("n", [2, 3, 4])
def test_the_unit_of_A_is_not_in_the_motion(n: int) -> None:
    def solved(power: int) -> Any:
        unit = 2.0**power
        parts = {
            "quartic": 0.3 * unit ** (4 - n),
            "quadratic": -0.2 * unit ** (3 - n),
            "centrifugal": [0.02 * unit ** (2 - n), *[0.0] * (n - 1)],
        }
        A = [unit * a for a in (2.9, 2.1, 1.3, 1.1)[:n]]
        q, velocity = [0.5, -0.6, 0.4, 0.7][:n], [0.3, 0.2, -0.7, 0.1][:n]
        return solve(SeparableVeselova(A, q, velocity, parts, normalize=True), [-3, 7, 50]).q

    for power in (-40, 40):
        assert np.array_equal(solved(power), solved(0))
