"""Times are taken exactly as they are stated, in any order, at every door."""

from __future__ import annotations

import io
import json
import math
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from typer.testing import CliRunner

import veselova as vs
from conftest import Server
from veselova.mechanics.core.errors import InvalidInput
from veselova.mechanics.core.exact_input import exact_number, plain
from veselova.mechanics.core.remainders import split, split_grid
from veselova.mechanics.core.times import TimeGrid, as_request
from veselova.mechanics.results.trajectory import Trajectory
from veselova.service.cli.main import app

#: γ, q … at 10⁹ + 3/10, which is 4.8e-8 beyond the nearest double.
FAR = "1000000000.3"

BODY = {"A": ["3", "2", "1.5"], "q": ["0.6", "0", "0.8"], "q_dot": ["0.3", "1", "-0.225"]}


def body() -> vs.Veselova:
    return vs.Veselova(**BODY)


def furthest(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    return float(np.max(np.abs(one - other)))


@pytest.mark.parametrize(
    "time",
    [
        FAR,
        "123456789012345678.9",
        10**20 + 1,
        Fraction(10**16, 3),
        Decimal("-31415926535.8979323846"),
    ],
)
def test_far_times_are_taken_with_all_their_digits(time: Any) -> None:
    found, exact = vs.solve(body(), [time]), vs.solve(body(), [time], digits=20)
    assert furthest(found.frame, exact.frame) <= found.error[0]
    assert found.error[0] < max(1e-11, 1e-28 * abs(float(Fraction(time))))
    assert Fraction(found.times[0]) + Fraction(found.remainders[0]) == pytest.approx(
        Fraction(time), rel=1e-31, abs=0
    )  # type: ignore[index]
    assert furthest(vs.solve(body(), found.times).frame, found.frame) > 100 * found.error[0], (
        "the remainder counts"
    )


@pytest.mark.parametrize("method", ["theta", "angles"])
@pytest.mark.parametrize("clock", ["fourier", None])
def test_every_method_takes_remainders(method: str, clock: str | None) -> None:
    from veselova.analytic.solve import solve

    times = ["100000.1", "200000.3"]
    found, exact = (
        solve(body(), times, method=method, time_map=clock),
        vs.solve(body(), times, digits=20),
    )
    assert (np.abs(found.frame - exact.frame).max(axis=(1, 2)) <= found.error).all()


def test_remainders_move_a_clock_by_panels() -> None:
    from veselova.analytic.motion.evaluation_plan import EvaluationPlan
    from veselova.analytic.motion.torus_solution import Solution

    times, remainders = np.array([20.0, 30.0]), np.array([1e-3, -2e-3])
    solution = Solution(body())
    plan = EvaluationPlan.of(solution, np.array([0.0, 31.0]), time_map="panels")
    clock = plan.make_time_map(solution)
    assert np.allclose(
        clock.tau1(times, remainders)[1], clock.tau1(times + remainders)[1], rtol=0, atol=1e-13
    )


@pytest.mark.parametrize(
    "problem",
    [
        vs.NeumannSystem(["3", "2", "1.5"], ["0.6", "0", "0.8"], ["0.3", "1", "-0.225"]),
        vs.EllipsoidGeodesic(["3", "2", "1.5"], [math.sqrt(3), 0, 0], [0, 0.6, 0.8]),
        vs.SeparableVeselova(
            ["3", "2", "1.5"],
            ["0.6", "0", "0.8"],
            ["0.3", "1", "-0.225"],
            {"centrifugal": ["0.1", 0, "0.2"]},
        ),
    ],
    ids=lambda problem: problem.system,
)
def test_other_systems_take_remainders_too(problem: Any) -> None:
    """A time stated as a text lies between its neighbours among doubles, at the place that its
    velocity says.
    """
    text = "20000.3"
    below, above = (float(np.nextafter(20000.3, side)) for side in (0, 1e6))
    found = vs.solve(problem, [Fraction(below), Fraction(text), Fraction(above)])
    name = problem.bounded[0]
    values = found.series(name).reshape(3, -1)
    part = float((Fraction(text) - Fraction(below)) / (Fraction(above) - Fraction(below)))
    between = values[0] + part * (values[2] - values[0])
    assert found.remainders is not None
    assert np.max(np.abs(values[1] - between)) < 2e-13
    assert np.max(np.abs(values[1] - between)) <= found.error[1]


@pytest.mark.parametrize("engine", ["analytic", "numeric"])
def test_both_engines_solve_at_the_same_exact_times(engine: str) -> None:
    times = ["300.3", "-1/3", "5"]
    found, exact = vs.solve(body(), times, engine), vs.solve(body(), times, digits=20)
    assert (np.abs(found.frame - exact.frame).max(axis=(1, 2)) <= found.error).all()


def test_integration_takes_the_rest_of_a_time() -> None:
    grid = TimeGrid(np.array([1.0, 2.0]), np.array([1e-8, -1e-8]), None, list)
    moved = vs.solve(body(), grid, "numeric")
    assert furthest(moved.q, vs.solve(body(), np.array([1 + 1e-8, 2 - 1e-8]), "numeric").q) < 1e-13


def test_a_dense_grid_keeps_remainders() -> None:
    grid = {"start": "999990", "stop": "1000000.1", "count": 3001}
    found, places = vs.solve(body(), grid), [5, 1500, 2999, 3000]
    step = (Fraction("1000000.1") - 999990) / 3000
    exact = vs.solve(body(), [999990 + k * step for k in places], digits=20)
    assert (np.abs(found.frame[places] - exact.frame).max(axis=(1, 2)) <= found.error[places]).all()
    assert furthest(vs.solve(body(), found.times).frame, found.frame) > 1e-11


def test_a_grid_of_texts_is_exact_and_one_of_doubles_that_of_linspace() -> None:
    exact = TimeGrid.of({"start": "-0.3", "stop": "0.3", "count": 7})
    assert exact.exact == tuple(Fraction(k - 3, 10) for k in range(7))
    assert exact.doubles.tolist() == [float(Fraction(k - 3, 10)) for k in range(7)]
    for ends in ((0, 60), (0.1, 7.7), (np.float64(-3), 2**53)):
        plain_grid = TimeGrid.of({"start": ends[0], "stop": ends[1], "count": 601})
        assert plain_grid.remainders is None
        assert (plain_grid.doubles == np.linspace(float(ends[0]), float(ends[1]), 601)).all()
    for end in (Fraction(1, 3), Decimal("0.1"), "1", 2**53 + 1):
        assert TimeGrid.of({"start": 0, "stop": end, "count": 2}).exact == (
            0,
            exact_number(end, ()),
        )


def test_grids_of_any_size_are_right_to_thirty_digits() -> None:
    start, stop, count = Fraction("-1000.1"), Fraction("1e6") / 7, 30_011
    step = (stop - start) / (count - 1)
    doubles, remainders = split_grid(start, step, count)
    points = [start + k * step for k in range(count)]
    expected, rest = split(points)
    assert (doubles == expected).all()
    assert np.max(np.abs((remainders - rest) / doubles)) < 1e-28


def test_numbers_of_every_kind_are_exact() -> None:
    wide = np.longdouble("1e9") + np.longdouble("0.3")
    assert exact_number(wide, ()) == Fraction(*wide.as_integer_ratio())
    assert plain(wide) == str(Fraction(*wide.as_integer_ratio()))
    assert TimeGrid.of(np.array([wide])).exact == (Fraction(*wide.as_integer_ratio()),)
    for refused in (np.longdouble("inf"), np.array([np.longdouble("nan")]), np.array([1j])):
        with pytest.raises(InvalidInput, match="times"):
            TimeGrid.of(refused)
    assert TimeGrid.of([2**60 + 1]).exact == (2**60 + 1,)
    assert TimeGrid.of(np.array([2**60 + 1])).exact == (2**60 + 1,)
    assert TimeGrid.of(range(3)).doubles.tolist() == [0, 1, 2]
    assert TimeGrid.of(np.arange(3, dtype=np.uint8)).doubles.tolist() == [0, 1, 2]
    with pytest.raises(InvalidInput, match="at least one time"):
        TimeGrid.of(range(0))


@pytest.mark.parametrize("engine", ["analytic", "numeric"])
def test_times_come_in_any_order_and_more_than_once(engine: str) -> None:
    asked = [3.0, -1.0, 2.0, -1.0, 0.0]
    found, ordered = vs.solve(body(), asked, engine), vs.solve(body(), sorted(set(asked)), engine)
    places = [3, 0, 2, 0, 1]
    assert found.times.tolist() == asked
    assert (found.frame == ordered.frame[places]).all()
    assert (found.error == ordered.error[places]).all()
    assert found.at([2, 1]).times.tolist() == [2, 1]


def test_many_times_in_any_order() -> None:
    times = np.random.default_rng(5).permutation(np.repeat(np.linspace(-20, 300, 2000), 2))
    found = vs.solve(body(), times)
    order = np.argsort(times[::37])
    alone = vs.solve(body(), times[::37][order])
    assert furthest(found.frame[::37][order], alone.frame) < 1e-12


def test_decimals_keep_the_order_of_times() -> None:
    times = ["0.7", "0.1", "0.7"]
    found, ordered = vs.solve(body(), times, digits=20), vs.solve(body(), ["0.1", "0.7"], digits=20)
    assert found.decimals is not None
    assert ordered.decimals is not None
    assert (
        found.decimals.midpoints["frame"] == ordered.decimals.midpoints["frame"][[1, 0, 1]]
    ).all()
    assert (found.decimals.error == ordered.decimals.error[[1, 0, 1]]).all()


@pytest.mark.parametrize(
    "time", [2, 2.0, "2", Fraction(2), np.float64(2), np.array(2.0), Decimal(2)]
)
def test_a_single_number_is_one_time(time: Any) -> None:
    assert vs.solve(body(), time).times.tolist() == [2]
    assert as_request(time) in ([2], ["2"])


def test_an_answer_says_what_its_doubles_leave(tmp_path: Path) -> None:
    found = vs.solve(body(), [FAR, "1"])
    rest = float(Fraction(FAR) - Fraction(1000000000.3))
    assert found.remainders is not None
    assert found.remainders.tolist() == [rest, 0]
    assert vs.solve(body(), ["0.5", 1]).remainders is None
    stream = io.BytesIO()
    found.to_csv(stream, ["q"])
    names, first, _ = stream.getvalue().decode().splitlines()
    assert names.startswith("t,t_remainder,error,")
    assert [float(text) for text in first.split(",")[:2]] == [1000000000.3, rest]
    stream = io.BytesIO()
    found.to_npz(stream)
    read = Trajectory.from_arrays(found.problem, np.load(io.BytesIO(stream.getvalue())))
    assert read.remainders is not None
    assert read.remainders.tolist() == [rest, 0]


def test_http_and_its_client_take_exact_times_in_any_order(server: Server) -> None:
    exact = vs.solve(body(), [FAR, "0.1"], digits=20)
    with vs.Client(server.url) as client:
        for times in ([FAR, "0.1"], [Fraction(FAR), Decimal("0.1")]):
            found = client.trajectory(body(), times)
            assert (np.abs(found.frame - exact.frame).max(axis=(1, 2)) <= found.error).all()
            assert found.remainders is not None
        precise = client.trajectory(body(), [FAR, "0.1"], digits=20)
        assert precise.remainders is not None
        assert precise.remainders.tolist() == found.remainders.tolist()
        assert client.trajectory(body(), 2.0).times.tolist() == [2]
        grid = client.trajectory(body(), {"start": Fraction(1, 3), "stop": "10/3", "count": 4})
        assert grid.remainders is not None
        compared = client.compare(body(), ["0.3", "0.1"])
        assert compared.agrees
        assert compared.numeric.remainders is not None


def test_the_command_line_says_what_its_doubles_leave(tmp_path: Path) -> None:
    path = tmp_path / "far.json"
    path.write_text(
        json.dumps(
            {
                "problem": {"system": "veselova", **BODY},
                "times": [FAR, 10**17 + 1, 0],
                "outputs": ["q"],
            }
        )
    )
    answer = CliRunner().invoke(app, ["solve", str(path), "--json"])
    document = json.loads(answer.stdout)
    assert document["times"] == [1000000000.3, 1e17, 0]
    assert document["remainders"] == [float(Fraction(FAR) - Fraction(1000000000.3)), 1, 0]
    exact = vs.solve(body(), [FAR, 10**17 + 1, 0], digits=20)
    assert furthest(np.array(document["series"]["q"]), exact.q) <= max(document["error"])


def test_a_picture_is_drawn_in_the_order_of_time() -> None:
    pytest.importorskip("matplotlib")
    line = vs.solve(body(), [2.0, 0.0, 1.0]).plot().axes[1].get_lines()[0]
    assert list(line.get_xdata()) == [0, 1, 2]
