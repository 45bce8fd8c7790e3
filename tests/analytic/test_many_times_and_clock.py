"""Many times at once against few, and the choice of the clock."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

from draws import random_problem
from generic_torus import fastest
from problems import TABLE, Case
from veselova import solve
from veselova.analytic.solve import solve as solve_analytic

#: Times that are looked at.
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
    # between the times at which sensitivities are looked at they may be larger
    assert np.median(many.error[chosen] / single.error) <= 6


def test_far_negative_times_leave_those_near_zero_as_they_are() -> None:
    problem = random_problem(np.random.default_rng(301), 3, 30.0)
    cycle = 1 / fastest(problem)
    near = np.linspace(-0.3 * cycle, 0, 40)
    far, alone = (
        solve_analytic(problem, times, time_map="panels")
        for times in (np.append(-7000 * cycle, near), near)
    )
    difference = np.max(np.abs(far.frame[1:] - alone.frame), axis=(1, 2))
    assert np.all(difference <= far.error[1:] + alone.error)


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
