"""Both engines through the problem table: reference motions, agreement, honest
errors, far times.
"""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from deviations import agree, apart, largest
from draws import random_problem
from generic_torus import fastest
from problems import Case, tagged
from veselova import EllipsoidGeodesic, EulerPoisson, Unsolved, Veselova, compare, solve, torus
from veselova.analytic.solve import solve as solve_analytic
from veselova.mechanics.core.problem import Problem

METHODS = [
    ("analytic", "theta"),
    ("analytic", "angles"),
    ("numeric", "dop853"),
    ("numeric", "taylor"),
]
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
LONG = ("eight", "wide-ratio", "random-n6-0", "rising-A")


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


def reference(case: Case) -> Any:
    """Return the motion at the points of a reference, with their times t."""
    names = ("t", "frame", "q_dot", "tau1")
    columns = (np.array([point[name] for point in case.points], float) for name in names)
    return SimpleNamespace(**dict(zip(names, columns, strict=True)))


@pytest.mark.parametrize("method", ["theta", "angles"])
@pytest.mark.parametrize("case", tagged("reference"), ids=lambda case: case.name)
def test_the_analytic_engine_reaches_the_reference_motions(case: Case, method: str) -> None:
    true = reference(case)
    found = solve(case.problem(), true.t, "analytic", method)
    allowed = 1e-12 * np.maximum(1.0, np.sqrt(true.t))
    if case.name == "slow":  # |q̇| is 1e-3: the turning, not the time, is what counts
        allowed = np.full(true.t.size, 1e-12)
    assert np.all(apart(found, true, ["frame"]) <= allowed)
    assert np.all(apart(found, true, ["q_dot"]) <= allowed * max(1.0, largest(true.q_dot)))
    assert np.all(np.abs(found.tau1 - true.tau1) <= allowed * np.maximum(1.0, true.tau1))


@pytest.mark.daily(4)
@pytest.mark.parametrize(("method", "bound"), [("dop853", 1e-8), ("taylor", 1e-12)])
@pytest.mark.parametrize("case", tagged("reference"), ids=lambda case: case.name)
def test_the_numeric_engine_reaches_the_reference_motions(
    case: Case, method: str, bound: float
) -> None:
    true = reference(case)
    found = solve(case.problem(), true.t, "numeric", method)
    allowed = bound * (np.maximum(1.0, true.t) if method == "taylor" else 1.0)
    assert np.all(apart(found, true, ["frame"]) <= allowed)
    assert np.all(np.abs(found.tau1 - true.tau1) <= allowed * np.maximum(1.0, true.tau1))


@pytest.mark.daily(4)
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


@pytest.mark.daily(3)
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


@pytest.mark.daily(3)
def test_a_separatrix_is_followed_as_long_as_the_data_determine_it() -> None:
    case = tagged("separatrix")[0]
    times = np.linspace(0, 14, 29)
    found = solve(case.problem(), times)
    assert found.provenance.details["regime"] == "separatrix"
    assert np.max(found.error) < 1e-10
    frame = solve(case.problem(), times[::7], digits=20).frame
    assert np.all(np.max(np.abs(found.frame[::7] - frame), axis=(1, 2)) <= found.error[::7])
    for far in (60.0, 1000.0):  # after the orbit was followed, and before
        with pytest.raises(Unsolved, match=f"no-digit-left: at t = {far:g} the error reaches 0.1"):
            solve(case.problem(), [1.0, far], budget_s=30)


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
    agree(found, integrated, "frame")
    assert np.max(found.error) < 1e-10


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


@pytest.mark.parametrize("n", [3, 5])
def test_far_times_keep_their_digits(n: int, rng: np.random.Generator) -> None:
    """t = 10⁶ with frequencies to more digits, against 20 digits."""
    problem = random_problem(rng, n, 5.0)
    times = np.array([1e6 - 0.5, 1e6])
    found = solve(problem, times)
    assert found.provenance.details["guard_digits"]
    assert np.all(found.error < 10 * problem.conditioning_floor(times))
    if n == 3:
        finer = solve(problem, times, digits=20, budget_s=600)
        assert np.all(apart(found, finer, ["frame"]) <= found.error)


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
