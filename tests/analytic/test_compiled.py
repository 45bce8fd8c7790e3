"""Compiled loops against the arrays of NumPy: the same numbers, and the same without numba."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import fields
from typing import Any

import numpy as np
import pytest
from test_ensembles import (
    BODY,
    TIMES,
    body_starts,
    require_independence,
    require_truth,
    starts,
)

import veselova as vs
from draws import adversarial_start, near_unstable_circle, random_problem
from veselova.analytic.arithmetic.double_double import DoubleDouble
from veselova.analytic.compiled import compiler
from veselova.analytic.solve import solve
from veselova.analytic.spectrum.branch_points_batch import Spectra

Array = np.ndarray[Any, Any]

#: Times that panels reach.
NEAR_TIMES: list[Any] = [0.0, 7.0, 0.3, "1/3", -90.0, 60]


@pytest.fixture(scope="module")
def loops() -> Iterator[None]:
    """Skip a test where numba is not installed, and let compiled loops serve in the others."""
    pytest.importorskip("numba")
    with compiler.compiled_loops(True):
        yield


def require_alike(found: vs.Ensemble, reference: vs.Ensemble, tables: bool = True) -> None:
    """Hold two ensembles together to a part of their errors, and the errors to one another; tables
    of their own differ by what is cut off, and periods by roundings.
    """
    assert found.outcome.tolist() == reference.outcome.tolist()
    assert found.together.tolist() == reference.together.tolist()
    rows = found.together
    error = reference.error[rows]
    off = np.abs(found.frame - reference.frame)[rows].max(axis=(2, 3))
    assert np.all(off <= error / (10 if tables else 2))
    assert found.error[rows] == pytest.approx(error, rel=1e-5 if tables else 0.2)
    speed = np.abs(reference.q_dot[rows]).max(axis=(1, 2))
    off = np.abs(found.q_dot - reference.q_dot)[rows].max(axis=(1, 2)) / speed
    assert np.all(off <= error.max(axis=1))
    off = np.abs(found.tau1 - reference.tau1)[rows]
    assert np.all(off <= 4e-15 * (1 + np.abs(reference.tau1[rows])))


@pytest.mark.parametrize("n", [2, 3])
def test_states_are_those_of_arrays(n: int, loops: None, rng: np.random.Generator) -> None:
    given = {**starts(rng, 200, n), "normalize": True}
    found = vs.solve_many(given, TIMES)
    with compiler.compiled_loops(False):
        reference = vs.solve_many(given, TIMES)
    require_alike(found, reference, tables=False)


def test_given_frames_are_those_of_arrays(loops: None, rng: np.random.Generator) -> None:
    problems = [random_problem(rng, 3, framed=k % 2 == 0) for k in range(10)]
    found = vs.solve_many(problems, TIMES)
    with compiler.compiled_loops(False):
        reference = vs.solve_many(problems, TIMES)
    require_alike(found, reference, tables=False)


@pytest.mark.parametrize("A", [BODY, [1.0, 40.0, 3.0]])
def test_flow_maps_are_those_of_arrays(
    A: list[float], loops: None, rng: np.random.Generator
) -> None:
    q, q_dot = body_starts(rng, 200)
    q[7, 1] = np.nan
    q_dot[8] = 0.0
    flow = vs.FlowMap(A)
    found = flow.solve(q, q_dot, TIMES, normalize=True)
    with compiler.compiled_loops(False):
        reference = flow.solve(q, q_dot, TIMES, normalize=True)
    require_alike(found, reference)


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
        together = vs.solve_many(problems, times)
        require_plain((together.frame, together.error), problems, times)
        if n == 3:
            q, q_dot = (np.array([getattr(p, name) for p in problems]) for name in ("q", "q_dot"))
            flow = vs.FlowMap(problems[seed % 3].A).solve(q, q_dot, times, normalize=True)
            body = [vs.Veselova(problems[seed % 3].A, *row) for row in zip(q, q_dot, strict=True)]
            require_plain((flow.frame, flow.error), body, times)


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


@pytest.mark.parametrize("n", [2, 3, 4, 6])
def test_spectra_are_those_of_arrays_to_the_bit(
    n: int, loops: None, rng: np.random.Generator
) -> None:
    from veselova.analytic.compiled.spectra import spectra_of

    given = starts(rng, 300, n)
    given["A"][:20, 0] = given["A"][:20, 1] * (1 + 1e-9)
    given["q"][20:40, 0] *= 1e-9
    expected = Spectra.of(**given)
    found = spectra_of(**given)
    rows = expected.known
    assert np.count_nonzero(rows) > 250
    for entry in fields(Spectra):
        one, other = getattr(found, entry.name), getattr(expected, entry.name)
        parts = ("high", "low") if isinstance(other, DoubleDouble) else ()
        pairs = [(getattr(one, x), getattr(other, x)) for x in parts] or [(one, other)]
        for values, reference in pairs:
            assert np.array_equal(values[rows], reference[rows]), entry.name


def test_errors_of_compiled_states_bound_the_truth(loops: None, rng: np.random.Generator) -> None:
    problems = [near_unstable_circle("1e-2", "0"), *(random_problem(rng, 3, 30) for _ in "abcdef")]
    problems = [vs.Veselova(p.A, p.q, p.q_dot, normalize=True) for p in problems]
    found = vs.solve_many(problems, TIMES)
    for i in np.flatnonzero(found.together):
        require_truth(found, i, problems[i], TIMES)
    problems = [random_problem(rng, 4, 30, framed=k % 2 == 0) for k in range(6)]
    found = vs.solve_many(problems, NEAR_TIMES)
    assert found.together.all()
    for i in range(6):
        require_truth(found, i, problems[i], NEAR_TIMES)
    q, q_dot = body_starts(rng, 6)
    found = vs.FlowMap(BODY).solve(q, q_dot, TIMES, normalize=True)
    for i in range(6):
        require_truth(found, i, vs.Veselova(BODY, q[i], q_dot[i], normalize=True), TIMES)


@pytest.mark.slow
@pytest.mark.parametrize("n", [3, 4])
def test_errors_of_compiled_states_bound_adversarial_truth(
    n: int, loops: None, rng: np.random.Generator
) -> None:
    drawn = [adversarial_start(rng, n)[1] for _ in range(200)]
    problems = [vs.Veselova(d.A, d.q, d.q_dot, normalize=True) for d in drawn]
    times = TIMES if n == 3 else NEAR_TIMES
    found = vs.solve_many(problems, times)
    assert np.count_nonzero(found.together) > 25
    for i in np.flatnonzero(found.together):
        require_truth(found, i, problems[i], times)


def test_no_compiled_number_depends_on_the_others(loops: None, rng: np.random.Generator) -> None:
    require_independence(rng)


def test_machine_code_is_kept_where_it_is_asked_for(
    tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    numba = pytest.importorskip("numba")
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))

    @compiler.compiled()
    def twice(x: float) -> float:
        return 2 * x

    assert twice(2.0) == 4.0
    assert list(tmp_path.rglob("*.nbi"))


@pytest.mark.slow
def test_loops_are_compiled_ahead_by_a_command(tmp_path: Any) -> None:
    pytest.importorskip("numba")
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    command = [sys.executable, "-m", "veselova.analytic.compiled"]
    subprocess.run(command, env=environment, check=True)
    check = "from veselova.analytic.compiled import compiler; print(compiler.is_kept())"
    command = [sys.executable, "-c", check]
    answer = subprocess.run(command, env=environment, check=True, capture_output=True, text=True)
    assert answer.stdout.strip() == "True"


def test_loops_compile_where_nothing_can_be_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    numba = pytest.importorskip("numba")
    njit = numba.njit

    def without_folder(*, cache: bool = False, **options: Any) -> Any:
        if cache:
            raise RuntimeError("cannot cache function: no locator available")
        return njit(**options)

    monkeypatch.setattr(numba, "njit", without_folder)

    @compiler.compiled()
    def thrice(x: float) -> float:
        return 3 * x

    assert thrice(2.0) == 6.0


def _modules_after(statement: str) -> str:
    code = f"import sys, numpy as np, veselova as vs\n{statement}\nprint('numba' in sys.modules)"
    answer = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    return answer.stdout.split()[-1]


def test_few_starts_and_budgets_load_no_compiler() -> None:
    given = "dict(A=[3, 2, 1], q=np.ones((9, 3)), q_dot=np.eye(3)[[0] * 9], normalize=True)"
    assert _modules_after(f"vs.solve_many({given}, [1.0])") == "False"
    code = [
        "from veselova.analytic.compiled import compiler",
        "from veselova.mechanics.core import budget",
        "with budget.limits(60.0), compiler.serving(10**9): assert not compiler.ready()",
    ]
    assert _modules_after("\n".join(code)) == "False"


def test_without_numba_arrays_serve(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "numba", None)
    for name in [name for name in sys.modules if name.startswith(f"{compiler.__package__}.")]:
        if name != compiler.__name__:
            monkeypatch.delitem(sys.modules, name)
    with pytest.raises(vs.BackendMissing, match="numba"), compiler.compiled_loops():
        pass
    with compiler.serving(10**9):
        assert not compiler.ready()
        found = vs.solve_many(
            {"A": [3, 2, 1], "q": [[0.6, 0.1, 0.8]], "q_dot": [[0, 1, 0.3]], "normalize": True},
            [1.0],
        )
    assert found.solved.all()


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
