"""Trajectory, Comparison and Torus: the shapes, files and pictures that users work with."""

from __future__ import annotations

import io
import json
import pickle
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_engines import METHODS

import veselova
from problems import named, tagged
from veselova import Comparison, InvalidInput, Trajectory, compare, solve

TIMES = np.linspace(0, 5, 11)


@pytest.fixture(scope="module")
def trajectory() -> Trajectory:
    return solve(tagged("generic")[3].problem(), TIMES)


@pytest.fixture(scope="module")
def comparison() -> Comparison:
    return compare(tagged("generic")[3].problem(), TIMES, "taylor")


def test_series_have_the_promised_shapes(trajectory: Trajectory) -> None:
    N, n = TIMES.size, 4
    shapes = {
        "q": (N, n),
        "q_dot": (N, n),
        "frame": (N, n, n),
        "omega": (N, n, n),
        "spheroconic": (N, n - 1),
        "tau1": (N,),
    }
    assert {name: trajectory.series(name).shape for name in trajectory.problem.outputs} == shapes
    assert trajectory.times.shape == trajectory.error.shape == (N,)
    assert np.array_equal(trajectory.omega, -np.swapaxes(trajectory.omega, 1, 2))


def test_results_are_short_to_read_and_survive_pickling(
    trajectory: Trajectory, comparison: Comparison
) -> None:
    assert len(repr(trajectory)) < 150
    assert len(repr(comparison)) < 400
    assert len(repr(trajectory.problem)) < 200
    assert "\n" not in repr(trajectory.problem)
    again = pickle.loads(pickle.dumps(trajectory))
    assert np.array_equal(again.frame, trajectory.frame)
    motion = pickle.loads(pickle.dumps(solve(trajectory.problem, [0.5])))
    assert np.allclose(motion.at([0.25, 0.5]).frame[1], motion.frame[0], atol=1e-14)


def test_integrals_are_given_along_the_motion(trajectory: Trajectory) -> None:
    assert list(trajectory.integrals) == [
        "energy",
        "q_norm",
        "q_p",
        "neumann",
        "linear",
        "constants",
    ]
    assert all(values.shape[0] == TIMES.size for values in trajectory.integrals.values())
    assert max(trajectory.drift.values()) < 1e-13
    assert np.allclose(trajectory.integrals["energy"], trajectory.problem.energy, rtol=1e-13)


@pytest.mark.parametrize(("engine", "method"), METHODS)
def test_the_same_motion_can_be_asked_at_other_times(engine: str, method: str) -> None:
    problem = tagged("generic")[1].problem()
    first = solve(problem, [0.0, 1.0], engine, method)
    later = first.at([2.5, 3.5])
    assert np.allclose(later.frame, solve(problem, [2.5, 3.5], engine, method).frame, atol=1e-11)
    assert later.provenance.method == method


@pytest.mark.parametrize("case", ["analytic", "numeric", "certified", "separable"])
def test_a_dataset_is_written_to_netcdf_and_read_again(case: str, tmp_path: Path) -> None:
    xarray = pytest.importorskip("xarray")
    start = [0.6, 0.0, 0.8], [0.8, 1.0, -0.6]
    problem: Any = veselova.Veselova([3, 2, 1], *start)
    if case == "separable":
        problem = veselova.SeparableVeselova([3, 2, 1], *start, {"quadratic": 0.5})
    options: dict[str, Any] = (
        {"engine": "numeric"}
        if case == "numeric"
        else {"certified": True}
        if case == "certified"
        else {}
    )
    dataset = veselova.solve(problem, [0, 0.5, 1], **options).to_xarray()
    dataset.to_netcdf(tmp_path / "motion.nc", engine="scipy")
    again = xarray.load_dataset(tmp_path / "motion.nc", engine="scipy")
    assert set(again.variables) == set(dataset.variables)
    for name in dataset.variables:
        assert np.array_equal(again[name], dataset[name])
    assert json.loads(again.attrs["details"]) == json.loads(dataset.attrs["details"])
    assert again.attrs["engine"] == dataset.attrs["engine"]


def test_parquet_arrow_and_xarray_hold_the_series(trajectory: Trajectory, tmp_path: Path) -> None:
    from pyarrow import ipc, parquet

    trajectory.to_parquet(tmp_path / "motion.parquet")
    trajectory.to_arrow(tmp_path / "motion.arrow")
    with (tmp_path / "motion.arrow").open("rb") as file:
        tables = parquet.read_table(tmp_path / "motion.parquet"), ipc.open_stream(file).read_all()
    for table in tables:
        assert table.column_names == list(trajectory.columns())
        assert all(
            np.array_equal(table[name], values) for name, values in trajectory.columns().items()
        )
        assert json.loads(table.schema.metadata[b"provenance"]) == trajectory.provenance.as_dict()
    dataset = trajectory.to_xarray()
    assert dataset["frame"].dims == ("time", "axis", "vector")


@pytest.mark.parametrize("kind", ["npz", "csv", "parquet", "arrow"])
def test_files_are_written_in_blocks_to_streams_with_the_chosen_series(
    kind: str, monkeypatch: Any
) -> None:
    from pyarrow import ipc, parquet

    motion = solve(tagged("generic")[3].problem(), TIMES)
    whole, blocks = io.BytesIO(), io.BytesIO()
    getattr(motion, f"to_{kind}")(whole, ["tau1", "frame"])
    monkeypatch.setattr("veselova.mechanics.results.table._BLOCK", 30)
    getattr(motion, f"to_{kind}")(blocks, ["tau1", "frame"])
    read = {
        "npz": lambda data: np.load(data)["frame"],
        "csv": lambda data: np.loadtxt(data, delimiter=",", skiprows=1),
        "parquet": lambda data: np.column_stack(parquet.read_table(data).columns),
        "arrow": lambda data: np.column_stack(ipc.open_stream(data).read_all().columns),
    }[kind]
    assert np.array_equal(read(io.BytesIO(whole.getvalue())), read(io.BytesIO(blocks.getvalue())))
    assert b"omega" not in whole.getvalue()


@pytest.mark.parametrize("write", ["to_csv", "to_npz", "to_parquet", "to_arrow"])
def test_files_of_what_is_no_output_are_refused_before_anything_is_written(
    trajectory: Trajectory, write: str
) -> None:
    for outputs, field in ((["tau1", "tau"], "outputs[1]"), ([], "outputs"), ("tau1", "outputs")):
        stream = io.BytesIO()
        with pytest.raises(InvalidInput, match="tau1") as raised:
            getattr(trajectory, write)(stream, outputs=outputs)
        assert raised.value.field == field
        assert not stream.getvalue()
    with pytest.raises(InvalidInput, match="required one of q, "):
        trajectory.series("tau")


@pytest.mark.daily(3)
@pytest.mark.parametrize("name", ["random-n2-0", "random-n3-0", "body4", "eight"])
def test_pictures_show_what_they_promise(name: str, tmp_path: Path) -> None:
    case = named(name)
    comparison = compare(case.problem(), np.linspace(0, 3, 31))
    in_space = case.problem().n == 3
    for subject, panels in ((comparison.first, 2 + in_space), (comparison, 3 + in_space)):
        figure = subject.plot()
        assert len(figure.axes) == panels
        figure.savefig(tmp_path / "picture.png", dpi=40)
        assert (tmp_path / "picture.png").stat().st_size > 5000
    assert figure.axes[-1].get_yscale() == "log"
    assert figure.axes[0].name == ("3d" if in_space else "rectilinear")


def test_a_comparison_summarises_deviation_drift_and_seconds(comparison: Comparison) -> None:
    summary = comparison.summary()
    assert set(summary["deviation"]) == set(comparison.analytic.problem.outputs)
    assert summary["agrees"] is True
    assert set(summary["seconds"]) == {"analytic", "numeric"}
    assert summary["conditioning_floor"] > 0
    assert json.loads(json.dumps(summary)) == summary
    assert np.all(
        comparison.difference("frame") <= comparison.analytic.error + comparison.numeric.error
    )


def test_a_torus_says_what_it_is_and_how_nearly_its_motion_is_periodic() -> None:
    problem = veselova.Veselova([4, 2, 1], [1, 0, 0], [0, 0.5, 0.25])
    found = veselova.torus(problem)
    assert repr(found) == "<Torus: n = 3, generic, frequencies 0.17129, 0.276708, ratio 1.61544>"
    returns = found.nearly_periodic()
    assert [near.windings for near in returns[2:]] == [(2, 3), (3, 5), (5, 8), (8, 13), (13, 21)]
    assert all(later.misfit < near.misfit for near, later in pairwise(returns))
    # after twice the windings all signs are back: a phase off by x cycles moves by about 2πx
    there = veselova.solve(problem, [0, 2 * returns[-1].time]).frame
    assert np.max(np.abs(there[1] - there[0])) < 4 * np.pi * returns[-1].misfit
    assert np.max(np.abs(there[1] - there[0])) > returns[-1].misfit
    (once,) = veselova.torus(veselova.Veselova([2, 1], [1, 0], [0, 1])).nearly_periodic()
    assert (once.windings, once.misfit) == ((1,), 0)


def test_problems_show_what_users_ask_for() -> None:
    ball = veselova.RubberBall([1, 1, 1], 1, 1, [1, 0, 0], [1, 0.5, 0])
    names = {name for name in dir(ball) if not name.startswith("__")}
    assert {"Omega", "gamma", "frame", "drift", "title", "integrals", "as_dict"} <= names
    assert "<th style='text-align:left'>radius</th>" in ball._repr_html_()
    form = veselova.closed_form(ball)._repr_html_()
    assert all(name in form for name in ("rubber-ball", "genus", "modes", "error"))
