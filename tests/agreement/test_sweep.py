"""Sweeps over random problems, n = 2…8, ratios of A up to 100, |t| ≤ 50. Minutes: run with ./check
--sweep.
"""

from __future__ import annotations

import numpy as np
import pytest
from test_engines import METHODS

from draws import random_problem
from truth import true_motion
from veselova import solve

pytestmark = pytest.mark.sweep


@pytest.mark.parametrize("part", range(4))
@pytest.mark.parametrize("n", range(2, 9))
def test_the_engines_agree_on_two_hundred_random_problems(n: int, part: int) -> None:
    rng = np.random.default_rng([n, part])
    for _ in range(50):
        problem = random_problem(rng, n)
        times = np.sort(rng.uniform(-50, 50, 20))
        analytic, numeric = solve(problem, times), solve(problem, times, "numeric", "taylor")
        difference = np.max(np.abs(analytic.frame - numeric.frame), axis=(1, 2))
        assert np.max(difference) <= 1e-10
        assert np.all(difference <= analytic.error + numeric.error)


@pytest.mark.parametrize("n", range(2, 9))
def test_true_errors_never_exceed_reported_ones_on_random_problems(n: int) -> None:
    rng = np.random.default_rng(100 + n)
    for _ in range(40):
        problem = random_problem(rng, n)
        times = np.sort(rng.uniform(-50, 50, 8))
        frame = true_motion(problem, times)[0]
        for engine, method in METHODS:
            # their sums are too long for so many problems
            if n > 6 and method == "theta":
                continue
            found = solve(problem, times, engine, method)
            assert np.all(np.max(np.abs(found.frame - frame), axis=(1, 2)) <= found.error)
