"""Many times by series of states on panels: the motion of each time alone, and of its digits."""

from __future__ import annotations

import pickle
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import veselova as vs
from conftest import slow
from deviations import agree, apart
from draws import random_problem
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.results.trajectory import Trajectory


def solve(problem: Problem, times: Any, **options: Any) -> Trajectory:
    return vs.solve(problem, times, "analytic", **options)


def body(seed: int, n: int, ratio: float = 20.0) -> vs.Veselova:
    return random_problem(np.random.default_rng(seed), n, ratio)


def hold(problem: Problem, times: Any, chosen: Any) -> Trajectory:
    """Hold some of many times to the same alone, and some of these to twenty digits."""
    many, alone = solve(problem, times), solve(problem, times[chosen])
    true = vs.solve(problem, times[chosen[:3]], "analytic", digits=20)
    assert np.median(many.error[chosen] / alone.error) < 30
    some = {name: many.series(name)[chosen] for name in problem.bounded}
    some["error"] = many.error[chosen]
    agree(SimpleNamespace(**some), alone, *problem.bounded)
    first = SimpleNamespace(**{name: values[:3] for name, values in some.items()})
    assert np.all(apart(first, true, problem.bounded) <= first.error)
    identity = np.swapaxes(many.frame, 1, 2) @ many.frame
    assert np.max(np.abs(identity - np.eye(problem.n))) < 1e-12
    return many


@pytest.mark.parametrize("n", [2, 4, slow(5), slow(6)])
def test_unsorted_times_of_both_signs(n: int) -> None:
    times = np.random.default_rng(n).uniform(-6, 20, 3000)
    many = hold(body(n, n), times, np.arange(0, 3000, 300))
    assert np.all(np.diff(many.tau1[np.argsort(times)]) >= 0)
    kept = pickle.loads(pickle.dumps(many))
    assert np.array_equal(many.frame, kept.frame)


@pytest.mark.parametrize(
    ("n", "far", "time_map"), [(3, 8, "fourier"), slow(4, 8, "fourier"), slow(5, 1, "panels")]
)
def test_clusters_and_times_far_apart(n: int, far: int, time_map: str) -> None:
    dense = [far * start + np.linspace(0, 3, 700) for start in (-200.0, -2.0, 10.0, 150.0)]
    times = np.concatenate([*dense, far * np.linspace(-300, 300, 40)])
    many = hold(body(n, n, 5.0), times, np.arange(3, times.size, 217))
    assert many.provenance.details["time_map"] == time_map


def test_far_out_no_error_grows() -> None:
    problem, chosen = body(6, 3), np.arange(0, 4000, 400)
    many = hold(problem, 1e6 + np.linspace(0, 100, 4000), chosen)
    near = solve(problem, np.linspace(0, 100, 4000))
    assert np.max(many.error) < 10 * np.max(near.error)


def test_geodesics_and_neumann_motions() -> None:
    times, chosen = np.linspace(-10, 30, 3000), np.arange(0, 3000, 300)
    hold(vs.EllipsoidGeodesic([9, 4, 1], [1, 1, 1], [0.5, -1, 2], normalize=True), times, chosen)
    hold(vs.NeumannSystem([3, 2, 1], [0.6, 0.48, 0.64], [0.8, -0.36, -0.48]), times, chosen)


def test_many_times_stop_at_a_budget() -> None:
    problem = body(4, 4)
    solve(problem, np.linspace(0, 10, 1000))
    with pytest.raises(vs.OverBudget):
        solve(problem, np.linspace(0, 1e5, 2_000_000), budget_s=0.3)
