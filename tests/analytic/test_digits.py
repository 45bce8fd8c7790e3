"""More digits than a double has, and certified errors: the same chain in ball arithmetic."""

from __future__ import annotations

import json
import pickle
from dataclasses import replace
from decimal import ROUND_DOWN, Context, Decimal, DefaultContext, Inexact, localcontext
from fractions import Fraction
from pathlib import Path
from typing import Any

import flint
import mpmath
import numpy as np
import pytest

import veselova as vs
from conftest import Server, slow
from draws import near_unstable_circle, random_problem
from hostile import BUDGET_S
from problems import Case, tagged
from veselova.analytic.arithmetic.balls import balls
from veselova.analytic.curve.abel_jacobi import AbelJacobi
from veselova.analytic.curve.hyperelliptic import Curve
from veselova.analytic.curve.interval import Interval
from veselova.analytic.digits.fourier import FourierTimeMapInBalls
from veselova.analytic.digits.frame import orthonormal
from veselova.analytic.digits.in_doubles import InDoubles
from veselova.analytic.digits.panels import ChebyshevTimeMapInBalls
from veselova.analytic.digits.solution import SolutionInBalls
from veselova.analytic.spectrum.branch_points import resolve_spectrum
from veselova.analytic.spectrum.moving_part import moving_part
from veselova.mechanics.core.decimals import Decimals
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.results.trajectory import Trajectory
from veselova.service.api.json_documents import encode, trajectory_document, trajectory_of

BODY3 = {"A": ["3", "2", "1.2"], "q": ["0.6", "0", "0.8"], "q_dot": ["0.4", "0.7", "-0.3"]}


def body3() -> vs.Veselova:
    return vs.Veselova(**BODY3)


def deviation(found: Decimals, other: Decimals, name: str) -> float:
    return float(np.max(np.abs(found.midpoints[name] - other.midpoints[name])))


@pytest.mark.parametrize("case", tagged("reference"), ids=lambda case: case.name)
def test_references_are_met_to_their_last_digits(case: Case) -> None:
    """References are printed to 30 digits, from starts whose frame is given to 35."""
    found = vs.solve(case.problem(), [point["t"] for point in case.points], digits=30).decimals
    assert found is not None
    for i, point in enumerate(case.points):
        for key in ("q", "q_dot", "frame", "tau1"):
            expected = np.vectorize(Decimal, otypes=[object])(np.array(point[key], dtype=object))
            assert max(np.abs(np.ravel(found.midpoints[key][i] - expected))) < Decimal("1e-27"), (
                key,
                point["t"],
            )


@pytest.mark.parametrize("n", [2, 3, 4, 6])
def test_more_digits_confirm_those_promised(n: int, rng: np.random.Generator) -> None:
    problem = random_problem(rng, n)
    times = ["-3.5", 0, "0.1", 8]
    found, finer = (vs.solve(problem, times, digits=digits).decimals for digits in (25, 40))
    assert found is not None
    assert finer is not None
    assert max(found.error) < Decimal("1e-25")
    for name in found.midpoints:
        assert np.all(
            np.abs(found.midpoints[name] - finer.midpoints[name])
            <= found.radii[name] + finer.radii[name]
        ), name


@pytest.mark.parametrize("n", [2, 3, slow(4), slow(5)])
def test_certified_balls_hold_the_motion(n: int, rng: np.random.Generator) -> None:
    """Proven radii hold what many more digits give, and the ordinary error is no smaller than what
    is proven.
    """
    problem = random_problem(rng, n)
    times = np.array([-2.0, 0.0, 1.0, 7.0])
    proven = vs.solve(problem, times, certified=True).decimals
    finer = vs.solve(problem, times, digits=40).decimals
    assert proven is not None
    assert finer is not None
    assert proven.certified
    for name in proven.midpoints:
        assert np.all(
            np.abs(proven.midpoints[name] - finer.midpoints[name])
            <= proven.radii[name] + finer.radii[name]
        ), name
    ordinary = vs.solve(problem, times)
    assert np.all(proven.error.astype(float) < ordinary.error)
    true_error = np.max(
        np.abs(ordinary.frame - finer.midpoints["frame"].astype(float)), axis=(1, 2)
    )
    assert np.all(true_error <= ordinary.error)


@pytest.mark.slow
def test_thirty_digits_at_a_million_million() -> None:
    times = ["1e12", Fraction(10**12) + Fraction(1, 3)]
    found, finer = (vs.solve(body3(), times, digits=digits) for digits in (30, 36))
    assert found.decimals is not None
    assert finer.decimals is not None
    assert found.provenance.details["time_map"] == "fourier"
    assert max(found.decimals.error) < Decimal("1e-30")
    assert deviation(found.decimals, finer.decimals, "frame") < 1e-30


@pytest.mark.parametrize("method", ["theta", "angles"])
@pytest.mark.parametrize("n", [2, 3])
def test_times_beyond_the_whole_numbers_of_doubles_lead_there_and_back(
    n: int, method: str, rng: np.random.Generator
) -> None:
    """Which cell of the torus a phase is in decides signs, and doubles do not tell those of 10²⁰
    apart.
    """
    body = random_problem(rng, n)
    there = vs.solve(body, ["1e20"], digits=42, method=method).decimals
    assert there is not None
    state = (list(map(str, there.midpoints[series][0])) for series in ("q", "q_dot"))
    back = vs.solve(
        vs.Veselova(body.A, *state, normalize=True), ["-1e20"], digits=20, method=method
    ).decimals
    start = vs.solve(body, [0], digits=20).decimals
    assert back is not None
    assert start is not None
    for series in ("q", "q_dot"):
        assert deviation(back, start, series) < 1e-19, series


@pytest.mark.parametrize("time", [1e9, 1e11])
@pytest.mark.parametrize("n", [2, 3])
def test_doubles_far_out_are_as_near_to_many_digits_as_they_say(
    n: int, time: float, rng: np.random.Generator
) -> None:
    body = random_problem(rng, n)
    found, finer = vs.solve(body, [time]), vs.solve(body, [time], digits=20)
    assert np.max(np.abs(found.frame - finer.frame)) <= found.error[0] < 1e-10
    with pytest.raises(vs.Unsolved, match="too-far"):
        vs.solve(body, [1e8 * time])


@pytest.mark.parametrize("n", [2, 3, 4])
def test_theta_functions_and_angles_agree_in_balls(n: int, rng: np.random.Generator) -> None:
    problem = random_problem(rng, n)
    by_theta, by_angles = (
        vs.solve(problem, [-1, 3], digits=30, method=method).decimals
        for method in ("theta", "angles")
    )
    assert by_theta is not None
    assert by_angles is not None
    for name in ("frame", "q_dot", "spheroconic", "tau1"):
        assert deviation(by_theta, by_angles, name) < 1e-29, name


def test_a_separatrix_has_all_digits_of_exact_data() -> None:
    """A great circle about the middle axis, and the umbilic motion that leaves it: c_2 = I_2
    exactly.
    """
    umbilic = vs.Veselova(
        ["3", "2", "1"], ["0.6", "0", "0.8"], ["0.8", "0.5", "-0.6"], normalize=True
    )
    near = vs.Veselova(["3", "2", "1"], ["0", "1", "0"], ["0.6", "1e-30", "0.8"], normalize=True)
    for problem in (
        umbilic,
        near,
        vs.Veselova(["3", "2", "1"], ["0", "1", "0"], ["0.6", "0", "0.8"]),
    ):
        found, finer = (vs.solve(problem, [-2, 5], digits=digits).decimals for digits in (20, 30))
        assert found is not None
        assert finer is not None
        assert deviation(found, finer, "frame") < 1e-20


def test_many_digits_reach_far_next_to_a_separatrix() -> None:
    near = near_unstable_circle("1e-3", "1e-4")
    found, finer = (vs.solve(near, [50, 1e6], digits=digits) for digits in (16, 22))
    assert found.provenance.details["time_map"] == finer.provenance.details["time_map"] == "fourier"
    assert found.decimals is not None
    assert finer.decimals is not None
    assert deviation(found.decimals, finer.decimals, "frame") < 1e-16
    soon = vs.solve(near, [50], digits=22)
    assert soon.provenance.details["time_map"] == "panels"
    assert soon.decimals is not None
    assert (
        np.max(np.abs(soon.decimals.midpoints["frame"][0] - finer.decimals.midpoints["frame"][0]))
        < 1e-21
    )


def test_times_beyond_every_clock_are_refused_before_the_work() -> None:
    with pytest.raises(vs.Unsolved) as caught:
        vs.solve(
            vs.Veselova([5, 4, 3, 2, 1], [1] * 5, [1, -2, 3, -4, 2], normalize=True),
            [1e6],
            digits=30,
        )
    assert caught.value.outcome == "too-far"


@pytest.mark.slow
def test_both_clocks_agree_in_balls() -> None:
    """Panels and Fourier modes share the rate and nothing else."""
    solution = SolutionInBalls(InDoubles(body3()), 45, False, "angles")
    near = vs.solve(body3(), [20]).tau1 / float(
        solution.arithmetic.sqrt(solution.arithmetic.number(solution.moving.unit))
    )
    with solution.arithmetic as xp:
        times = xp.array([20])
        by_panels = ChebyshevTimeMapInBalls(solution.orbit, near, False).tau1(times, near)
        by_bounded_panels = ChebyshevTimeMapInBalls(solution.orbit, near, True).tau1(times, near)
        by_modes = FourierTimeMapInBalls(solution.orbit).tau1(times, near)
        for other in (by_bounded_panels, by_modes):
            assert by_panels[0].overlaps(other[0])
            assert float(abs(by_panels[0] - other[0]).upper()) < 1e-40


def test_strings_are_taken_exactly_and_doubles_as_what_they_store() -> None:
    exact = vs.Veselova(["3", "2", "1.2"], ["0.6", "0", "0.8"], ["0.4", "0.7", "-0.3"])
    doubles = vs.Veselova([3, 2, 1.2], [0.6, 0, 0.8], [0.4, 0.7, -0.3])
    same_doubles = vs.Veselova([3, 2, Fraction(1.2)], [Fraction(0.6), 0, 0.8], [0.4, 0.7, -0.3])
    one, two, three = (
        vs.solve(p, ["0.1"], digits=30).decimals for p in (exact, doubles, same_doubles)
    )
    assert one is not None
    assert two is not None
    assert three is not None
    assert 1e-18 < deviation(one, two, "q") < 1e-14
    assert deviation(two, three, "q") == 0
    assert deviation(one, vs.solve(exact, [0.1], digits=30).decimals, "q") > 1e-19  # type: ignore[arg-type]


def test_times_in_an_array_are_taken_as_exactly_as_in_a_list(server: Server) -> None:
    times = np.array(["1/3", 2], dtype=object)
    assert TimeGrid.of(times).exact == (Fraction(1, 3), 2)
    assert TimeGrid.of(np.array([0.1])).exact == (Fraction(0.1),)
    with vs.Client(server.url) as client:
        answers = [
            solve(body3(), given, digits=25).decimals
            for solve in (vs.solve, client.trajectory)
            for given in (times, list(times))
        ]
    first = answers[0]
    assert first is not None
    for other in answers[1:]:
        assert other is not None
        assert deviation(first, other, "frame") == 0


@pytest.mark.parametrize(
    ("A", "q", "q_dot"),
    [
        (["2", "2", "1"], ["0.6", "0", "0.8"], ["0.4", "0.7", "-0.3"]),
        (["3", "2", "1", "0.5"], ["0.6", "0", "0.8", "0"], ["0.4", "0.7", "-0.3", "0"]),
        (["2", "2", "2"], ["0.6", "0", "0.8"], ["0.4", "0.7", "-0.3"]),
        (["1e-28", "2e-28", "4e-28"], ["1", "0", "0"], ["0", "3e28", "1e28"]),
    ],
    ids=["symmetric", "frozen", "isotropic", "scaled along an axis"],
)
def test_nice_starts_have_all_digits(A: Any, q: Any, q_dot: Any) -> None:
    problem = vs.Veselova(A, q, q_dot)
    unit = 1 / float(np.max(np.abs(problem.q_dot)))
    found, finer = (vs.solve(problem, [0, 3 * unit], digits=digits) for digits in (25, 35))
    assert found.decimals is not None
    assert finer.decimals is not None
    assert deviation(found.decimals, finer.decimals, "frame") < 1e-25
    ordinary = vs.solve(problem, [0, 3 * unit])
    assert np.all(
        np.max(np.abs(ordinary.frame - found.frame), axis=(1, 2)) <= ordinary.error + found.error
    )


def test_a_frame_given_to_many_digits_is_made_orthogonal_to_all_of_them() -> None:
    with balls(60) as xp:
        rng = np.random.default_rng(5)
        nearly = np.linalg.qr(rng.normal(size=(4, 4)))[0] + 1e-10 * rng.normal(size=(4, 4))
        polar = orthonormal(xp.array(nearly), xp)
        defect = polar.T @ polar - np.eye(4, dtype=int)
        assert all(abs(entry).upper() < flint.arb("1e-55") for entry in defect.ravel())
        symmetric = polar.T @ xp.array(nearly)
        assert all((symmetric - symmetric.T).ravel()[k].overlaps(flint.arb(0)) for k in range(16))


def test_forms_stay_below_their_bound_in_the_strip(rng: np.random.Generator) -> None:
    """At the edge of the strip, |Im v| = K'/2, the forms are evaluated with mpmath's elliptic
    functions.
    """
    with balls(20) as xp:
        found = resolve_spectrum(moving_part(random_problem(rng, 4)), 20)
        curve = Curve.of(found.spectrum, xp)
        for left in range(2 * curve.genus):
            interval = Interval(curve, left)
            bound = [float(x) for x in interval.bound_in_strip()]
            k = mpmath.sqrt(mpmath.mpf(float(interval.jacobi.k_squared)))
            v_edge = mpmath.mpc(0, float(interval.jacobi.conjugate_quarter) / 2)
            points = [float(x) for x in curve.branch_points]
            width, before = (
                points[left + 1] - points[left],
                points[left] - points[left - 1] if left else None,
            )
            largest = np.zeros(curve.genus)
            for step in range(24):
                sn = mpmath.ellipfun("sn", float(interval.jacobi.quarter) * step / 12 + v_edge, k=k)
                square = complex(sn * sn)
                below = (
                    width * square
                    if before is None
                    else width * before * square / (before + width * (1 - square))
                )
                point = points[left] + below
                far = [p for i, p in enumerate(points) if not left - 1 <= i <= left + 2]
                density = (
                    float(interval.points.density) / abs(np.prod([point - p for p in far])) ** 0.5
                )
                zeros = [(points[j] + points[j + 1]) / 2 for j in range(2, 2 * curve.genus, 2)]
                forms = [
                    np.prod([point - z for i, z in enumerate(zeros) if i != l])
                    for l in range(len(zeros) + 1)
                ]
                largest = np.maximum(largest, density * np.abs(forms))
            assert np.all(largest <= np.array(bound) * (1 + 1e-9))
            assert np.all(largest > 0.05 * np.array(bound))


def test_the_rate_stays_below_its_bound_in_the_strip(rng: np.random.Generator) -> None:
    """Taylor coefficients of dt/dτ₁ along an orbit obey Cauchy's estimates |f^(k)/k!|
    ≤ M y^(−k).
    """
    for n in (3, 5):
        solution = SolutionInBalls(InDoubles(random_problem(rng, n)), 50, True, "angles")
        with solution.arithmetic as xp:
            width, largest = solution.orbit.strip
            step = xp.number(width) / 40
            count = 9
            values = solution.orbit.rates(step * xp.array(list(range(count))))
            for k in range(1, count):
                values = np.diff(values)
                assert abs(float(values[0])) <= float(step) ** k * float(
                    largest
                ) * width**-k * float(mpmath.factorial(k))


def test_inversion_in_balls_holds_the_angles_it_came_from(rng: np.random.Generator) -> None:
    solution = SolutionInBalls(InDoubles(random_problem(rng, 5)), 40, True, "angles")
    inversion: AbelJacobi = solution.orbit.rate.inversion
    with solution.arithmetic as xp:
        psi = xp.array(rng.uniform(0, 6, (6, 4)))
        found = inversion.invert(inversion.map(psi))
        assert all(a.overlaps(b) for a, b in zip(found.ravel(), psi.ravel(), strict=True))
        assert max(float(a.rad()) for a in found.ravel()) < 1e-36


def test_the_decimal_context_of_the_caller_plays_no_part() -> None:
    context = Context(prec=3, rounding=ROUND_DOWN, Emin=-9, Emax=9, traps=[Inexact])
    expected, frame = made(vs.solve(body3(), [1, 2], digits=30)), vs.solve(body3(), [1, 2]).frame
    with localcontext(context):
        assert np.array_equal(vs.solve(body3(), [1, 2]).frame, frame)
        found = made(vs.solve(body3(), [1, 2], digits=30))
    assert_same(found, expected)


def test_a_process_that_traps_what_is_inexact_gets_the_same_answers() -> None:
    expected, trapped = made(vs.solve(body3(), [1, 2], digits=30)), DefaultContext.traps[Inexact]
    try:
        DefaultContext.traps[Inexact] = True
        found = made(vs.solve(body3(), [1, 2], digits=30))
    finally:
        DefaultContext.traps[Inexact] = trapped
    assert_same(found, expected)


@pytest.mark.parametrize("time", ["1e-8", "-1e-9", "1e-16", "1e-20", "-1e-30", "1e-300"])
@pytest.mark.parametrize("options", [{}, {"method": "angles"}, {"certified": True}], ids=str)
def test_times_below_the_rounding_of_a_clock_in_doubles_are_served(
    time: str, options: dict[str, Any]
) -> None:
    """Near t = 0 the frame is e_1 + t q̇ …, and τ₁ = t dτ₁/dt: both to second order."""
    late, first = (made(vs.solve(body3(), [at], digits=40, **options)) for at in (time, 0))
    rate = Decimal(float(np.linalg.norm(body3().q_dot) / np.linalg.norm(body3().neumann().q_prime)))
    t = Decimal(time)
    with localcontext(Context(prec=60)):
        ahead = late.midpoints["q"] - first.midpoints["q"] - t * first.midpoints["q_dot"]
        assert np.max(np.abs(ahead)) <= 10 * t * t + Decimal("1e-39")
        assert abs(late.midpoints["tau1"][0] - t * rate) <= 10 * abs(t) * (
            abs(t) + Decimal("1e-15")
        ) + Decimal("1e-39")
    assert max(late.error) <= Decimal("1e-40")


def made(trajectory: vs.Trajectory) -> Decimals:
    """The decimals of a trajectory, all of them made: that is done when they are asked for."""
    assert trajectory.decimals is not None
    return replace(
        trajectory.decimals,
        midpoints=dict(trajectory.decimals.midpoints),
        radii=dict(trajectory.decimals.radii),
    )


def assert_same(found: Decimals, expected: Decimals) -> None:
    assert list(found.radii) == list(expected.radii) == list(expected.midpoints)
    for name, radii in expected.radii.items():
        assert np.array_equal(found.midpoints[name], expected.midpoints[name]), name
        assert np.array_equal(found.radii[name], radii), name


def test_decimals_made_later_are_those_made_at_once() -> None:
    """Whatever became of Arb's global precision, in pickles too, and doubles are the nearest to
    them.
    """
    trajectory = vs.solve(body3(), [-1, 0, 2], digits=40)
    assert trajectory.decimals is not None
    assert "omega" in trajectory.decimals.radii
    assert "gamma" not in trajectory.decimals.radii
    kept, expected = pickle.loads(pickle.dumps(trajectory)), made(trajectory)
    later, before = vs.solve(body3(), [-1, 0, 2], digits=40), flint.ctx.prec
    try:
        flint.ctx.prec = 20
        assert_same(made(later), expected)
    finally:
        flint.ctx.prec = before
    assert_same(kept.decimals, expected)
    assert np.array_equal(kept.error, trajectory.error)
    assert max(expected.error) < Decimal("1e-40")
    for name in ("q_dot", "frame", "tau1"):
        assert np.array_equal(trajectory.arrays[name], expected.midpoints[name].astype(float)), name


def test_decimals_turn_into_numbers_of_both_libraries() -> None:
    decimals = vs.solve(body3(), [1], digits=50).decimals
    assert decimals is not None
    number, ball = decimals.mpmath("q")[0, 0], decimals.flint("q")[0, 0]
    assert str(decimals.midpoints["q"][0, 0])[:50] in mpmath.nstr(number, 55)
    with balls(60) as xp:
        assert ball.contains(xp.number(Fraction(decimals.strings("q")[0][0])))
    assert float(ball.rad()) < 1e-50


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"digits": 14}, "digits"),
        ({"digits": 1001}, "digits"),
        ({"digits": True}, "digits"),
        ({"digits": 20.0}, "digits"),
        ({"digits": 20, "engine": "numeric"}, "digits"),
        ({"certified": 1}, "certified"),
        ({"certified": True, "engine": "numeric"}, "certified"),
        ({"certified": True, "method": "theta"}, "method"),
        ({"digits": 20, "method": "products"}, "method"),
    ],
)
def test_precision_that_an_engine_has_not_is_refused_by_name(
    options: dict[str, Any], field: str
) -> None:
    with pytest.raises(vs.InvalidInput) as caught:
        vs.solve(body3(), [1], **options)
    assert caught.value.field == field


def test_a_matrix_of_inertia_has_the_digits_of_its_axes() -> None:
    problem = vs.Veselova([[2, 0.1, 0], [0.1, 1, 0], [0, 0, 3]], [1, 0, 0], [0, 1, 0])
    for options, field in (({"digits": 20}, "digits"), ({"certified": True}, "certified")):
        with pytest.raises(vs.InvalidInput) as caught:
            vs.solve(problem, [1], **options)  # type: ignore[arg-type]
        assert caught.value.field == field


@pytest.mark.parametrize("A", [["3", "2", "1"], ["2", "2", "1"], ["2", "2", "2"]], ids=str)
def test_a_body_at_rest_keeps_the_frame_that_it_was_given(A: list[str]) -> None:
    frame = [["0.6", 0, "-0.8"], [0, 1, 0], ["0.8", 0, "0.6"]]
    found = vs.solve(
        vs.Veselova(A, ["0.6", 0, "0.8"], [0, 0, 0], frame), [-1, "1e9"], digits=30, certified=True
    )
    assert found.decimals is not None
    assert np.all(found.decimals.midpoints["frame"] == np.vectorize(Decimal)(frame))
    assert not found.tau1.any()
    assert not found.q_dot.any()
    # Between the poles 1/A the λ of q = (0.6, 0, 0.8) is 0.64/A_1 + 0.36/A_3.
    exact = sorted(
        [Fraction(16, 25) / Fraction(A[0]) + Fraction(9, 25) / Fraction(A[2]), 1 / Fraction(A[1])]
    )
    for middle, radius, expected in zip(
        *(x["spheroconic"][1] for x in (found.decimals.midpoints, found.decimals.radii)), exact
    ):
        assert abs(Fraction(middle) - expected) <= Fraction(radius) < Fraction(1, 10**30)
    with pytest.raises(vs.Unsolved, match="natural frame"):
        vs.solve(vs.Veselova(A, ["0.6", 0, "0.8"], [0, 0, 0]), [1], digits=30)


def test_what_cannot_be_enclosed_says_which_step_failed() -> None:
    with pytest.raises(vs.Unsolved, match="evaluations"):
        vs.solve(body3(), [1e9], certified=True)


def test_decimals_come_back_from_their_document_to_the_last_digit() -> None:
    problem = body3()
    trajectory = vs.solve(problem, ["0.1", 2], digits=40, certified=True)
    document = json.loads(encode(trajectory_document(trajectory)))
    assert document["series"]["q"][1][0] == str(trajectory.decimals.midpoints["q"][1, 0])  # type: ignore[union-attr]
    back = trajectory_of(problem, document)
    assert back.decimals is not None
    assert trajectory.decimals is not None
    assert back.decimals.certified
    for name in ("q", "q_dot", "frame", "tau1", "spheroconic"):
        assert np.all(back.decimals.midpoints[name] == trajectory.decimals.midpoints[name])
        assert np.all(back.decimals.radii[name] == trajectory.decimals.radii[name])
    # ω is formed anew, from what came: a valid enclosure of the same numbers.
    assert deviation(back.decimals, trajectory.decimals, "omega") < 1e-40
    assert np.array_equal(back.error, trajectory.error)


def test_the_service_answers_in_decimals(server: Server) -> None:
    with vs.Client(server.url) as client:
        answer = client.trajectory(
            body3(), ["0.1", 2], digits=40, certified=True, budget_s=BUDGET_S
        )
    here = vs.solve(body3(), ["0.1", 2], digits=40, certified=True)
    assert answer.decimals is not None
    assert here.decimals is not None
    assert np.all(answer.decimals.midpoints["frame"] == here.decimals.midpoints["frame"])


def test_files_carry_all_digits(tmp_path: Path) -> None:
    trajectory = vs.solve(body3(), [1, 2], digits=30)
    assert trajectory.decimals is not None
    trajectory.to_csv(tmp_path / "motion.csv")
    header, first, _ = (tmp_path / "motion.csv").read_text().splitlines()
    row = dict(zip(header.split(","), first.split(","), strict=True))
    assert Decimal(row["frame_2_1"]) == trajectory.decimals.midpoints["frame"][0, 1, 0]
    assert Decimal(row["tau1"]) == trajectory.decimals.midpoints["tau1"][0]
    trajectory.to_npz(tmp_path / "motion.npz")
    with np.load(tmp_path / "motion.npz") as archive:
        assert Decimal(str(archive["q_decimal"][1, 2])) == trajectory.decimals.midpoints["q"][1, 2]
        assert Decimal(str(archive["q_radius"][1, 2])) == trajectory.decimals.radii["q"][1, 2]
        again = Trajectory.from_arrays(trajectory.problem, archive)
    assert again.decimals is not None
    assert np.all(again.decimals.midpoints["omega"] == trajectory.decimals.midpoints["omega"])
    assert np.array_equal(again.error, trajectory.error)
