"""Nonuniform FFTs along an orbit against the theta sums, point by point, and what they make of the
motion.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from draws import adversarial_start, random_problem
from problems import TABLE, Case, near_separatrix, tagged
from truth import true_motion
from veselova import Trajectory, Unsolved, Veselova, solve
from veselova.analytic.motion.torus_solution import Solution
from veselova.analytic.theta import nufft as transforms

MOVING = [case for case in TABLE if "at-rest" not in case.tags and case.problem().n <= 6]


def entries(at: Any) -> Any:
    return np.concatenate([at.q, at.components, at.normals.reshape(len(at.q), -1)], axis=1)


def assert_like_theta_sums(solution: Solution, cycles: Any) -> None:
    """At the given cycles of the fastest phase the entries differ by no more than
    what is stated.
    """
    tau1 = cycles / np.max(np.abs(solution.in_tau1.rates))
    z = solution.in_tau1.phases(tau1)
    found, rounding = solution.transforms.at(tau1, z)
    difference = np.max(np.abs(entries(found) - entries(solution.quotients.at(z))), axis=1)
    assert np.all(difference <= rounding)


def answer(problem: Veselova, times: Any) -> Trajectory | Unsolved:
    try:
        return solve(problem, times, method="nufft")
    except Unsolved as refusal:
        return refusal


@pytest.mark.parametrize("case", MOVING, ids=lambda case: case.name)
def test_transforms_are_the_theta_sums_to_the_stated_rounding(case: Case) -> None:
    """Dense and sparse, backwards and forwards."""
    solution = Solution(case.problem())
    scattered = np.random.default_rng(1).uniform(-30, 30, 1500)
    assert_like_theta_sums(
        solution, np.unique(np.concatenate([scattered, np.linspace(-1000, 1000, 30)]))
    )


@pytest.mark.parametrize("gap", [1e-2, 1e-5, 1e-8, 1e-14])
def test_what_cancels_near_a_separatrix_is_in_the_stated_rounding(gap: float) -> None:
    """There θ(z) falls to the fourth root of the gap."""
    solution = Solution(near_separatrix(gap).problem())
    assert_like_theta_sums(solution, np.linspace(-8, 8, 2000))
    tau1 = np.linspace(-8, 8, 2000) / np.max(np.abs(solution.in_tau1.rates))
    rounding = np.max(solution.transforms.at(tau1, solution.in_tau1.phases(tau1))[1])
    assert 3e-14 < rounding * gap**0.25 < 6e-14


@pytest.mark.parametrize("case", tagged("reference", "generic"), ids=lambda case: case.name)
def test_transforms_reach_the_reference_motions(case: Case) -> None:
    wanted = np.array([float(point["t"]) for point in case.points])
    frame = np.array([np.array(point["frame"], dtype=float) for point in case.points])
    times = np.unique(np.concatenate([wanted, np.linspace(0, case.horizon, 2000)]))
    found = solve(case.problem(), times, method="nufft").frame[np.searchsorted(times, wanted)]
    assert np.max(np.abs(found - frame)) <= 1e-12


def test_the_motion_is_that_of_theta_sums_at_many_times(rng: np.random.Generator) -> None:
    """More times than are taken at once, in windows with few and with many of them."""
    problem = random_problem(rng, 3, 10.0)
    times = np.unique(np.concatenate([rng.uniform(-10, 20, 36_000), np.linspace(-900, 900, 100)]))
    found, expected = solve(problem, times, method="nufft"), solve(problem, times, method="theta")
    assert found.provenance.method == "nufft"
    assert found.provenance.details["evaluations"] == times.size
    assert np.all(
        np.max(np.abs(found.frame - expected.frame), axis=(1, 2)) <= found.error + expected.error
    )
    assert np.max(found.error - expected.error) < 2e-13
    assert np.max(np.abs(found.spheroconic - expected.spheroconic)) < 1e-11


@pytest.mark.parametrize("t", [1e6, 1e9, 1e15])
def test_far_times_keep_their_digits(t: float) -> None:
    """Times there have too few bits for the phases between them, and from 1e15 on for windows."""
    problem = Veselova([3, 2, "1.5", 1], ["0.5"] * 4, ["1.1", "-0.7", "0.3", "-0.7"])
    times = np.unique(t + np.linspace(0, 40, 400))
    found, expected = solve(problem, times, method="nufft"), solve(problem, times, method="theta")
    assert found.provenance.details["guard_digits"]
    assert np.max(np.abs(found.frame - expected.frame)) < 3e-13


def test_windows_that_hold_few_times_take_no_transform(
    monkeypatch: Any, rng: np.random.Generator
) -> None:
    solution, calls = Solution(random_problem(rng, 4)), 0

    def counted(*arguments: Any, **options: Any) -> Any:
        nonlocal calls
        calls += 1
        return transform(*arguments, **options)

    transform = transforms._transform()
    monkeypatch.setattr(transforms, "_transform", lambda: counted)
    sparse, dense = np.linspace(-1e5, 1e5, 2000), np.linspace(40, 41, 500)
    assert_like_theta_sums(solution, sparse)
    assert calls == 0
    assert_like_theta_sums(solution, np.unique(np.concatenate([sparse, dense])))
    assert 0 < calls <= 2 * len({function.epsilon for function in solution.quotients.functions})


@pytest.mark.parametrize("seed", range(0, 28, 2))
def test_adversarial_starts_are_served_honestly_or_refused_by_name(seed: int) -> None:
    name, problem = adversarial_start(np.random.default_rng([2024, seed]), 2 + seed % 4)
    fastest = float(np.max(np.abs(Solution(problem).in_time.rates)))
    times = np.array([-5, 0, 0.1, 1, 5]) * min(
        1 / float(np.max(np.abs(problem.q_dot))), 2 / fastest
    )
    times = np.unique(np.concatenate([times, np.linspace(times[0], times[-1], 200)]))
    found = answer(problem, times)
    if isinstance(found, Unsolved):
        assert (found.outcome, name) == ("no-digit-left", "near a separatrix")
        return
    chosen = np.linspace(0, times.size - 1, 9).astype(int)
    frame = true_motion(problem, times[chosen])[0]
    assert np.all(
        np.max(np.abs(found.frame[chosen] - frame), axis=(1, 2)) <= found.error[chosen]
    ), name


def test_sums_that_leave_no_digit_are_a_named_outcome() -> None:
    problem = Veselova(
        ["1", "1/10", "1/26"], ["3/5", "1e-100", "4/5"], ["4/5", 1, "-3/5"], normalize=True
    )
    times = np.linspace(0, 20, 300)
    assert np.max(solve(problem, times, method="theta").error) < 1e-6
    with pytest.raises(Unsolved, match="sums of nufft cancel") as raised:
        solve(problem, times, method="nufft")
    assert raised.value.outcome == "no-digit-left"


def test_sums_that_would_fill_the_memory_are_a_named_outcome(rng: np.random.Generator) -> None:
    with pytest.raises(Unsolved) as raised:
        solve(random_problem(rng, 12), [1.0], method="nufft")
    assert raised.value.outcome == "too-many-terms"


def test_transforms_are_never_taken_of_themselves() -> None:
    assert {Solution(case.problem()).default_method() for case in MOVING} == {"theta", "angles"}
    assert (
        solve(tagged("generic")[1].problem(), [1.0], method="nufft").provenance.details[
            "theta_terms"
        ]
        > 1
    )
