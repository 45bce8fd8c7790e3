"""Compiled loops against the arrays of NumPy: the same numbers, and the same without numba."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from test_ensembles import TIMES

import veselova as vs
from draws import near_unstable_circle, random_problem
from veselova.analytic.compiled import compiler
from veselova.analytic.solve import solve

Array = np.ndarray[Any, Any]


@pytest.fixture(scope="module")
def loops() -> Iterator[None]:
    """Skip a test where numba is not installed, and let compiled loops serve in the others."""
    pytest.importorskip("numba")
    with compiler.compiled_loops(True):
        yield


@pytest.mark.parametrize("n", [2, 3, 4, 6])
def test_single_motions_are_those_of_arrays(n: int, loops: None, rng: np.random.Generator) -> None:
    times = np.linspace(-3, 40, 60)
    for k in range(20):
        problem = random_problem(rng, n, 30, framed=k % 2 == 0)
        found = vs.solve(problem, times)
        assert found.provenance.details["compiled"]
        with compiler.compiled_loops(False):
            reference = vs.solve(problem, times)
        off = np.abs(found.frame - reference.frame).max(axis=(1, 2))
        assert np.all(off <= (found.error + reference.error) / 2)
        assert np.all(found.error < 2 * reference.error.max())
        assert found.tau1 == pytest.approx(reference.tau1, rel=1e-12)
        assert found.spheroconic == pytest.approx(reference.spheroconic, abs=1e-11)
        assert np.array_equal(found.at(times).frame, found.frame)


@pytest.mark.parametrize("n", [2, 3, 4])
def test_times_near_each_other_are_those_alone(
    n: int, loops: None, rng: np.random.Generator
) -> None:
    times = np.linspace(0, 20, 401)
    chosen, served = slice(20, None, 40), 0
    for k in range(30):
        problem = random_problem(rng, n, 100, framed=k % 2 == 0)
        found, alone = (vs.solve(problem, t) for t in (times, times[chosen]))
        both = ["compiled" in one.provenance.details for one in (found, alone)]
        assert both[0] == both[1]
        if not both[0]:
            continue
        served += 1
        off = np.abs(found.frame[chosen] - alone.frame).max(axis=(1, 2))
        assert np.all(off <= alone.error / 5)
        assert found.error[chosen] == pytest.approx(alone.error, rel=0.25)
        assert found.tau1[chosen] == pytest.approx(alone.tau1, rel=1e-14, abs=1e-14)
    assert served > 20


def require_plain(found: Any, problems: list[vs.Veselova], times: Array) -> None:
    """Hold motions by loops, (N, T, n, n) with errors (N, T), to those without."""
    frames, errors = found
    with compiler.compiled_loops(False):
        plain = [vs.solve(problem, times) for problem in problems]
    for frame, error, reference in zip(frames, errors, plain, strict=True):
        off = np.abs(frame - reference.frame).max(axis=(1, 2))
        assert np.all(off <= error + reference.error)


def irregular(seed: int, n: int) -> tuple[Array, list[vs.Veselova]]:
    """Return few uneven times, and problems with A's near each other, some apart and any."""
    rng = np.random.default_rng(seed)
    times = np.sort(rng.uniform(0, rng.choice([2.0, 3.0, 6.0]), rng.integers(7, 12)))
    widths = [1e-3, 1e-3, 1e-3, 1e-2, 5.0]
    A = 1 + np.array([width * rng.random(n) for width in widths])
    starts = rng.normal(size=(len(widths), 2, n))
    problems = [vs.Veselova(a, *start, normalize=True) for a, start in zip(A, starts, strict=True)]
    return times, problems


@pytest.mark.parametrize(
    ("n", "seeds"),
    [
        (2, (57, 98, 99, 145)),
        *(pytest.param(n, range(20), marks=pytest.mark.slow) for n in (2, 3, 4)),
    ],
)
def test_irregular_times_have_the_motions_of_arrays(n: int, seeds: Any, loops: None) -> None:
    for seed in seeds:
        times, problems = irregular(seed, n)
        alone = [vs.solve(problem, times) for problem in problems]
        require_plain(zip(*((x.frame, x.error) for x in alone), strict=True), problems, times)


def test_what_loops_do_not_serve_is_solved_without(loops: None, rng: np.random.Generator) -> None:
    problems = [
        vs.Veselova([3, 3, 1], [0.6, 0, 0.8], [0, 1, 0]),
        vs.Veselova(["3", "2.1", "1"], [0.6, 0, 0.8], [0, 1, 0]),
        vs.Veselova([3, 2, 1], [0.6, 0, 0.8], [0, 0, 0]),
        random_problem(rng, 5),
        vs.NeumannSystem([3, 2, 1], [0.6, 0, 0.8], [0, 1, 0]),
    ]
    for problem in problems:
        found = vs.solve(problem, TIMES)
        assert "compiled" not in found.provenance.details
        with compiler.compiled_loops(False):
            reference = vs.solve(problem, TIMES)
        assert np.array_equal(found.q, reference.q)
    by_theta = vs.solve(random_problem(rng, 3), TIMES, method="theta")
    assert by_theta.provenance.method == "theta"


def test_far_times_are_those_of_arrays(loops: None, rng: np.random.Generator) -> None:
    problem = random_problem(rng, 4)
    found = vs.solve(problem, [1.0, 5e4])
    assert found.provenance.details["time_map"] == "fourier"
    assert "compiled" in found.provenance.details
    with compiler.compiled_loops(False):
        reference = vs.solve(problem, [1.0, 5e4])
    off = np.abs(found.frame - reference.frame).max(axis=(1, 2))
    assert np.all(off <= found.error + reference.error)
    problem = random_problem(rng, 5)
    assert "compiled" in vs.solve(problem, [1.0, 50.0]).provenance.details
    assert "compiled" not in vs.solve(problem, [1.0, 5e4]).provenance.details


@pytest.mark.parametrize("time_map", ["fourier", "panels"])
def test_a_named_time_map_is_taken(time_map: str, loops: None, rng: np.random.Generator) -> None:
    problem = random_problem(rng, 3)
    found = solve(problem, [1.0, 50.0], time_map=time_map)
    assert found.provenance.details["time_map"] == time_map
    assert "compiled" in found.provenance.details
    other = vs.solve(problem, [1.0, 50.0])
    assert np.all(np.abs(found.frame - other.frame).max(axis=(1, 2)) <= found.error + other.error)


def test_narrow_gaps_and_wide_axes_are_handed_over(loops: None) -> None:
    wide = vs.Veselova([3, 2, "1e-7"], [0.6, 0.1, 0.8], [0.1, 1, 0.3], normalize=True)
    for problem in (wide, *(near_unstable_circle(size, "0") for size in ("1e-5", "1e-200"))):
        assert "compiled" not in vs.solve(problem, [0.0, 3.0]).provenance.details


def test_equal_work_has_equal_results_whatever_is_loaded(
    loops: None, rng: np.random.Generator
) -> None:
    problem = random_problem(rng, 3, 30)
    with compiler.compiled_loops(False):
        before = vs.solve(problem, TIMES)
        with compiler.compiled_loops():
            inside = vs.solve(problem, TIMES)
        after = vs.solve(problem, TIMES)
    assert np.array_equal(before.frame, after.frame)
    assert inside.provenance.details["compiled"]


def test_loops_are_compiled_where_compiling_is_disabled(loops: None) -> None:
    code = [
        "import veselova as vs",
        "with vs.compiled_loops():",
        "    motion = vs.solve(vs.Veselova([2, 1], [0.6, 0.8], [0.8, -0.6]), [0.3, 7])",
        "print(motion.provenance.details['compiled'], motion.frame.tobytes().hex())",
    ]
    answers = {
        subprocess.run(
            [sys.executable, "-c", "\n".join(code)],
            env={**os.environ, "NUMBA_DISABLE_JIT": disabled},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for disabled in ("0", "1")
    }
    assert len(answers) == 1
