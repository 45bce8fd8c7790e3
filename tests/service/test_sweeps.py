"""Sweeps from Python and the command line: which problems they are, what is said of each, and what
outlives a process.
"""

from __future__ import annotations

import io
import json
import math
import os
import re
import signal
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray
from pyarrow import parquet

import veselova as vs
from conftest import PATIENCE, command_line, interpreter, wait_until, workers_of
from veselova.mechanics.core.errors import InvalidRequest
from veselova.service.api.request_models import read_request
from veselova.service.api.sweep_parameters import components
from veselova.service.api.sweep_request import SweepRequest
from veselova.service.cli.local_sweep import local_settings, run_sweep
from veselova.service.sweeps import runner as running
from veselova.service.sweeps.chunk import OtherVersion, compute_chunk
from veselova.service.sweeps.columns import columns_at_once
from veselova.service.sweeps.job_store import Jobs
from veselova.version import __version__

BASE = {
    "system": "veselova",
    "A": [3, "1.5", 1],
    "q": [0.6, 0, 0.8],
    "q_dot": [0, 0.5, 0],
    "normalize": True,
}
DRAWN = {"/A/0": [2, 3, 4], "/q_dot": {"normal": [0, 1]}}


def request(**changes: Any) -> SweepRequest:
    return read_request(
        SweepRequest, {"problem": BASE, "vary": DRAWN, "samples": 5, "seed": 7, **changes}
    )


def span(count: int, **changes: Any) -> dict[str, Any]:
    """Return so many values from 1 to 2 as a request states them, with changes."""
    return {"start": 1, "stop": 2, "count": count, **changes}


def rows(sweep: SweepRequest, start: int, stop: int) -> list[dict[str, Any]]:
    table = parquet.read_table(io.BytesIO(compute_chunk(sweep.canonical, start, stop, __version__)))
    found: list[dict[str, Any]] = table.to_pylist()
    return found


def test_axes_are_combined_and_the_last_runs_fastest() -> None:
    sweep = request(vary={"/A/0": [2, 3], "/q_dot/1": span(3)}, samples=1)
    assert sweep.shape == (2, 3)
    assert [dict(sweep.columns(sweep.values(row))) for row in (0, 1, 3)] == [
        {"A_1": 2, "q_dot_2": 1},
        {"A_1": 2, "q_dot_2": 1.5},
        {"A_1": 3, "q_dot_2": 1},
    ]
    problem = sweep.request_of(sweep.values(4)).problem.problem.as_dict()
    assert (problem["A"][0], problem["A"][1], problem["q_dot"][1]) == (3, "1.5", 1.5)


def test_a_draw_depends_on_seed_and_row_alone() -> None:
    sweep, other = request(), request(seed=8)
    assert sweep.total == 15
    assert sweep.values(11) == request().values(11) != other.values(11)
    assert sweep.values(11) != sweep.values(12)
    assert request(samples=9).values(3) == sweep.values(3)


@pytest.mark.parametrize(
    ("stated", "inside"),
    [
        ({"uniform": [2, 3]}, lambda x: np.all((x >= 2) & (x <= 3)) and abs(x.mean() - 2.5) < 0.05),
        (
            {"log_uniform": ["0.01", 100]},
            lambda x: np.all((x >= 0.01) & (x <= 100)) and abs(np.log10(x).mean()) < 0.2,
        ),
        ({"normal": [5, 0.1]}, lambda x: abs(x.mean() - 5) < 0.02 and abs(x.std() - 0.1) < 0.02),
    ],
)
def test_distributions_are_what_they_say(stated: Any, inside: Any) -> None:
    sweep = request(vary={"/A": stated}, samples=300)
    drawn = np.array([list(dict(sweep.columns(sweep.values(row))).values()) for row in range(300)])
    assert drawn.shape == (300, 3)
    assert inside(drawn)


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"vary": {"/B": [1]}}, "vary./B"),
        ({"vary": {"/system": [1]}}, "vary./system"),
        ({"vary": {"A": [1]}}, "vary.A"),
        ({"vary": {"": [1]}}, "vary."),
        ({"vary": {"/A/9": [1]}}, "vary./A/9"),
        ({"vary": {"/A/-1": [1]}}, "vary./A/-1"),
        ({"vary": {"/A/0": []}}, "vary./A/0"),
        ({"vary": {"/A/0": 3}}, "vary./A/0"),
        ({"vary": {"/A": [[1, 2]]}}, "vary./A[0]"),
        ({"vary": {"/A/0": [[1, 2]]}}, "vary./A/0[0]"),
        ({"vary": {"/A": span(3)}}, "vary./A"),
        ({"vary": {"/A/0": span(0)}}, "vary./A/0.count"),
        ({"vary": {"/A/0": span(10**9)}}, "vary./A/0.count"),
        ({"vary": {"/A/0": span(3, stop="x")}}, "vary./A/0.stop"),
        ({"vary": {"/A/0": span(3, start=-1e308, stop=1e308)}}, "vary./A/0"),
        ({"vary": {f"/A/{i}": span(400_000) for i in range(3)}}, "vary"),
        ({"vary": {"/A/0": [3, math.nan]}}, "vary./A/0[1]"),
        ({"vary": {"/A/0": [3, "\ud800"]}, "samples": 1}, "the request"),
        ({"vary": {"/\ud800": [3]}}, "vary./\\ud800"),
        ({"vary": {"/A/0": span(3, start=0, spacing="log")}}, "vary./A/0"),
        ({"vary": {"/A/0": span(3, spacing="cubic")}}, "vary./A/0.spacing"),
        ({"vary": {"/A/0": {"uniform": [2, 1]}}}, "vary./A/0.uniform"),
        ({"vary": {"/A/0": {"uniform": [1]}}}, "vary./A/0.uniform"),
        ({"vary": {"/A/0": {"uniform": [-1.7e308, 1.7e308]}}}, "vary./A/0.uniform"),
        ({"vary": {"/system": ["veselova"]}}, "vary./system"),
        ({"vary": {"/A/0": {"normal": [1, -1]}}}, "vary./A/0.normal"),
        ({"vary": {"/A/0": {"log_uniform": [0, 1]}}}, "vary./A/0.log_uniform"),
        ({"vary": {"/A/0": {"cauchy": [0, 1]}}}, "vary./A/0"),
        ({"vary": {"/A": {"uniform": [1, 2]}, "/A/0": [1]}}, "vary./A/0"),
        ({"vary": {"/normalize": {"uniform": [1, 2]}}}, "vary./normalize"),
        ({"vary": {}}, "vary"),
        ({"vary": [1]}, "vary"),
        ({"samples": 0}, "samples"),
        ({"samples": 2**63}, "samples"),
        ({"samples": 10**6, "vary": {**DRAWN, "/A/0": span(10**6)}}, "vary"),
        ({"samples": 2, "vary": {"/A/0": [1, 2]}}, "samples"),
        ({"seed": -1}, "seed"),
        ({"engine": "analytic"}, "engine"),
        ({"trajectories": True}, "trajectories"),
        ({"times": []}, "times"),
        ({"times": {"start": 0}}, "times.stop"),
        ({"times": [0, 1], "outputs": ["nothing"]}, "outputs[0]"),
        ({"vary": {"/A/0": [-1, -2]}, "samples": 1}, "vary./A/0[0]"),
        ({"vary": {"/A/1": [1, 2], "/A": [[3, 2, -1]]}, "samples": 1}, "vary./A"),
        ({"vary": {"/q/1": [0.5], "/A": [[3, 2, -1]]}, "samples": 1}, "vary./A[0][2]"),
        ({"vary": {"/A/0": {"uniform": [-2, -1]}}}, "vary./A/0"),
        ({"vary": {"/A/0": span(2, start=-2, stop=-1)}, "samples": 1}, "vary./A/0"),
        ({"budget_s": 0}, "budget_s"),
        ({"nonsense": 1}, "nonsense"),
    ],
)
def test_a_fault_is_named_before_anything_runs(changes: dict[str, Any], field: str) -> None:
    with pytest.raises(InvalidRequest) as refusal:
        request(**changes)
    assert refusal.value.faults[0].field == field


def test_a_row_says_what_torus_and_solve_say() -> None:
    times = {"start": 0, "stop": 3, "count": 7}
    sweep = request(times=times)
    for row, found in enumerate(rows(sweep, 0, 4)):
        problem = sweep.request_of(sweep.values(row)).problem.problem
        expected, motion = vs.torus(problem), vs.solve(problem, np.linspace(0, 3, 7))
        assert found["row"] == row
        assert found["outcome"] == "solved"
        for name in ("energy", "mean_rate", "regime"):
            assert found[name] == getattr(expected, name)
        for name in ("constants", "frequencies_t", "actions", "phases", "branch_points"):
            assert [
                found[f"{name}_{i + 1}"] for i in range(getattr(expected, name).size)
            ] == getattr(expected, name).tolist()
        assert found["error.max"] == motion.error.max()
        assert found["drift.energy"] == motion.drift["energy"]
        assert found["frame.min_2_3"] == motion.frame[:, 1, 2].min()
        assert found["tau1.max"] == motion.tau1.max()


def test_a_problem_that_cannot_be_solved_is_a_row_with_its_reason() -> None:
    sweep = request(vary={"/A/0": [2, -1, "x"], "/q_dot/1": [0, 0.5]}, samples=1)
    found = rows(sweep, 0, sweep.total)
    assert [row["outcome"] for row in found] == ["solved"] * 2 + ["invalid-input"] * 4
    assert found[0]["regime"] == "rest"
    assert found[2]["detail"].startswith(
        "problem.A[0]: required a finite number greater than 0; given -1"
    )
    assert found[2]["energy"] is None


def test_motions_that_are_computed_together_are_those_of_solve() -> None:
    plain = {**BASE, "A": [3, 1.5, 1], "q": [0.6, 0.1, 0.8]}
    times = [2, 0, "0.1", 30]
    sweep = request(problem=plain, vary={"/A/0": {"uniform": [2, 4]}}, samples=12, times=times)
    answers = columns_at_once(sweep, {row: sweep.values(row) for row in range(12)})
    assert len(answers) == 12
    for row, (columns, kept) in answers.items():
        assert kept == {}
        motion = vs.solve(sweep.request_of(sweep.values(row)).problem.problem, times)
        most = columns["error.max"] + motion.error.max()
        assert columns["error.max"] < 1e-11
        assert columns["drift.energy"] < 1e-13
        for name in ("q", "q_dot", "frame"):
            for kind in ("min", "max"):
                extremes = dict(
                    components(
                        f"{name}.{kind}", getattr(motion.series(name), kind)(axis=0).tolist()
                    )
                )
                for column, value in extremes.items():
                    assert abs(columns[column] - value) <= 10 * most


@pytest.mark.parametrize("times", [None, [0, 1, 5]])
def test_rows_do_not_depend_on_how_a_sweep_is_cut(times: Any) -> None:
    """Problems that can be computed together stand beside others, which are computed, or refused,
    one by one.
    """
    plain = {**BASE, "A": [3, 1.5, 1], "q": [0.6, 0.1, 0.8]}
    sweep = request(
        problem=plain,
        vary={"/A/0": [2, "2", 1.5, -1, "x", 4], "/q/1": [0.1, 0], "/q_dot/1": [0, 0.5]},
        samples=1,
        times=times,
    )
    whole = rows(sweep, 0, sweep.total)
    alone = [rows(sweep, row, row + 1)[0] for row in range(sweep.total)]
    for together, single in zip(whole, alone, strict=True):
        assert {name: together[name] for name in single} == single
        assert all(together[name] is None for name in {*together} - {*single})
    assert [row["outcome"] for row in whole] == ["solved"] * 12 + ["invalid-input"] * 8 + [
        "solved"
    ] * 4
    assert whole[1]["energy"] == pytest.approx(whole[5]["energy"], rel=1e-14)
    assert [whole[i]["regime"] for i in (0, 1, 3, 9)] == [
        "rest",
        "generic",
        "generic",
        "closed-cut",
    ]


def test_a_problem_over_its_budget_is_given_up() -> None:
    hard = {
        "system": "veselova",
        "A": [9, 8, 7, 6, 5, 4, 3, 2],
        "q": [1] * 8,
        "q_dot": [1, -1, 2, -2, 1, 0, -1, 0],
        "normalize": True,
    }
    sweep = read_request(
        SweepRequest,
        {
            "problem": hard,
            "vary": {"/A/0": [9, 10]},
            "times": [0, 1000],
            "engine": "numeric",
            "budget_s": 0.05,
        },
    )
    assert [row["outcome"] for row in rows(sweep, 0, 2)] == ["over-budget"] * 2


def test_a_worker_of_another_version_is_refused_by_both_names() -> None:
    with pytest.raises(
        OtherVersion, match=rf"runs veselova {re.escape(__version__)}, and this is 0\.0\.0"
    ):
        compute_chunk(request().canonical, 0, 1, "0.0.0")


def test_equal_requests_are_one_job_and_others_are_not() -> None:
    assert request().id == request(problem={**BASE, "frame": None}).id
    assert request().id != request(seed=8).id
    assert request().id != request(vary={**DRAWN, "/A/0": [2, 3, 5]}).id


def test_a_sweep_is_a_dataset_over_its_axes(tmp_path: Path) -> None:
    said: list[tuple[int, int]] = []
    dataset = vs.sweep(
        BASE,
        {
            "/A/0": np.array([2.0, 3.0]),
            "/q": [[1, 0, 0], [0.6, 0, 0.8]],
            "/q_dot": {"normal": [0, 1]},
        },
        samples=3,
        times=[0, 1, 2],
        outputs=["q", "tau1"],
        trajectories=True,
        folder=tmp_path,
        progress=lambda done, total: said.append((done, total)),
    )
    assert isinstance(dataset, xarray.Dataset)
    assert dict(dataset.sizes) == {"A_1": 2, "q": 2, "sample": 3, "time": 3, "axis": 3}
    assert dataset["A_1"].values.tolist() == [2, 3]
    assert dataset["q_3"].values.tolist() == [0, 0.8]
    assert np.all(dataset.outcome == "solved")
    drawn = [float(dataset[f"q_dot_{i + 1}"][1, 1, 2]) for i in range(3)]
    motion = vs.solve(vs.Veselova([3, "1.5", 1], [0.6, 0, 0.8], drawn, normalize=True), [0, 1, 2])
    assert np.array_equal(dataset["trajectory.q"][1, 1, 2], motion.q)
    assert dataset["tau1.max"][1, 1, 2] == motion.tau1.max()
    assert said[-1] == (12, 12)


@pytest.mark.daily(3)
def test_the_result_does_not_depend_on_workers_or_interruptions(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One run in this process; another by two workers, which is interrupted and then goes on."""
    sweep = request(samples=20, times=[0, 1], outputs=["q"], trajectories=True)
    monkeypatch.setattr("veselova.service.api.sweep_request._CHUNK_ROWS", 4)
    monkeypatch.setattr("veselova.service.cli.local_sweep._FEW", 1000)
    job, undisturbed = run_sweep(
        sweep, local_settings(tmp_path / "one", 1), lambda done, total: None
    )

    class Interrupted(Exception):
        pass

    def interrupt(done: int, total: int) -> None:
        if done >= 12:
            raise Interrupted

    monkeypatch.setattr("veselova.service.cli.local_sweep._FEW", 0)
    settings = local_settings(tmp_path / "two", 2)
    with pytest.raises(Interrupted):
        run_sweep(sweep, settings, interrupt)
    interrupted = Jobs(settings)
    job = interrupted.get(sweep.id)
    assert 12 <= job.done < 60
    missing = interrupted.missing(job)
    victim, path = next(iter(interrupted.chunks(job.id).items()))
    path.unlink()
    calls: list[tuple[int, int]] = []
    store = Jobs.store
    monkeypatch.setattr(
        Jobs,
        "store",
        lambda self, job, start, stop, table: (
            calls.append((start, stop)) or store(self, job, start, stop, table)
        ),
    )
    monkeypatch.setattr("veselova.service.cli.local_sweep._FEW", 1000)
    _, resumed = run_sweep(sweep, settings, lambda done, total: None)
    assert sorted(calls) == sorted([*missing, victim])
    for path in ("result_path", "packed_path"):
        one, other = (getattr(files, path)(sweep.id) for files in (resumed, undisturbed))
        assert one.read_bytes() == other.read_bytes()


def test_a_value_that_is_no_number_may_come_in_a_later_chunk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The table is the same as that of one chunk: such a value is missing in the column."""
    sweep = request(vary={"/A/0": [2, 2.5, "x"]}, samples=1)

    def column(folder: str) -> Any:
        job, jobs = run_sweep(sweep, local_settings(tmp_path / folder, 1), lambda done, total: None)
        return parquet.read_table(jobs.result_path(job.id))["A_1"].to_pylist()

    expected = column("one chunk")
    assert expected == [2, 2.5, None]
    monkeypatch.setattr("veselova.service.api.sweep_request._CHUNK_ROWS", 1)
    assert column("three chunks") == expected


def test_the_command_line_sweeps(tmp_path: Path) -> None:
    body = {"problem": BASE, "vary": {"/A/0": [2, 3, -1]}}

    def run(*more: Any) -> subprocess.CompletedProcess[str]:
        return command_line("sweep", "-", "--folder", tmp_path / "kept", *more, stdin=body)

    answer = run("--json", "--output", tmp_path / "table.csv")
    assert answer.returncode == 0, answer.stderr
    assert json.loads(answer.stdout)["outcomes"] == {"solved": 2, "invalid-input": 1}
    assert (tmp_path / "table.csv").read_text().count("\n") == 4
    again = run("--output", tmp_path / "table.nc")
    assert again.returncode == 0, again.stderr
    with xarray.open_dataset(tmp_path / "table.nc", engine="scipy") as dataset:
        assert dataset["A_1"].values.tolist() == [2, 3, -1]
        assert math.isnan(dataset.energy[2])
    refused = run("--output", tmp_path / "table.xls")
    assert (refused.returncode, refused.stdout) == (2, "")
    assert "--output: required a file name ending in" in refused.stderr


def test_the_interrupt_of_a_terminal_leaves_the_command_line_without_a_traceback(
    tmp_path: Path,
) -> None:
    file = tmp_path / "sweep.json"
    vary = {"/A/0": {"start": 2, "stop": 3, "count": 100_000}}
    file.write_text(json.dumps({"problem": BASE, "vary": vary}))
    command = [sys.executable, "-m", "veselova", "sweep", str(file), "--workers", "2"]
    command += ["--folder", str(tmp_path / "kept")]
    with subprocess.Popen(
        command, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as process:
        wait_until(lambda: len(workers_of(process.pid)) == 2)
        os.killpg(process.pid, signal.SIGINT)
        _, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert errors == "Finished problems are kept; the same command resumes.\n"


PLAIN_SCRIPT = """
import veselova as vs
print("the script runs", flush=True)
problem = vs.Veselova([3, 2, 1], [0.6, 0, 0.8], [0.8, 1, -0.6])
vary = {{"/A/0": {{"start": 2.5, "stop": 5, "count": {count}}}}}
dataset = vs.sweep(problem, vary, times=[0, 1], folder={folder!r})
print(dict(dataset.sizes), set(dataset.outcome.values.tolist()))
"""


@pytest.mark.daily(4)
def test_a_sweep_of_a_plain_script_uses_processes(tmp_path: Path) -> None:
    """They do not run the script, which has no ``if __name__ == "__main__":``."""
    script = tmp_path / "script.py"
    script.write_text(PLAIN_SCRIPT.format(count=60, folder=str(tmp_path / "kept")))
    answer = interpreter(script)
    assert answer.returncode == 0, answer.stderr
    assert answer.stdout.splitlines() == ["the script runs", "{'A_1': 60} {'solved'}"]


def deadly_chunk(asked: bytes, start: int, stop: int, version: str) -> Any:
    """Return a chunk, unless the fourth problem is among those asked for."""
    if start <= 3 < stop:
        os.kill(os.getpid(), signal.SIGKILL)
    return compute_chunk(asked, start, stop, version)


@pytest.mark.daily(4)
def test_a_problem_that_ends_its_worker_is_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("veselova.service.api.sweep_request._CHUNK_ROWS", 5)
    monkeypatch.setattr("veselova.service.cli.local_sweep._FEW", 0)
    monkeypatch.setattr("veselova.service.sweeps.runner.compute_chunk", deadly_chunk)
    sweep = request(times=[0, 1])
    job, jobs = run_sweep(sweep, local_settings(tmp_path, 2), lambda done, total: None)
    found = parquet.read_table(jobs.result_path(job.id))["outcome"].to_pylist()
    assert found == ["solved"] * 3 + ["worker-lost"] + ["solved"] * 11


def endless_chunk(asked: bytes, start: int, stop: int, version: str) -> Any:
    """Say that the work has begun, and never end it."""
    Path(os.environ["VESELOVA_TEST_BEGUN"]).touch()
    while True:
        time.sleep(1)


@pytest.mark.daily(3)
def test_a_cancelled_job_ends_its_worker(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    begun = tmp_path / "begun"
    monkeypatch.setenv("VESELOVA_TEST_BEGUN", str(begun))
    monkeypatch.setattr("veselova.service.sweeps.runner.compute_chunk", endless_chunk)
    settings = local_settings(tmp_path, 1)
    jobs = Jobs(settings)
    job = jobs.submit(request(times=[0, 1]))

    with closing(running.Sweeps(settings, jobs)) as sweeps:
        sweeps.begin(job.id)
        while not begun.exists():
            time.sleep(0.01)
        workers = workers_of(os.getpid())
        sweeps.cancel(job.id)
        while set(workers) & set(workers_of(os.getpid())):
            time.sleep(0.01)
    assert jobs.get(job.id).state == "cancelled"
