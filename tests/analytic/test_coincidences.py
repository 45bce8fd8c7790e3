"""Starts at which branch points coincide, with many digits and with certified errors: they are
moved, by how much is bounded.
"""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

import veselova as vs
from conftest import slow
from truth import true_motion
from veselova.analytic.closed.departure import log_drift
from veselova.analytic.spectrum.branch_points import resolve_spectrum
from veselova.analytic.spectrum.moving_part import moving_part

SYMMETRIC = vs.Veselova([3, 3, 1], ["0.6", 0, "0.8"], ["0.4", "0.7", "-0.3"], normalize=True)
FRAMED = vs.Veselova(
    [3, 3, 1],
    ["0.6", 0, "0.8"],
    ["0.4", "0.7", "-0.3"],
    [["0.6", 0, "-0.8"], [0, 1, 0], ["0.8", 0, "0.6"]],
    normalize=True,
)
SPHERE = vs.Veselova([2, 2, 2], ["0.6", 0, "0.8"], ["0.4", "0.7", "-0.3"], normalize=True)
FOUR = vs.Veselova([3, 3, 2, 1], [1, 2, 1, 1], [2, -1, 3, 1], normalize=True)
ALIGNED = vs.Veselova([3, 3, 2, 1], [1, 0, 1, 1], [2, -1, 3, 1], normalize=True)
TINY = vs.Veselova([3, 2, 1], ["1e-150", "0.6", "0.8"], ["1e-150", "0.8", "-0.6"], normalize=True)
SCALED = vs.Veselova([3, 3, 1], ["0.6", 0, "0.8"], ["0.4e28", "0.7e28", "-0.3e28"], normalize=True)

SERIES = ("frame", "q_dot", "tau1", "spheroconic", "omega")


@pytest.mark.parametrize(
    ("problem", "times"),
    [
        (SYMMETRIC, [-3, "0.5", 10]),
        (FRAMED, [-3, "0.5", 10]),
        (SPHERE, [-3, "0.5", 30]),
        (FOUR, ["0.5", 2]),
        (TINY, [-1, 4]),
        (SCALED, ["1e-29", "3e-28"]),
    ],
    ids=["symmetric", "framed", "sphere", "four", "tiny", "scaled"],
)
def test_certified_motions_of_coincidences_hold_more_digits(
    problem: vs.Veselova, times: list[str]
) -> None:
    proven, finer = (
        vs.solve(problem, times, certified=True).decimals,
        vs.solve(problem, times, digits=45).decimals,
    )
    assert proven.certified
    assert max(proven.error) < Decimal("1e-18")
    for name in SERIES:
        difference = np.abs(proven.midpoints[name] - finer.midpoints[name])
        assert np.all(difference <= proven.radii[name] + finer.radii[name]), name


@pytest.mark.parametrize("problem", [SYMMETRIC, SPHERE, FOUR], ids=["symmetric", "sphere", "four"])
def test_certified_motions_of_equal_A_hold_the_integrated_ones(problem: vs.Veselova) -> None:
    times = np.array([-1.0, 0.5, 2.0])
    proven, (frame, _, tau1) = vs.solve(problem, times, certified=True), true_motion(problem, times)
    assert np.max(np.abs(proven.frame - frame)) < 1e-15
    assert np.max(np.abs(proven.tau1 - tau1)) < 1e-14


@pytest.mark.parametrize(
    "problem", [SYMMETRIC, FRAMED, ALIGNED], ids=["symmetric", "framed", "four"]
)
@pytest.mark.parametrize("digits", [3, 6])
def test_the_bound_of_drift_holds_where_the_start_is_moved_by_much(
    problem: vs.Veselova, digits: int
) -> None:
    """Equal A's separated by 10^(−2·digits−10): the motions of the two bodies are at most so far
    from each other.
    """
    times, given = [-1, 1, 3], moving_part(problem)
    moved = resolve_spectrum(given, digits).moving
    A = list(problem.exact.A)
    for a, vector in zip(moved.A, moved.vectors, strict=True):
        (axis,) = [i for i, component in vector.items() if component]
        A[axis] = a * moved.unit
    other = vs.Veselova(
        A, problem.exact.q, problem.exact.tangent, problem.exact.frame, normalize=True
    )
    one, two = (vs.solve(p, times, digits=40).decimals for p in (problem, other))
    logs = log_drift(
        resolve_spectrum(given, digits).spectrum, np.abs(one.midpoints["tau1"].astype(float))
    )
    bounds, opening = np.exp(logs), 10.0 ** (-2 * digits - 10)
    for name in ("tau1", "q_dot", "q"):
        apart = np.abs(one.midpoints[name] - two.midpoints[name]).astype(float)
        largest = np.max(apart.reshape(len(times), -1), axis=1)
        assert np.all(largest > 0), name
        assert np.all(largest <= bounds * opening), name
        assert np.max(largest) > 1e-6 * opening


def test_equal_A_are_not_certified_for_ever() -> None:
    with pytest.raises(vs.Unsolved, match="drift") as caught:
        vs.solve(SYMMETRIC, [1e5], certified=True)
    assert caught.value.outcome == "not-enclosed"


def test_a_separatrix_is_not_certified() -> None:
    """F_1 = v_1² + Σ (q_1v_j−q_jv_1)²/(I_1−I_j) vanishes at q = (0, 1, 1)/√2 with 1/A = 2, 1, 3,
    whatever the velocity.
    """
    problem = vs.Veselova(["1/2", 1, "1/3"], [0, 1, 1], [1, "0.5", "-0.5"], normalize=True)
    assert resolve_spectrum(moving_part(problem), 20).separatrices == (1,)
    with pytest.raises(vs.Unsolved, match="separatrix") as caught:
        vs.solve(problem, [1], certified=True)
    assert caught.value.outcome == "not-enclosed"


@pytest.mark.parametrize("digits", [62, slow(150), slow(210)])
def test_coincidences_keep_to_the_digits_asked_for(digits: int) -> None:
    """Equal A's, a separatrix, and a coordinate of 1e-150, which is no zero from there on."""
    for problem in (SYMMETRIC, TINY):
        found, fewer = (vs.solve(problem, [2], digits=d).decimals for d in (digits, 40))
        assert max(found.error) < Decimal(10) ** -digits
        assert np.max(np.abs(found.midpoints["frame"] - fewer.midpoints["frame"])) < Decimal(
            "1e-40"
        )
    smallest = vs.solve(TINY, [2], digits=max(digits, 155)).decimals.midpoints["q"][0, 0]
    assert Decimal("1e-151") < abs(smallest) < Decimal("1e-148")


def test_a_direction_that_hardly_moves_across_an_unstable_plane_costs_digits_with_time() -> None:
    """q_2 of 1e-150 grows like e^(t/4) there; doubles do not follow it, and say so like those of a
    start on the plane's edge.
    """
    problem = vs.Veselova([3, 2, 1], ["0.6", "1e-150", "0.8"], ["0.8", "1e-150", "-0.6"])
    early = vs.solve(problem, [10])
    assert early.provenance.details["regime"] == "separatrix"
    assert 1e-14 < early.error[0] < 1e-10
    few, many = (vs.solve(problem, [10], digits=digits).decimals for digits in (20, 30))
    assert np.max(np.abs(few.midpoints["frame"] - many.midpoints["frame"])) < Decimal("1e-20")
    with pytest.raises(vs.Unsolved) as caught:
        vs.solve(problem, [400])
    assert caught.value.outcome == "no-digit-left"


def test_the_natural_frame_of_a_direction_that_hardly_moves_has_all_digits() -> None:
    start = [4, 3, 2, 1], ["1e-150", "0.5", "0.6", "0.62"], ["1e-150", "0.7", "-0.3", "0.2"]
    problem = vs.Veselova(*start, normalize=True)
    finer = vs.solve(problem, [0], digits=60).decimals
    for found in (
        vs.solve(problem, [0], digits=20, certified=True).decimals,
        vs.solve(problem, [0], digits=30).decimals,
    ):
        difference = np.abs(found.midpoints["frame"] - finer.midpoints["frame"])
        assert np.all(difference <= found.radii["frame"] + finer.radii["frame"])
        assert max(found.error) < Decimal("1e-20")


@pytest.mark.parametrize("problem", [FRAMED, ALIGNED], ids=["symmetric", "four"])
def test_a_time_below_the_range_of_doubles_is_no_zero(problem: vs.Veselova) -> None:
    one, two = (
        vs.solve(problem, [time], digits=430).decimals.midpoints["tau1"][0]
        for time in ("1e-400", "2e-400")
    )
    assert one > Decimal("1e-401")
    assert abs(two / one - 2) < Decimal("1e-25")
    assert max(vs.solve(problem, ["-1e-400"], certified=True).decimals.error) < Decimal("1e-18")


@pytest.mark.parametrize(
    ("n", "exponent"),
    [(n, exponent) for n in (2, 3, 5) for exponent in (140, 146)],
)
def test_of_nearly_equal_moments_no_direction_is_dropped(n: int, exponent: int) -> None:
    """The cut between them closes with their difference, however much the body moves
    along either.
    """
    A = [
        Fraction(2),
        2 + Fraction(2, 10**exponent),
        2 + Fraction(3, 10**exponent),
        Fraction(1),
        Fraction(3),
    ][:n]
    q, q_dot = (["0.3", "-0.5", "0.4", "0.6", "0.2"][:n], ["0.2", "0.1", "-0.7", "0.3", "0.5"][:n])
    problem = vs.Veselova(A, q, q_dot, normalize=True)
    times = np.array([-2.0, 0.5, 3.0])
    found, truth = vs.solve(problem, times), true_motion(problem, times)[0]
    assert np.all(np.max(np.abs(found.frame - truth), axis=(1, 2)) <= found.error)
    assert np.max(found.error) < 1e-12
    assert np.max(np.abs(vs.solve(problem, times, digits=30).frame - truth)) < 1e-15


def test_next_to_a_separatrix_the_rounding_of_the_periods_is_in_the_error() -> None:
    """With A's within a percent the periods cancel, and the least eigenvalue of T is 1/300."""
    A, q_dot = ["1000/1979", "500/983", "135424000/269310453"], ["-17/500", "-31/125", "94/125"]
    problem = vs.Veselova(A, [Fraction(1, 10**204), "46/125", "317/1000"], q_dot, normalize=True)
    times = np.array([-3.0, 0.0, 0.1, 2.0])
    found, truth = vs.solve(problem, times), vs.solve(problem, times, digits=20)
    assert np.all(np.max(np.abs(found.frame - truth.frame), axis=(1, 2)) <= found.error)


def test_natural_frames_are_exact_beside_a_constant_of_many_directions() -> None:
    """Four and three equal A's: two constants coincide, and the other normals keep their digits."""
    data = [
        ["124/125", "123/125", "124/125", "123/125", "123/125", "123/125", "124/125"],
        ["-527/1000", "-41/500", "-77/1000", "53/125", "-111/1000", "979/1000", "67/1000"],
        ["-277/500", "-209/250", "-13/100", "-459/1000", "331/1000", "671/1000", "-149/250"],
    ]
    problem = vs.Veselova(*data, normalize=True)
    exact = vs.solve(problem, [0.0], digits=30)
    assert np.max(np.abs(problem.frame - exact.frame[0])) < 1e-15
    found = vs.solve(problem, [0.0])
    assert np.max(np.abs(found.frame - exact.frame)) <= found.error[0]
