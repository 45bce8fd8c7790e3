"""Motions by the kernel against theta quotients, digits and themselves."""

from __future__ import annotations

import gc
import os
import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from test_ensembles import TIMES

import veselova as vs
from deviations import agree
from draws import near_unstable_circle, random_problem
from veselova.analytic.kernel import compiler
from veselova.analytic.solve import solve
from veselova.mechanics.core.problem import Problem

Array = np.ndarray[Any, Any]


@pytest.mark.parametrize("n", [2, 3, 4, 6])
def test_motions_are_those_by_theta_quotients(n: int, rng: np.random.Generator) -> None:
    times = np.linspace(-3, 40, 60)
    for k in range(10):
        problem = random_problem(rng, n, 30, framed=k % 2 == 0)
        found, reference = vs.solve(problem, times), vs.solve(problem, times, method="theta")
        agree(found, reference, "frame")
        assert np.all(found.error < 3 * reference.error.max())
        assert found.tau1 == pytest.approx(reference.tau1, rel=1e-12)
        assert found.spheroconic == pytest.approx(reference.spheroconic, abs=1e-11)
        assert np.array_equal(found.at(times).frame, found.frame)


def test_rest_has_no_torus_and_theta_serves_where_it_is_named(rng: np.random.Generator) -> None:
    rest = vs.solve(vs.Veselova([3, 2, 1], [0.6, 0, 0.8], [0, 0, 0]), TIMES)
    assert rest.provenance.method == "rest"
    by_theta = vs.solve(random_problem(rng, 3), TIMES, method="theta")
    assert by_theta.provenance.method == "theta"


@pytest.mark.parametrize(
    "problem",
    [
        vs.Veselova([3, 3, 1], [0.6, 0, 0.8], [0, 1, 0]),
        vs.Veselova(["3", "2.1", "1"], [0.6, 0, 0.8], [0, 1, 0]),
        vs.Veselova([3, 2, 1], [0.6, 0, 0.8], [0.8, 0, -0.6]),
        vs.NeumannSystem([3, 2, 1], [0.6, 0, 0.8], [0, 1, 0]),
        vs.Veselova([3, 2, 1], [1, 0, 0], [0, 1, 1]),
    ],
)
def test_equal_axes_frozen_directions_and_turning_points(problem: Problem) -> None:
    found = vs.solve(problem, [-2.0, 0.0, 1.0, 30.0])
    agree(found, vs.solve(problem, [-2.0, 0.0, 1.0, 30.0], digits=20), "frame")


def test_far_times(rng: np.random.Generator) -> None:
    problem = random_problem(rng, 4)
    found = vs.solve(problem, [0.0, 1.0, 5e4])
    assert (found.provenance.details["time_map"], found.tau1[0]) == ("fourier", 0)
    agree(found, vs.solve(problem, [0.0, 1.0, 5e4], method="theta"), "frame")
    problem = random_problem(rng, 5)
    agree(vs.solve(problem, [1.0, 5e3]), solve(problem, [1.0, 5e3], time_map="panels"), "frame")


def test_narrow_gaps_and_wide_axes() -> None:
    """Beside a separatrix ψ turns by radians within 1e-8 of a cycle, and the frame does not."""
    wide = vs.Veselova([3, 2, "1e-7"], [0.6, 0.1, 0.8], [0.1, 1, 0.3], normalize=True)
    beside = [near_unstable_circle(size, "0") for size in ("1e-3", "1e-5", "1e-12", "1e-60")]
    in_five = vs.Veselova(
        ["3", "2", "1.5", "1", "0.7"],
        ["3/5", "1e-7", "0", "4/5", "0"],
        ["-8/10", "1e-7", "1", "6/10", "1/2"],
        normalize=True,
    )
    for problem in (wide, *beside, in_five):
        found = vs.solve(problem, [-1.0, 0.0, 0.3, 3.0])
        agree(found, vs.solve(problem, [-1.0, 0.0, 0.3, 3.0], digits=20), "frame")
    nearest = near_unstable_circle("1e-200", "0")
    agree(vs.solve(nearest, [0.0, 3.0]), vs.solve(nearest, [0.0, 3.0], digits=20), "frame")


def test_machine_code_that_cannot_be_written_is_copied(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    given = Path(compiler._folder(str(tmp_path / "image")))
    assert given.parent == tmp_path / "image"
    given.mkdir(parents=True)
    (given / "code").write_text("compiled")
    assert compiler._folder(str(tmp_path / "image")) == str(given)
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    copied = Path(compiler._folder(str(tmp_path / "image")))
    assert copied == tmp_path / "cache" / "veselova" / given.name
    assert (copied / "code").read_text() == "compiled"


def test_machine_code_has_one_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """numba looks for it by the path of the text."""
    known, folder = compiler._digest.__wrapped__(), Path(compiler.__file__).parent.parent
    shutil.copytree(folder, tmp_path / "analytic")
    monkeypatch.setattr(compiler, "__file__", str(tmp_path / "analytic/kernel/compiler.py"))
    assert compiler._digest.__wrapped__() != known


def test_compiled_text_frees_each_array_once(rng: np.random.Generator) -> None:
    runtime = pytest.importorskip("numba.core.runtime")
    runtime._nrt_python.memsys_enable_stats()
    problems = [random_problem(rng, 3) for _ in range(4)]

    def counted() -> tuple[int, int]:
        for times in ([1.0, 1e4], np.linspace(-3, 3, 3000), np.linspace(1e5, 1e5 + 3, 300)):
            vs.solve(problems[0], times)
        vs.solve_many(problems, [1.0, 100.0])
        vs.geodesics.Ellipsoid([3, 2, 1]).inverse([10, 20], [30, 140])
        gc.collect()
        stats = runtime.rtsys.get_allocation_stats()
        return stats.mi_alloc, stats.mi_free

    counted()
    before, after = np.array(counted()), np.array(counted())
    assert (after - before)[0] == (after - before)[1] > 50


def test_the_first_process_compiles_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    halves = list[str]()

    def start(command: list[str], env: dict[str, str]) -> Any:
        halves.append(env[compiler.HALF])
        return SimpleNamespace(wait=lambda: 0)

    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr("subprocess.Popen", start)
    for _ in range(2):
        compiler.prepare.cache_clear()
        compiler.prepare()
    assert halves == ["one", "many"]
    assert capsys.readouterr().err.count("compiling the closed form") == 1
