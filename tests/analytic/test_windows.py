"""Many times at once: windows against the same motion time by time, and the choice of the clock."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from fractions import Fraction

import numpy as np
import pytest

from draws import random_problem
from problems import TABLE, Case, tagged
from veselova import NeumannSystem, solve
from veselova.analytic.dense_output import piecewise_polynomial as pieces
from veselova.analytic.motion.torus_solution import Solution
from veselova.analytic.numerics.monotone_root import fourth_order_divisor
from veselova.analytic.solve import solve as solve_analytic
from veselova.analytic.time_map.cost_model import Costs, estimate_modes

#: Fewer times than these are taken one by one.
FEW = 100

MOVING = [case for case in TABLE if "at-rest" not in case.tags and case.problem().n <= 6]


def assert_one_motion(many: object, single: object, chosen: np.ndarray) -> None:
    for name in ("frame", "q", "tau1", "spheroconic"):
        found, expected = many.series(name)[chosen], single.series(name)
        size = np.maximum(1.0, np.max(np.abs(expected))) if name in ("tau1", "spheroconic") else 1.0
        difference = np.max(np.abs(found - expected).reshape(chosen.size, -1), axis=1) / size
        assert np.all(difference <= many.error[chosen] + single.error), name


@pytest.mark.parametrize("case", MOVING, ids=lambda case: case.name)
def test_many_times_are_the_motion_of_each(case: Case) -> None:
    problem = case.problem()
    span = min(case.span, 20.0 / max(problem.turning, 1e-300))
    times = np.unique(np.random.default_rng(1).uniform(-span, span, 1500))
    chosen = np.sort(np.random.default_rng(2).permutation(times.size)[:FEW])
    many, single = solve(problem, times), solve(problem, times[chosen])
    assert_one_motion(many, single, chosen)
    assert np.all(many.error[chosen] <= 2 * single.error)


def test_interpolation_takes_few_evaluations_and_loses_nothing() -> None:
    problem, times = random_problem(np.random.default_rng(5), 4), np.linspace(-20, 40, 3000)
    many = solve(problem, times)
    assert many.provenance.details["evaluations"] < times.size
    for rows in np.split(np.arange(times.size), 10):  # too few times at once for intervals
        single = solve(problem, times[rows])
        assert single.provenance.details["evaluations"] == rows.size
        assert_one_motion(many, single, rows)
        assert np.max(np.abs(many.frame[rows] - single.frame)) < 1e-13


@pytest.mark.parametrize("method", ["theta", "angles"])
@pytest.mark.parametrize("clock", ["fourier", "panels"])
def test_windows_serve_either_clock_and_route(method: str, clock: str) -> None:
    problem = random_problem(np.random.default_rng(4), 4)
    # Dense here, sparse there, and in both directions.
    times = np.unique(
        np.concatenate(
            [np.linspace(-9, -7, 800), np.linspace(-5, 30, 50), np.geomspace(1e-6, 8, 900)]
        )
    )
    chosen = np.arange(0, times.size, 20)
    many = solve_analytic(problem, times, method=method, time_map=clock)
    assert many.provenance.details["evaluations"] < times.size
    assert_one_motion(
        many, solve_analytic(problem, times[chosen], method=method, time_map=clock), chosen
    )
    identity = np.swapaxes(many.frame, 1, 2) @ many.frame
    assert np.max(np.abs(identity - np.eye(4))) < 1e-13


def test_far_windows_keep_every_digit() -> None:
    problem = random_problem(np.random.default_rng(6), 3)
    times = 1e8 + np.linspace(0, 3, 1000)
    chosen = np.arange(0, 1000, 11)
    many, single = solve(problem, times), solve(problem, times[chosen])
    assert many.provenance.details["evaluations"] < 500
    assert np.max(np.abs(many.frame[chosen] - single.frame)) < 1e-13


def test_stretches_far_apart_have_windows_of_their_own() -> None:
    problem = random_problem(np.random.default_rng(6), 3)
    times = np.unique(
        np.concatenate([start + np.linspace(0, 3, 700) for start in (-1e6, -2.0, 10.0, 1e5)])
    )
    many, chosen = solve(problem, times), np.arange(0, times.size, 13)
    assert many.provenance.details["evaluations"] < times.size
    assert_one_motion(many, solve(problem, times[chosen]), chosen)


def test_series_from_windows_share_their_rows_and_survive_pickling() -> None:
    problem = random_problem(np.random.default_rng(6), 3)
    many = solve(problem, np.linspace(0, 10, 2000))
    kept = pickle.loads(pickle.dumps(many))
    for name in problem.outputs:
        assert np.array_equal(many.series(name), kept.series(name))
        assert not many.series(name).flags.writeable


def test_windows_serve_neumann_time() -> None:
    problem = NeumannSystem([3, 2, 1], [0.6, 0.48, 0.64], [0.8, -0.36, -0.48])
    times = np.linspace(-10, 10, 2000)
    many, single = solve(problem, times), solve(problem, times[::25])
    assert many.provenance.details["evaluations"] < 2000
    assert np.max(np.abs(many.frame[::25] - single.frame)) < 1e-13


def test_the_clock_is_chosen_by_what_it_costs() -> None:
    problem = tagged("reference", "generic")[-1].problem()
    near, far = solve(problem, [1.0]), solve(problem, [100.0])
    for found in (near, far):
        estimates = found.provenance.details["time_map_estimates"]
        assert found.provenance.details["time_map"] == min(estimates, key=estimates.__getitem__)
    assert near.provenance.details["time_map"] == "panels"


def test_panels_are_the_cheaper_time_map_of_any_high_dimension() -> None:
    """Modes of the Fourier clock at n = 1000 are beyond any float, and so is det T at times."""
    costs = Costs(genus=999, modes=estimate_modes(999, -500.0), cycles=10.0)
    assert costs.modes > 1e25
    assert costs.seconds("fourier", 10) == np.inf
    assert costs.cheaper_time_map(inversions=10) == "panels"
    assert costs.fewest_in_window(32, "fourier") >= 4
    assert costs.fewest_in_window(32, "panels") >= 4


@pytest.mark.parametrize("span", [(-3, 4), (0, 30), (-20, 0)])
@pytest.mark.parametrize("n", [3, 4, 5])
def test_windows_on_panels_reach_the_ends_of_the_times(n: int, span: tuple[float, float]) -> None:
    """With these A's the mean clock is far off at the ends of some spans."""
    problem = random_problem(np.random.default_rng(6), n, 100.0)
    times, chosen = np.linspace(*span, 3000) / problem.turning, np.arange(0, 3000, 37)
    many = solve_analytic(problem, times, time_map="panels")
    assert many.provenance.details["evaluations"] < times.size
    for clock in ("panels", "fourier"):
        assert_one_motion(many, solve_analytic(problem, times[chosen], time_map=clock), chosen)
    at_zero = np.argmin(np.abs(times))
    assert (
        many.error[at_zero]
        <= 2 * solve_analytic(problem, times[[at_zero]], time_map="panels").error[0]
    )


def test_far_negative_times_leave_those_near_zero_as_they_are() -> None:
    problem = random_problem(np.random.default_rng(301), 3, 30.0)
    cycle = 1 / np.max(np.abs(Solution(problem).in_time.rates))
    near = np.linspace(-0.3 * cycle, 0, 40)
    far, alone = (
        solve_analytic(problem, times, time_map="panels")
        for times in (np.append(-7000 * cycle, near), near)
    )
    difference = np.max(np.abs(far.frame[1:] - alone.frame), axis=(1, 2))
    assert np.all(difference <= far.error[1:] + alone.error)


@pytest.mark.parametrize(
    "begin", [0.0, 0.75, -3.0, 3e5, -(2.0**40), 0.0031415926535897934, -0.31415926535897934]
)
def test_times_next_to_borders_are_placed_as_if_these_were_not_rounded(begin: float) -> None:
    offsets = np.sort(np.random.default_rng(6).uniform(0, 3, 200))
    sums = begin + offsets
    times = np.unique(
        np.concatenate([sums, np.nextafter(sums, np.inf), np.nextafter(sums, -np.inf)])
    )
    found = pieces._first_from(times, np.full(200, begin), offsets)
    exact = [Fraction(t) for t in times.tolist()]
    expected = [
        next(i for i, t in enumerate(exact) if t >= Fraction(begin) + Fraction(o))
        for o in offsets.tolist()
    ]
    assert found.tolist() == expected


def test_the_first_step_in_a_piece_is_of_fourth_order() -> None:
    slope, a, b = np.array(2.0), np.array(0.6), np.array(-0.4)

    def left(h: float) -> float:
        value = -(slope * h + a * h**2 + b * h**3)
        return abs(float(value / fourth_order_divisor(value, slope, a, b)) + h)

    assert 14 < left(0.02) / left(0.01) < 18


@pytest.mark.skipif(sys.platform != "linux", reason="counts what glibc asks the system for")
def test_temporaries_stay_in_the_process() -> None:
    code = """
import resource
import numpy as np
from veselova import Veselova, solve

for k in range(8):
    A, q_dot = [4, 3, 2, 1 + k / 100], [0.3, -0.7, 0.4, 0]
    problem = Veselova(A, [1, 1, 1, 1], q_dot, normalize=True)
    if k == 4:
        before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    solve(problem, np.linspace(0, 100, 1000))
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""
    # Dask, where a test has loaded it, sets glibc's threshold for all processes that follow.
    environment = {
        name: value for name, value in os.environ.items() if not name.startswith("MALLOC_")
    }
    command = [sys.executable, "-c", code]
    asked = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
    assert int(asked.stdout) < 300  # a dozen; a thousand and more where every temporary comes anew
