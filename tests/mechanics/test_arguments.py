"""Arrays and numbers of other libraries are taken at every door, and wrong arguments are named."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import veselova as vs
from veselova import curves, theta
from veselova.mechanics.systems.catalogue import read_problem

#: The same numbers as other libraries hold them.
HOLDERS: dict[str, Callable[[list[float]], Any]] = {
    "array": np.array,
    "Series": pd.Series,
    "nullable Series": lambda numbers: pd.Series(numbers, dtype="Float64"),
    "Index": pd.Index,
    "DataArray": xr.DataArray,
    "arrays without axes": lambda numbers: [np.array(x) for x in numbers],
    "scalars": lambda numbers: tuple(map(np.float32, numbers)),
}

A, Q, Q_DOT, TIMES = [4.0, 2.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.5, 0.25], [0.0, 0.5, 1.5]


@pytest.mark.parametrize("hold", HOLDERS.values(), ids=HOLDERS)
def test_numbers_of_every_library_are_the_numbers(hold: Callable[[list[float]], Any]) -> None:
    expected = vs.solve(vs.Veselova(A, Q, Q_DOT), TIMES)
    problem = vs.Veselova(hold(A), hold(Q), hold(Q_DOT), normalize=np.bool_(False))
    assert problem.as_dict() == expected.problem.as_dict()
    found = vs.solve(
        problem,
        hold(TIMES),
        digits=np.int64(15),
        certified=np.bool_(False),
        budget_s=np.float32(60),
        progress=np.bool_(False),
    )
    assert np.array_equal(found.frame, expected.frame)
    assert np.array_equal(found.at(hold(TIMES)).frame, expected.frame)
    ball = vs.RubberBall(hold([1, 1, 1]), np.array(1), np.float32(2), hold(Q), hold(Q_DOT))
    assert ball.rolling_radius == 2
    points = [0.0, 1.0, 2.0, 4.0, 7.0]
    curve = curves.RealHyperelliptic(hold(points), np.int64(-1))
    same = curves.RealHyperelliptic(points)
    assert np.array_equal(curve.invert(hold([0.125, 0.25]))[0], same.invert([0.125, 0.25])[0])
    tau = [[1j, 0.5], [0.5, 1j]]
    value = theta.riemann_theta(hold([0.5, 0.25]), pd.DataFrame(tau), derivatives=np.int64(1))
    assert np.array_equal(value, theta.riemann_theta([0.5, 0.25], tau, derivatives=1))


def test_our_own_tables_give_times_and_matrices_back() -> None:
    found = vs.solve(vs.Veselova(A, Q, Q_DOT), TIMES)
    assert np.array_equal(found.at(found.to_dataframe().index).frame, found.frame)
    assert np.array_equal(found.at(found.to_xarray()["time"]).frame, found.frame)
    assert vs.solve(found.problem, np.array(2.5)).times.tolist() == [2.5]
    matrix = vs.Veselova(pd.DataFrame(np.diag(A)), Q, Q_DOT)
    assert matrix.as_dict()["A"] == np.diag(A).tolist()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: vs.Veselova(A, Q, qdot=Q_DOT), r"Veselova\(A, q, .*'qdot' \(did you mean q_dot\?"),
        (
            lambda: vs.RubberBall(A, 1, 1, [*Q, 0], omega=Q),
            r"RubberBall\(.*'omega' \(did you mean Omega\?\)",
        ),
        (lambda: vs.VeselovaSO3(A), r"VeselovaSO3\(.*missing a required argument: 'gamma'"),
        (lambda: vs.solve(None, time=[1]), r"solve\(.*'time' \(did you mean times\?\)"),
    ],
)
def test_a_wrong_argument_names_what_was_called_and_the_nearest_field(
    call: Callable[[], Any], message: str
) -> None:
    with pytest.raises(TypeError, match=message):
        call()


def test_signatures_say_types() -> None:
    systems = [getattr(vs, name) for name in vs.__all__ if name != "__version__"]
    called = [x for x in systems if getattr(x, "system", None)]
    assert len(called) == 14
    for call in [*called, vs.solve, vs.compare, vs.from_torus, vs.MatrixGroup]:
        for parameter in inspect.signature(call).parameters.values():
            assert parameter.annotation not in ("Any", inspect.Parameter.empty), (call, parameter)


def test_paths_from_home_are_in_the_home_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    home, here = tmp_path / "home", tmp_path / "here"
    pytest.importorskip("matplotlib.font_manager")  # its cache is not what is counted
    home.mkdir()
    here.mkdir()
    monkeypatch.setenv("HOME", str(home))
    monkeypatch.chdir(here)
    found = vs.solve(vs.VeselovaSO3([1, 2, 2.5], Q, Q_DOT), TIMES)
    found.to_npz("~/motion.npz")
    found.to_parquet(Path("~/motion.parquet"))
    found.animate("~/film.gif", seconds=0.1, frames_per_second=20)
    assert np.array_equal(vs.Trajectory.from_npz("~/motion.npz").frame, found.frame)
    assert not list(here.iterdir())
    assert {path.name for path in home.glob("[!.]*")} == {
        "motion.npz",
        "motion.parquet",
        "film.gif",
    }


def test_moments_that_no_body_has_are_warned_of_or_refused() -> None:
    state: Any = (Q, [0.5, 0.5, 0.25])
    with pytest.warns(
        UserWarning, match=r"inertia: required moments of a body.* 3 > 1 \+ 1"
    ) as said:
        vs.VeselovaSO3([1, 1, 3], *state)
    assert said[0].filename == __file__
    with pytest.raises(vs.InvalidInput, match="inertia: required moments of a body"):
        vs.VeselovaSO3(np.diag([1, 1, 3]), *state, strict=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        vs.VeselovaSO3([1, 1, 3], *state, strict=False)
        vs.RubberBall([1, 1, 3], 1, 1, *state, strict=False)
        held = vs.VeselovaSO3([1, 1, 2], *state, strict=True)
        read = read_problem(held.as_dict())
    assert read.as_dict() == held.as_dict()
    assert held.as_dict()["strict"] is True
