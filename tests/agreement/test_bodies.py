"""Bodies with an area constant, (Ω,γ) = c or Chaplygin's ball: every engine, route and formulation
through their table.
"""

from __future__ import annotations

from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from functools import cache
from itertools import product
from typing import Any

import mpmath
import numpy as np
import pytest
from scipy.optimize import brentq

import veselova as vs
from conftest import DAY
from deviations import agree, apart, decimals_of, enclosed, largest
from problems import BALLS_IN_MORE_DIMENSIONS, BODIES, BodyCase
from rolling_truth import roll
from veselova import InvalidInput, Unsolved
from veselova.analytic.closed.motion import kernel_motion
from veselova.analytic.solve import METHODS, solve

SYSTEMS = ("veselova-so3", "rubber-ball", "chaplygin-ball")
MOVING = [case for case in BODIES if "at-rest" not in case.tags]
CASES = {case.name: case for case in BODIES}

#: Cases whose momentum is along γ to 1e-5.
NEARLY = {f"nearly-upright-{off}" for off in ("1e-9", "1e-25", "1e-40")}

#: What the integration of the ball itself is off by, over lengths and radians of order 20.
TRUTH = 1e-11


#: Cases of every kind.
USUAL = ("generic", "symmetric", "about-an-axis", "matrix", "steady", "nearly-upright-1e-9")


def rows(cases: list[BodyCase], usual: tuple[str, ...] = tuple(CASES)) -> list[Any]:
    """Return the rows of a test of cases by systems; those that are not usual are slow."""
    return [
        pytest.param(
            case,
            system,
            id=f"{case.name}-{system}",
            marks=() if case.name in usual else pytest.mark.slow,
        )
        for case in cases
        for system in SYSTEMS
    ]


@cache
def truth(case: BodyCase, twists: bool) -> Any:
    """Return the motion of the ball itself, along the body axes."""
    problem = case.problem("chaplygin-ball" if twists else "rubber-ball")
    return roll(problem, case.times())


@pytest.mark.daily(4)
@pytest.mark.parametrize(("case", "system"), rows(MOVING, tuple(CASES)[DAY % 3 :: 3]))
def test_true_errors_never_exceed_reported_ones(case: BodyCase, system: str) -> None:
    problem = case.problem(system)
    true = truth(case, system == "chaplygin-ball")
    # e_2 and e_3 of the natural frame are those of its own problem
    turn = true.frame[0].T @ problem.frame
    found = vs.solve(problem, case.times())
    assert found.provenance.engine == "analytic"
    moved = replace(true, frame=true.frame @ turn)
    names = ["frame"] if system == "veselova-so3" else ["frame", "position"]
    assert np.all(apart(found, moved, names) <= found.error + TRUTH)
    assert np.max(found.error) < 5e-10
    assert largest(found.Omega - true.Omega) < 1e-10 * largest(problem.Omega)
    relative = 1e-14 * float(np.linalg.norm(problem.Omega)) / abs(problem.linear)  # to (Ω,γ)
    assert max(found.drift.values()) < 1e-11 + relative


#: Cases of every kind in space, and balls in ℝⁿ.
IN_SPACE = [CASES[name] for name in ("generic", "other-side", "symmetric", "matrix")]
IN_R_N = [x for x in BALLS_IN_MORE_DIMENSIONS if x.name in ("generic-4", "two-equal", "frozen")]
ROUTES = [*product(IN_SPACE, SYSTEMS), *product(IN_R_N, SYSTEMS[1:])]


@pytest.mark.parametrize("time_map", ["fourier", "panels"])
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("case", "system"), ROUTES, ids=lambda x: getattr(x, "name", x))
def test_every_route_agrees(case: Any, system: str, method: str, time_map: str) -> None:
    problem = case.problem(system)
    times = np.concatenate([[-7.0, 0.0], np.linspace(1, 40, 300)])
    some, other = solve(problem, times, time_map=time_map, method=method), vs.solve(problem, times)
    agree(some, other)


@pytest.mark.parametrize("system", SYSTEMS)
@pytest.mark.parametrize("name", ["generic", "about-an-axis", "momentum-upright"])
def test_every_formulation_integrates_the_same_motion(name: str, system: str) -> None:
    case = CASES[name]
    problem = case.problem(system)
    found = vs.solve(problem, case.times())
    for formulation in problem.formulations:
        agree(found, vs.solve(problem, case.times(), "numeric", formulation=formulation))


@pytest.mark.parametrize("system", SYSTEMS)
def test_far_times_cost_no_more_and_keep_their_digits(system: str) -> None:
    problem = CASES["generic"].problem(system)
    found = vs.solve(problem, [1e9 - 20, 1e9])
    speed = 1.0 if system == "veselova-so3" else max(1.0, problem.drift.speed)
    assert np.all(found.error < 100 * np.finfo(float).eps * 1e9 * speed)
    start = {name: found.series(name)[0] for name in ("gamma", "Omega", "frame")}
    case = CASES["generic"]
    later = BodyCase("later", case.inertia, start["gamma"], start["Omega"]).problem(system)
    moved = vs.solve(later, [20.0])
    turn = later.frame.T @ start["frame"]
    assert largest(moved.frame[0] @ turn - found.frame[1]) < 1e-6


@pytest.mark.parametrize("system", ["rubber-ball", "chaplygin-ball"])
def test_the_mean_velocity_is_that_of_a_long_run(system: str) -> None:
    problem = CASES["generic"].problem(system)
    found = vs.solve(problem, [1e7])
    run = (found.position[0] - problem.start["position"][0]) / 1e7
    assert largest(run - problem.drift.velocity) < 1e-6
    momentum = found.integrals["space_momentum"][0]
    assert abs(problem.drift.velocity @ momentum[1:]) < 1e-14 * np.linalg.norm(momentum)


@pytest.mark.parametrize("kind", [vs.RubberBall, vs.ChaplyginBall])
@pytest.mark.parametrize("mass", [1e-12, 1e6, 1e12])
def test_the_spin_of_a_heavy_ball_is_not_lost_in_its_momentum(kind: Any, mass: float) -> None:
    problem = kind(["0.4", "0.6", "0.9"], mass, 1, ["0.6", 0, "0.8"], ["0.8", 1, "0.3"])
    found, fine = vs.solve(problem, ["1"]), vs.solve(problem, ["1"], digits=20)
    assert largest(found.Omega - fine.Omega) < 1e-12
    at_start = problem.angular_velocity(problem.frame[None])[0]
    assert largest(at_start - problem.Omega) < 4e-15
    states = vs.closed_form(problem).at([1.0])
    assert largest(states.Omega - found.Omega) <= 1e-12 + 10 * states.error[0]


@pytest.mark.parametrize("system", ["rubber-ball", "chaplygin-ball"])
def test_upright_momentum_makes_no_way(system: str) -> None:
    problem = CASES["momentum-upright"].problem(system)
    assert problem.drift.speed < 1e-15
    far = vs.solve(problem, [1e6])
    assert largest(far.position - problem.start["position"]) < 10


@pytest.mark.parametrize("kind", [vs.VeselovaSO3, vs.ChaplyginBall])
def test_beside_a_separatrix_the_motion_is_known(kind: Any) -> None:
    """Ω turned until c'_2 = I'_2 to 1e-15."""
    ball = {} if kind is vs.VeselovaSO3 else {"mass": 0.7, "radius": 0.8}

    def at(angle: float) -> Any:
        c, s = np.cos(angle), np.sin(angle)
        Omega = [c + 0.3, 0.7 * s, 0.4 * s - 0.2]
        return kind([1, 1.4, 2], gamma=[0.6, 0.48, 0.64], Omega=Omega, **ball)

    def gap(angle: float) -> float:
        torus = kernel_motion(at(angle).on_torus()).torus
        return float(torus.d[torus.of_I[1], torus.of_c[1]])

    angle = brentq(gap, 1.4, 1.7, xtol=1e-16, rtol=1e-15)
    times = np.array([0, 1, 5, 20.0])
    for off in (0, 1e-9, 1e-5):
        problem = at(angle + off)
        found = vs.solve(problem, times)
        agree(found, vs.solve(problem, times, "numeric"))
        assert np.max(found.error) < 1e-9


@pytest.mark.parametrize("system", SYSTEMS)
def test_what_is_not_served_is_refused_by_name(system: str) -> None:
    problem = CASES["generic"].problem(system)
    with pytest.raises(InvalidInput, match=f"certified: required .*{system}.*strip"):
        vs.solve(problem, [1.0], certified=True)


@pytest.mark.parametrize(("case", "system"), rows(MOVING, usual=USUAL))
def test_states_from_the_document_alone_are_those_of_the_engine(
    case: BodyCase, system: str
) -> None:
    problem = case.problem(system)
    times = np.array([-1000.0, -2.5, 0.0, 0.125, 37.0, 1e4]) / max(1.0, problem.turning)
    try:
        made = vs.closed_form(problem)
    except Unsolved as refusal:
        # a path that hardly moves: its modes are of the rounding of the determinants, which
        # differs from one processor to another
        if (case.name, refusal.outcome) != ("hardly-twice-about-an-axis", "too-many-modes"):
            raise
        return
    found, wanted = vs.ClosedForm.from_json(made.to_json()).at(times), vs.solve(problem, times)
    allowed, off = found.error + wanted.error, apart(found, wanted, ["frame"])
    agree(found, wanted, "frame", *(() if system == "veselova-so3" else ("position",)))
    cycles = np.abs(times) * max(1.0, problem.turning)
    assert (off <= 1e-12 * np.maximum(1, cycles / 100)).all()
    for name in found.series:
        other = wanted.series(name)
        room = 1e-11 * max(1.0, largest(other)) + np.max(allowed)
        assert largest(found.series[name] - other) <= room, name
    assert made.document["problem"] == problem.as_dict()


WITH_DIGITS = [
    case for case in MOVING if not case.tags & {"euler", "matrix"} and case.name not in NEARLY
]


@pytest.mark.daily(4)
@pytest.mark.parametrize(("case", "system"), rows(WITH_DIGITS, usual=("generic", "symmetric")))
def test_more_digits_agree_by_two_routes_and_with_doubles(case: BodyCase, system: str) -> None:
    problem = case.problem(system)
    times = [str(t) for t in case.times()]
    found = vs.solve(problem, times, digits=25, method="theta")
    decimals = decimals_of(found)
    assert decimals.error.max() < Decimal("1e-25")
    assert found.provenance.digits == 25
    doubles = vs.solve(problem, times)
    agree(found, doubles, "frame")
    for name in ("Omega", "momentum", "gamma"):
        size = largest(doubles.series(name))
        assert largest(found.series(name) - doubles.series(name)) <= 1e-12 * size, name
    if case.name == "hardly-twice-about-an-axis":  # where angles say so
        with pytest.raises(Unsolved, match="angles are ill-conditioned"):
            vs.solve(problem, times, digits=35, method="angles")
        return
    other = vs.solve(problem, times, digits=35, method="angles")
    enclosed(decimals, decimals_of(other), set(problem.outputs) - {"gamma", "multiplier"})


@pytest.mark.daily(4)
def test_thirty_digits_are_those_of_an_integration_at_forty() -> None:
    """Equations (3.1) by Taylor series of mpmath; the frame is a given one, or the natural one."""
    inertia, gamma, Omega = ["1", "1.4", "2"], ["2/7", "3/7", "6/7"], ["0.3", "-0.7", "0.9"]
    given = [["2/7", "6/7", "3/7"], ["3/7", "2/7", "-6/7"], ["6/7", "-3/7", "2/7"]]
    for frame in (given, None):
        problem = vs.VeselovaSO3(inertia, gamma, Omega, frame=frame)
        found = decimals_of(vs.solve(problem, ["0", "1/5", "-0.3"], digits=30))
        assert found.error.max() < Decimal("1e-30")
        with mpmath.workdps(42):
            columns = found.midpoints["frame"][0].tolist()
            e_2 = [row[1] for row in frame] if frame else [str(row[1]) for row in columns]
            start = [numeral(x) for x in (*Omega, *gamma, *e_2)]
            moments = [numeral(x) for x in inertia]
            for row, time in ((1, "0.2"), (2, "-0.3")):
                state = turned_body(moments, start, mpmath.mpf(time))
                for place, (name, column) in enumerate(
                    (("Omega", None), ("frame", 0), ("frame", 1))
                ):
                    values = found.midpoints[name][row]
                    values = values if column is None else values[:, column]
                    for x, true in zip(values, state[3 * place : 3 * place + 3], strict=True):
                        assert abs(mpmath.mpf(str(x)) - true) < mpmath.mpf(10) ** -30, name


def numeral(text: str) -> Any:
    fraction = Fraction(text)
    return mpmath.mpf(fraction.numerator) / fraction.denominator


def turned_body(moments: list[Any], start: list[Any], time: Any) -> list[Any]:
    """Return (Ω, γ, e_2) at a time by mpmath's Taylor series, 𝓘Ω̇ = 𝓘Ω×Ω + λγ, ė = e×Ω."""

    def cross(a: list[Any], b: list[Any]) -> list[Any]:
        return [a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2] for i in range(3)]

    def rates(_: Any, state: list[Any]) -> list[Any]:
        Omega, gamma, e_2 = state[:3], state[3:6], state[6:]
        torque = cross([i * x for i, x in zip(moments, Omega, strict=True)], Omega)
        across = [x / i for i, x in zip(moments, gamma, strict=True)]
        share = mpmath.fdot(torque, across) / mpmath.fdot(gamma, across)
        pairs = zip(torque, gamma, moments, strict=True)
        Omega_dot = [(x - share * y) / i for x, y, i in pairs]
        return [*Omega_dot, *cross(gamma, Omega), *cross(e_2, Omega)]

    if time < 0:  # mpmath goes forwards: the same motion with Ω and time reversed
        start = [-x for x in start[:3]] + start[3:]
    state = mpmath.odefun(rates, 0, start, tol=mpmath.mpf(10) ** -38)(abs(time))
    return [-x for x in state[:3]] + state[3:] if time < 0 else state


@pytest.mark.daily(4)
def test_digits_beyond_panels_are_refused_by_name() -> None:
    """In doubles any time is served; with more digits such motions have panels alone."""
    problem = CASES["generic"].problem("chaplygin-ball")
    with pytest.raises(vs.Unsolved, match=r"too-far: .*evaluations"):
        vs.solve(problem, [1e9], digits=20)
    fine, finer = (decimals_of(vs.solve(problem, ["-80", "300"], digits=n)) for n in (18, 24))
    enclosed(fine, finer, problem.bounded)


def test_digits_where_there_are_none_are_refused_by_name() -> None:
    upright = CASES["momentum-upright"].problem("veselova-so3")
    with pytest.raises(InvalidInput, match=r"digits: required 15, .*along γ to 1e-05"):
        vs.solve(upright, [1.0], digits=20)
    with pytest.raises(InvalidInput, match="digits: required inertia as 3 principal moments"):
        vs.solve(CASES["matrix"].problem("veselova-so3"), [1.0], digits=20)
    problem = CASES["generic"].problem("veselova-so3")
    with pytest.raises(InvalidInput, match="time_map: required none"):
        solve(problem, [1.0], digits=20, time_map="fourier")


def test_a_document_is_honest_against_the_ball_itself() -> None:
    for system in ("rubber-ball", "chaplygin-ball"):
        problem, times = CASES["generic"].problem(system), CASES["generic"].times()
        true = truth(CASES["generic"], system == "chaplygin-ball")
        found = vs.closed_form(problem, accuracy=1e-6).at(times)
        off = np.max(np.abs(found.frame - true.frame @ true.frame[0].T @ problem.frame))
        assert 1e-10 < off <= np.max(found.error)
        moved = (true.position - true.position[0]) @ (true.frame[0].T @ problem.frame)[1:, 1:]
        off = largest(found.position - problem.start["position"] - moved)
        assert off <= np.max(found.error)
