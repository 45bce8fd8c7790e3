"""Both engines through the problem table: reference motions, agreement, honest
errors, far times.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np
import pytest

from conftest import slow
from draws import adversarial_start, random_problem
from generic_torus import fastest
from problems import TABLE, Case, tagged
from truth import true_motion
from veselova import (
    EllipsoidGeodesic,
    EulerPoisson,
    Unsolved,
    Veselova,
    VeselovaSO3,
    compare,
    solve,
    torus,
)
from veselova.analytic.solve import solve as solve_analytic
from veselova.mechanics.core.problem import Problem

METHODS = [
    ("analytic", "theta"),
    ("analytic", "angles"),
    ("numeric", "dop853"),
    ("numeric", "taylor"),
]
SOLVABLE = [case for case in TABLE if "at-rest" not in case.tags]

#: Cases of every kind, for what is tested of every method.
CHOSEN = (
    "random-n2-0",
    "random-n3-0",
    "random-n4-0",
    "axis-start",
    "symmetric-two",
    "near-separatrix-1e-06",
    "umbilic",
    "fast",
)

#: What a known motion, or an integration, takes seconds or minutes for.
LONG = ("eight", "wide-ratio", "ratio-100", "random-n6-0", "rising-A")


def table(cases: Sequence[Case], methods: Sequence[tuple[str, ...]] = ((),)) -> list[Any]:
    """Return the rows of a test of cases, by methods: usually the first method for most cases, the
    others for some.
    """
    usual = {case.name: {methods[0]} if case.name not in LONG else set() for case in cases}
    usual |= {name: set(methods) for name in CHOSEN}
    return [
        pytest.param(
            case,
            *method,
            id="-".join(map(str, (case.name, *method))),
            marks=() if method in usual[case.name] else pytest.mark.slow,
        )
        for case in cases
        for method in methods
    ]


@cache
def truth(case: Case) -> Any:
    problem = case.problem()
    frame, q_dot, tau1 = true_motion(
        problem, case.times(), case.frame if "reference" in case.tags else None
    )
    return problem.to_body_axes(frame), problem.to_body_axes(q_dot), tau1


def reference(case: Case) -> tuple[Any, Any, Any, Any]:
    columns = [
        np.array([[float(x) for x in np.ravel(point[name])] for point in case.points])
        for name in ("frame", "q_dot")
    ]
    times, tau1 = (
        np.array([float(point[name]) for point in case.points]) for name in ("t", "tau1")
    )
    n = len(case.A)
    return times, columns[0].reshape(-1, n, n), columns[1], tau1


@pytest.mark.parametrize("case", table(tagged("reference")))
def test_truth_reproduces_the_reference_motions(case: Case) -> None:
    times, frame, q_dot, tau1 = reference(case)
    found = true_motion(case.problem(), times, case.frame)
    assert np.max(np.abs(found[0] - frame)) <= 3e-16
    assert np.max(np.abs(found[1] - q_dot)) <= 1e-15 * np.max(np.abs(q_dot))
    assert np.max(np.abs(found[2] - tau1)) <= 1e-15 * np.max(np.abs(tau1))


@pytest.mark.parametrize("method", ["theta", "angles"])
@pytest.mark.parametrize("case", tagged("reference"), ids=lambda case: case.name)
def test_the_analytic_engine_reaches_the_reference_motions(case: Case, method: str) -> None:
    times, frame, q_dot, tau1 = reference(case)
    found = solve(case.problem(), times, "analytic", method)
    allowed = 1e-12 * np.maximum(1.0, np.sqrt(times))
    if case.name == "slow":  # |q̇| is 1e-3: the turning, not the time, is what counts
        allowed = np.full(times.size, 1e-12)
    assert np.all(np.max(np.abs(found.frame - frame), axis=(1, 2)) <= allowed)
    assert np.all(
        np.max(np.abs(found.q_dot - q_dot), axis=1) <= allowed * max(1.0, np.max(np.abs(q_dot)))
    )
    assert np.all(np.abs(found.tau1 - tau1) <= allowed * np.maximum(1.0, tau1))


@pytest.mark.parametrize(("method", "bound"), [("dop853", 1e-8), ("taylor", 1e-12)])
@pytest.mark.parametrize("case", tagged("reference"), ids=lambda case: case.name)
def test_the_numeric_engine_reaches_the_reference_motions(
    case: Case, method: str, bound: float
) -> None:
    times, frame, _, tau1 = reference(case)
    found = solve(case.problem(), times, "numeric", method)
    allowed = bound * (np.maximum(1.0, times) if method == "taylor" else 1.0)
    assert np.all(np.max(np.abs(found.frame - frame), axis=(1, 2)) <= allowed)
    assert np.all(np.abs(found.tau1 - tau1) <= allowed * np.maximum(1.0, tau1))


#: Beside a separatrix, or with neighbours beside one: there angles are refused by name.
NARROW = ("umbilic", "near-umbilic", "narrow-frozen-cut", "hardly-moving-axis")


@pytest.mark.parametrize(("case", "engine", "method"), table(SOLVABLE, METHODS))
def test_true_errors_never_exceed_reported_ones(case: Case, engine: str, method: str) -> None:
    if method == "angles" and case.name in NARROW:
        with pytest.raises(Unsolved) as raised:
            solve(case.problem(), case.times(), engine, method)
        assert raised.value.outcome == "narrow-gap"
        return
    found = solve(case.problem(), case.times(), engine, method)
    frame, q_dot, tau1 = truth(case)
    error = np.max(np.abs(found.frame - frame), axis=(1, 2))
    assert np.all(error <= found.error)
    assert np.all(np.abs(found.q - frame[:, :, 0]) <= found.error[:, None])
    speed = np.max(np.linalg.norm(q_dot, axis=1))
    assert np.all(np.max(np.abs(found.q_dot - q_dot), axis=1) <= 20 * found.error * speed)
    assert np.all(np.abs(found.tau1 - tau1) <= 20 * found.error * (1 + np.max(np.abs(tau1))))


@pytest.mark.parametrize(("case", "engine", "method"), table(tagged("generic"), METHODS))
def test_what_must_hold_at_every_time_does(case: Case, engine: str, method: str) -> None:
    problem = case.problem()
    found = solve(problem, case.times(20), engine, method)
    n, E = problem.n, found.frame
    assert np.max(np.abs(np.swapaxes(E, 1, 2) @ E - np.eye(n))) <= 1e-13
    space = np.swapaxes(E, 1, 2) @ found.omega @ E
    # the constraint (44)
    assert np.max(np.abs(space[:, 1:, 1:])) <= 1e-13 * np.max(np.abs(found.omega))
    assert np.array_equal(found.q, E[:, :, 0])
    assert np.all(np.diff(found.tau1) > 0)
    assert np.all(np.diff(found.spheroconic, axis=1) > 0)
    assert max(found.drift.values()) < 1e-8


@pytest.mark.parametrize(
    ("case", "engine", "bound"), table(tagged("generic"), [("analytic", 1e-11), ("numeric", 1e-8)])
)
def test_errors_are_not_empty_promises(case: Case, engine: str, bound: float) -> None:
    """Errors stay useful: at |ωt| of order 50, below 1e-11 in closed form and 1e-8 by DOP853."""
    assert np.max(solve(case.problem(), case.times(), engine).error) < bound


@pytest.mark.parametrize("case", table(tagged("generic")))
def test_the_engines_agree_within_their_errors(case: Case) -> None:
    comparison = compare(case.problem(), case.times(), "taylor")
    assert comparison.agrees
    assert comparison.deviation["frame"] < 1e-11
    assert np.all(comparison.conditioning_floor > 0)


@pytest.mark.parametrize("engine", ["analytic", "numeric"])
def test_a_body_at_rest_stands_still(engine: str) -> None:
    problem = tagged("at-rest")[0].problem()
    found = solve(problem, [-1, 0, 1e9], engine)
    assert np.array_equal(found.frame, np.tile(problem.frame, (3, 1, 1)))
    assert not found.tau1.any()
    with pytest.raises(Unsolved, match="at-rest"):
        torus(problem)


@pytest.mark.parametrize("seed", [*range(8), *map(slow, range(8, 28))])
def test_adversarial_starts_are_served_honestly(seed: int) -> None:
    name, problem = adversarial_start(np.random.default_rng([2024, seed]), 2 + seed % 4)
    times = np.array([-5, 0, 0.1, 1, 5]) * min(
        1 / float(np.max(np.abs(problem.q_dot))), 2 / fastest(problem)
    )
    found = solve(problem, times)
    frame = true_motion(problem, times)[0]
    assert np.all(np.max(np.abs(found.frame - frame), axis=(1, 2)) <= found.error), name
    assert np.max(found.error) < 1e-9, name


@pytest.mark.parametrize("method", ["theta", slow("angles")])
@pytest.mark.parametrize("count", [0, 3000])
def test_very_wide_inertia_is_served_honestly_by_every_route(method: str, count: int) -> None:
    """A's over eight orders of magnitude: q from theta quotients would tell dt/dτ₁ to
    1e-12 only.
    """
    A, q = ["12854689", "68561808", "0.35321", "55950.258"], ["-0.677", "-0.143", "-0.921", "0.396"]
    problem = Veselova(A, q, ["0.345", "-0.448", "-0.006", "0.415"], normalize=True)
    wanted = np.linspace(-0.01, 0.01, 9)
    times = np.unique(np.concatenate([wanted, np.linspace(-0.01, 0.01, count)]))
    found = solve(problem, times, method=method)
    rows = np.searchsorted(times, wanted)
    error = np.max(np.abs(found.frame[rows] - true_motion(problem, wanted)[0]), axis=(1, 2))
    assert np.all(error <= found.error[rows])


def test_a_separatrix_is_followed_as_long_as_the_data_determine_it() -> None:
    case = tagged("separatrix")[0]
    times = np.linspace(0, 14, 29)
    found = solve(case.problem(), times)
    assert found.provenance.details["regime"] == "separatrix"
    assert np.max(found.error) < 1e-10
    frame = true_motion(case.problem(), times)[0]
    assert np.all(np.max(np.abs(found.frame - frame), axis=(1, 2)) <= found.error)
    with pytest.raises(Unsolved, match="no-digit-left"):
        solve(case.problem(), [1.0, 1000.0])


@pytest.mark.parametrize(
    "problem",
    [
        Veselova([3, 2, 1], [0, 1, 0], [1, 0, 3]),
        EllipsoidGeodesic([3, 2, 1], [0, 1, 0], [1, 0, 1], normalize=True),
    ],
    ids=["veselova", "ellipsoid-geodesic"],
)
def test_a_separatrix_through_the_middle_axis_is_served(problem: Problem) -> None:
    # alone on its axis, q has no scale that would open the closed gap
    times = np.array([-4.0, -1.0, 0.0, 1.0, 4.0])
    found = solve(problem, times)
    assert found.provenance.details["regime"] == "separatrix"
    integrated = solve(problem, times, engine="numeric", method="taylor")
    off = np.max(np.abs(found.frame - integrated.frame), axis=(1, 2))
    assert np.all(off <= found.error + integrated.error)
    assert np.max(found.error) < 1e-10


@pytest.mark.parametrize("method", ["taylor", slow("dop853")])
@pytest.mark.parametrize(
    ("inertia", "gamma", "Omega"),
    [
        (
            ["0.05514807257486351", "2.301471983045774e-08", "4.167951611415536e-05"],
            ["0.317", "0.308", "0.257"],
            ["0.193419", "-0.218073", "0.022773"],
        ),
        (
            ["1.5365228272384487e-08", "0.14239740267137527", "1.0314595152140278"],
            ["-0.47", "0.096", "-0.467"],
            ["-0.035969", "-0.739991", "-0.115918"],
        ),
    ],
)
def test_integration_of_wide_inertia_is_honest(
    method: str, inertia: Any, gamma: Any, Omega: Any
) -> None:
    problem = VeselovaSO3(inertia, gamma, Omega, normalize=True)
    times = np.array([-10, -3, -1.5, 0, 0.1, 0.7, 1, 3, 4, 7, 10]) / problem.turning / 2
    exact = solve(problem, times)
    found = solve(problem, times, engine="numeric", method=method)
    off = np.max(np.abs(found.frame - exact.frame), axis=(1, 2))
    assert np.all(off <= found.error + exact.error)


def test_far_times_are_those_of_another_scale() -> None:
    """The same motion at another scale of A and of time, whose roundings are others, shows the
    error at any distance.
    """
    problem = Veselova([3, 2, "1.5", 1], ["0.5"] * 4, ["1.1", "-0.7", "0.3", "-0.7"])
    scaled = Veselova([9, 6, "4.5", 3], ["0.5"] * 4, ["3.3", "-2.1", "0.9", "-2.1"])
    for t in (3.0, 3e9, 3e11):
        one, other = solve(problem, [t]), solve(scaled, [t / 3])
        if 3 * (t / 3) == t:
            assert np.max(np.abs(one.frame - other.frame)) <= one.error + other.error
        assert np.max(np.abs(np.swapaxes(one.frame, 1, 2) @ one.frame - np.eye(4))) < 1e-13
    for t in (1e16, 1e302):
        for engine in ("analytic", "numeric"):
            with pytest.raises(Unsolved, match="too-far"):
                solve(problem, [t], engine)


def test_a_matrix_of_inertia_adds_the_rounding_of_its_axes() -> None:
    """R diag(3,2,1) Rᵀ with rational R, against the same body in principal axes, where roundings of
    the data show.
    """
    first, second = (
        np.array([[3, -4, 0], [4, 3, 0], [0, 0, 5]]),
        np.array([[13, 0, 0], [0, 5, -12], [0, 12, 5]]),
    )
    R = [[Fraction(int(x), 65) for x in row] for row in first @ second]
    A = [
        [sum(R[i][k] * (3, 2, 1)[k] * R[j][k] for k in range(3)) for j in range(3)]
        for i in range(3)
    ]
    q, q_dot = (
        [Fraction(3, 5), Fraction(0), Fraction(4, 5)],
        [Fraction(4, 5), Fraction(1), Fraction(-3, 5)],
    )
    turned = [[sum(R[i][k] * x[k] for k in range(3)) for i in range(3)] for x in (q, q_dot)]
    for t in (50.0, 1e3, 1e6):
        plain, rotated = solve(Veselova([3, 2, 1], q, q_dot), [t]), solve(Veselova(A, *turned), [t])
        expected = np.array(R, dtype=float) @ plain.q[0]
        assert np.max(np.abs(rotated.q[0] - expected)) <= rotated.error[0] + plain.error[0]


@pytest.mark.parametrize(("n", "cycles"), [(5, 150), (7, 120)])
def test_panels_go_far_and_back(n: int, cycles: float, rng: np.random.Generator) -> None:
    """To a time of many cycles and, from the state there, home again: two curves, two starts, two
    clocks.
    """
    problem = random_problem(rng, n)
    t = cycles / fastest(problem)
    there = solve_analytic(problem, [t], time_map="panels")
    home = solve_analytic(
        Veselova(problem.A, there.q[0], there.q_dot[0], there.frame[0], normalize=True),
        [-t],
        time_map="panels",
    )
    floor = problem.conditioning_floor(np.array([t]))[0]
    assert np.max(np.abs(home.frame[0] - problem.frame)) <= 100 * floor
    assert np.isclose(home.tau1[0], -there.tau1[0], rtol=1e-11)


@pytest.mark.parametrize("n", [3, 4, 5])
def test_far_times_keep_their_digits(n: int, rng: np.random.Generator) -> None:
    """t = 10⁶ with frequencies to more digits, against 20 digits."""
    problem = random_problem(rng, n, 5.0)
    times = np.array([1e6 - 0.5, 1e6])
    found = solve(problem, times)
    assert found.provenance.details["guard_digits"]
    assert np.all(found.error < 10 * problem.conditioning_floor(times))
    if n < 5:
        finer = solve(problem, times, digits=20)
        assert np.all(np.max(np.abs(found.frame - finer.frame), axis=(1, 2)) <= found.error)


@pytest.mark.slow
def test_far_times_agree_with_integration() -> None:
    problem = tagged("reference", "generic")[1].problem()
    times = np.array([-200.0, 700.0])
    frame, _, tau1 = true_motion(problem, times)
    found = solve(problem, times)
    assert np.all(np.max(np.abs(found.frame - frame), axis=(1, 2)) <= found.error)
    assert np.allclose(found.tau1, tau1, rtol=1e-15, atol=1e-12)
    assert np.max(found.error) < 1e-11


def test_too_far_is_a_named_outcome() -> None:
    problem = random_problem(np.random.default_rng(1), 8)
    with pytest.raises(Unsolved) as raised:
        solve(problem, [1e9])
    assert raised.value.outcome == "too-far"
    for system, closed_form in (
        (problem, True),
        (EulerPoisson([1, 2, 3], [0.6, 0, 0.8], [1, 1, 1]), False),
    ):
        with pytest.raises(Unsolved, match="integration goes to") as raised:
            solve(system, [1e10], "numeric")
        assert ("the closed form farther" in str(raised.value)) is closed_form


def test_one_time_is_the_same_as_many() -> None:
    problem = tagged("generic")[3].problem()
    many, one = solve(problem, [1.0, 2.0, 3.0]), solve(problem, [2.0])
    assert np.allclose(many.frame[1], one.frame[0], atol=1e-14)


def test_motions_run_backwards() -> None:
    problem = tagged("generic")[3].problem()
    later = solve(problem, [7.0])
    reversed_ = Veselova(problem.A, later.q[0], -later.q_dot[0], later.frame[0], normalize=True)
    back = solve(reversed_, [7.0])
    assert np.allclose(back.frame[0], problem.frame, atol=1e-12)


@pytest.mark.parametrize("permutation", [[1, 0, 2, 3], [3, 2, 1, 0], [2, 3, 0, 1]])
def test_the_order_of_the_axes_is_the_users(permutation: list[int]) -> None:
    problem = tagged("generic")[3].problem()
    turned = Veselova(
        problem.A[permutation],
        problem.q[permutation],
        problem.q_dot[permutation],
        problem.frame[permutation],
        normalize=True,
    )
    times = [0.5, 20.0]
    assert np.allclose(
        solve(turned, times).frame, solve(problem, times).frame[:, permutation], atol=1e-12
    )


def test_scaling_the_inertia_or_the_speed_only_rescales_time() -> None:
    A, q, q_dot = np.array([3.0, 2.0, 1.0]), [0.6, 0, 0.8], np.array([0.8, 1, -0.6])
    plain = solve(Veselova(A, q, q_dot), [10.0])
    heavy = solve(Veselova(8 * A, q, q_dot), [10.0])
    fast = solve(Veselova(A, q, 4 * q_dot), [2.5])
    assert np.allclose(heavy.frame, plain.frame, atol=1e-13)
    assert np.allclose(fast.frame, plain.frame, atol=1e-13)
    assert np.isclose(heavy.tau1[0], plain.tau1[0] * np.sqrt(8), rtol=1e-14)


def test_the_torus_describes_the_motion() -> None:
    problem = tagged("reference", "generic")[3].problem()
    found = torus(problem)
    assert found.regime == "generic"
    assert np.allclose(found.constants, problem.constants, atol=1e-13)
    assert np.allclose(found.frequencies_t, found.frequencies_tau1 / found.mean_rate, rtol=1e-14)
    names = (
        {f"I{i + 1}": 1 / a for i, a in enumerate(problem.A)}
        | {f"c{k + 2}": c for k, c in enumerate(problem.constants)}
        | {"c1": 0.0}
    )
    assert np.allclose(found.branch_points, [names[name] for name in found.origins], atol=1e-13)
    assert found.riemann_matrix_residual < 1e-14
    # a in the monomial basis: its inverse's last column gives the frequencies too, as λ^{g−1} is
    # the only form that advances.
    assert np.allclose(np.linalg.inv(found.periods)[:, -1], found.frequencies_tau1, rtol=1e-9)


def test_the_symmetric_limit_is_approached_smoothly() -> None:
    """Two nearly equal A's: λ between them moves on a tiny cut, and the motion tends to the
    symmetric body's.
    """
    start = {"q": [0.3, 0.5, 0.8], "q_dot": [1, -0.4, 0.2], "normalize": True}
    frame = np.linalg.qr(np.column_stack([[0.3, 0.5, 0.8], np.eye(3)[:, :2]]))[0]
    frame[:, 0] = np.array([0.3, 0.5, 0.8]) / np.sqrt(0.98)
    exact = solve(Veselova([2, 1, 1], frame=frame, **start), [10.0], "numeric", "taylor").frame[0]
    for gap in (1e-4, 1e-8, 1e-12):
        near = solve(Veselova([2, 1 + gap, 1], frame=frame, **start), [10.0]).frame[0]
        assert np.max(np.abs(near - exact)) < 30 * gap + 1e-12


def test_short_times_of_a_stiff_body_have_slack_in_the_numerical_error() -> None:
    body = Veselova(
        ["161/2", "980", "329/50000"], ["-1/3", "2/3", "-2/3"], ["73/500", "81/250", "251/1000"]
    )
    times = np.geomspace(0.03, 0.6, 33)
    truth = solve(body, times, digits=20).frame
    for time, frame in zip(times, truth, strict=True):
        found = solve(body, [time], "numeric")
        assert np.max(np.abs(found.frame[0] - frame)) < found.error[0] / 8
