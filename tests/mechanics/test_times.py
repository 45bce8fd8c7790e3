"""Times are taken exactly as they are stated, in any order, at every door."""

from __future__ import annotations

import json
import math
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import veselova as vs
from conftest import Server, command_line
from veselova.mechanics.core.exact_input import exact_number
from veselova.mechanics.core.times import TimeGrid, as_request

#: γ, q … at 10⁹ + 3/10, which is 4.8e-8 beyond the nearest double.
FAR = "1000000000.3"

BODY = {"A": ["3", "2", "1.5"], "q": ["0.6", "0", "0.8"], "q_dot": ["0.3", "1", "-0.225"]}


def body() -> vs.Veselova:
    return vs.Veselova(**BODY)


def furthest(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    return float(np.max(np.abs(one - other)))


@pytest.mark.parametrize("time", [FAR, Fraction(10**10, 3), Decimal("-31415926535.8979323846")])
def test_a_time_is_its_nearest_double_and_the_error_has_the_rest(time: Any) -> None:
    found, exact = vs.solve(body(), [time]), vs.solve(body(), [time], digits=20)
    assert found.times[0] == float(Fraction(time))
    off, late = furthest(found.frame, exact.frame), abs(Fraction(time) - Fraction(found.times[0]))
    assert float(late) / 10 < off <= found.error[0] < 100 * float(late)
    assert vs.solve(body(), found.times).error[0] < 1e-10
    stated = vs.closed_form(body()).at([time])
    assert furthest(stated.frame, exact.frame) <= stated.error[0]


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
        vs.RubberBall([1, "1.2", "1.5"], 1, 1, ["0.6", 0, "0.8"], [1, 2, "0.5"]),
    ],
    ids=lambda problem: problem.system,
)
def test_other_systems_have_the_rounding_of_times_in_their_error(problem: Any) -> None:
    below, above = (float(np.nextafter(20000.3, side)) for side in (0, 1e6))
    near = vs.solve(problem, [below, "20000.3", above])
    for name in problem.bounded:
        values = near.series(name).reshape(3, -1)
        assert furthest(values[0], values[2]) <= 4 * near.error[1] + near.error[0] + near.error[2]
    assert near.error[1] > near.error[0]


@pytest.mark.parametrize("engine", ["analytic", "numeric"])
def test_both_engines_solve_at_the_same_exact_times(engine: str) -> None:
    times = ["300.3", "-1/3", "5"]
    found, exact = vs.solve(body(), times, engine), vs.solve(body(), times, digits=20)
    assert (np.abs(found.frame - exact.frame).max(axis=(1, 2)) <= found.error).all()


def test_a_grid_of_texts_is_exact_and_one_of_doubles_that_of_linspace() -> None:
    exact = TimeGrid.of({"start": "-0.3", "stop": "0.3", "count": 7})
    assert exact.exact == tuple(Fraction(k - 3, 10) for k in range(7))
    assert exact.doubles.tolist() == [float(Fraction(k - 3, 10)) for k in range(7)]
    for ends in ((0, 60), (0.1, 7.7), (np.float64(-3), 2**53)):
        plain_grid = TimeGrid.of({"start": ends[0], "stop": ends[1], "count": 601})
        assert not plain_grid.late.any()
        assert (plain_grid.doubles == np.linspace(float(ends[0]), float(ends[1]), 601)).all()
    for end in (Fraction(1, 3), Decimal("0.1"), "1", 2**53 + 1):
        assert TimeGrid.of({"start": 0, "stop": end, "count": 2}).exact == (
            0,
            exact_number(end, ()),
        )


@pytest.mark.parametrize("engine", ["analytic", "numeric"])
def test_times_come_in_any_order_and_more_than_once(engine: str) -> None:
    asked = [3.0, -1.0, 2.0, -1.0, 0.0]
    found, ordered = vs.solve(body(), asked, engine), vs.solve(body(), sorted(set(asked)), engine)
    places = [3, 0, 2, 0, 1]
    assert found.times.tolist() == asked
    assert (found.frame == ordered.frame[places]).all()
    assert (found.error == ordered.error[places]).all()
    assert found.at([2, 1]).times.tolist() == [2, 1]


@pytest.mark.parametrize(
    "time", [2, 2.0, "2", Fraction(2), np.float64(2), np.array(2.0), Decimal(2)]
)
def test_a_single_number_is_one_time(time: Any) -> None:
    assert vs.solve(body(), time).times.tolist() == [2]
    assert as_request(time) in ([2], ["2"])


def test_http_and_its_client_take_exact_times_in_any_order(server: Server) -> None:
    exact = vs.solve(body(), [FAR, "0.1"], digits=20)
    with vs.Client(server.url) as client:
        for times in ([FAR, "0.1"], [Fraction(FAR), Decimal("0.1")]):
            found = client.trajectory(body(), times)
            assert (np.abs(found.frame - exact.frame).max(axis=(1, 2)) <= found.error).all()
        precise = client.trajectory(body(), [FAR, "0.1"], digits=20)
        assert precise.times.tolist() == found.times.tolist()
        assert client.trajectory(body(), 2.0).times.tolist() == [2]
        grid = client.trajectory(body(), {"start": Fraction(1, 3), "stop": "10/3", "count": 4})
        assert grid.times.tolist() == [1 / 3, 4 / 3, 7 / 3, 10 / 3]
        assert client.compare(body(), ["0.3", "0.1"]).agrees


def test_the_command_line_takes_exact_times() -> None:
    problem = {"system": "veselova", **BODY}
    times = [FAR, 10**9 + 1, 0]
    stated = {"problem": problem, "times": times, "outputs": ["q"]}
    document = json.loads(command_line("solve", "-", "--json", stdin=stated).stdout)
    assert document["times"] == [1000000000.3, 1e9 + 1, 0]
    exact = vs.solve(body(), times, digits=20)
    assert furthest(np.array(document["series"]["q"]), exact.q) <= max(document["error"])
