"""Budgets, estimates and progress: work ends in time, says what it would take, and leaves nothing
half made.
"""

from __future__ import annotations

import io
import os
import sys
import threading
import time
from collections.abc import Callable
from decimal import Decimal
from typing import Any

import flint
import numpy as np
import pytest

import veselova as vs
from draws import random_problem
from veselova.mechanics.core import budget as progress_lines
from veselova.mechanics.core.budget import ProgressLine, has_reader, limits
from veselova.service.api.problem_details import problem_document
from veselova.service.workers.processes import Processes

#: Seconds of the processor that a stop may come late, with room for a slow machine.
LATE_S = 5.0

BODY = vs.Veselova([3, 2, "1.5", 1], ["0.5"] * 4, ["1.1", "-0.7", "0.3", "-0.7"])
WIDE = vs.Veselova([8, 7, 6, 5, 4, 3, 2, 1], [1] * 8, [1, -2, 3, -1, 2, 1, -3, 2], normalize=True)
LARGE = vs.Veselova(np.linspace(1, 3, 300), np.ones(300), np.cos(np.arange(300.0)), normalize=True)
LINE = vs.EllipsoidGeodesic([4, 3, 2, 1], [1, 1, 1, 1], [1, -1, 1, -1], normalize=True)

#: Work of ten seconds and more, through every engine and door.
LONG: dict[str, Callable[..., Any]] = {
    "dop853": lambda **o: vs.solve(BODY, [1e6], "numeric", **o),
    "windows": lambda **o: vs.solve(BODY, np.linspace(0, 1e5, 4_000_000), **o),
    "angles": lambda **o: vs.solve(WIDE, np.geomspace(1, 1e4, 600_000), **o),
    "compare": lambda **o: vs.compare(BODY, [1e6], **o),
    "closed form": lambda **o: vs.closed_form(WIDE, **o),
    # the same beyond double precision
    "modes": lambda **o: vs.solve(BODY, [3000], digits=60, **o),
    "panels": lambda **o: vs.solve(WIDE, [1], digits=60, **o),
    "certified": lambda **o: vs.solve(WIDE, [1], digits=60, certified=True, **o),
    "many times": lambda **o: vs.solve(BODY, np.linspace(0, 3, 100_000), digits=40, **o),
    "ellipsoid-geodesic": lambda **o: vs.solve(LINE, [500], digits=60, **o),
}


@pytest.mark.daily(4)
@pytest.mark.parametrize("name", LONG)
def test_work_is_stopped_when_its_budget_is_used_up(name: str) -> None:
    began = time.thread_time()
    with pytest.raises(vs.OverBudget, match=r"stopped after its budget of 0\.4 s") as stopped:
        LONG[name](budget_s=0.4)
    assert time.thread_time() - began < 0.4 + LATE_S
    assert (stopped.value.budget_s, stopped.value.estimate_s) == (0.4, None)


@pytest.mark.daily(4)
def test_large_bodies_are_refused_within_their_budget() -> None:
    with pytest.raises(vs.OverBudget, match="of the periods") as refused:
        vs.torus(LARGE, budget_s=5)
    assert refused.value.estimate_s is not None
    with pytest.raises(vs.OverBudget):
        vs.solve(LARGE, [1.0], budget_s=5)


def test_taylor_series_are_stopped_too() -> None:
    pytest.importorskip("heyoka")
    vs.solve(BODY, [1.0], "numeric", "taylor")  # compiled
    began = time.thread_time()
    with pytest.raises(vs.OverBudget):
        vs.solve(BODY, [1e7], "numeric", "taylor", budget_s=0.4)
    assert time.thread_time() - began < 0.4 + LATE_S


@pytest.mark.daily(3)
@pytest.mark.parametrize("n", [2, 4, 8])
@pytest.mark.parametrize(("digits", "certified"), [(20, False), (1000, False), (30, True)])
def test_far_times_are_answered_or_refused_in_time(n: int, digits: int, certified: bool) -> None:
    problem = random_problem(np.random.default_rng(n), n)
    began = time.thread_time()
    outcome, reason = "", ""
    try:
        # A budget keeps the answers that take seconds out of this test.
        found = vs.solve(
            problem, [8461 / problem.turning], digits=digits, certified=certified, budget_s=1
        )
    except vs.OverBudget as error:
        outcome, reason = "over-budget", str(error)
    except vs.Unsolved as error:
        outcome, reason = error.outcome, error.reason
    assert time.thread_time() - began < 1 + LATE_S
    assert outcome in ("", "over-budget", "too-far")
    assert outcome or max(found.decimals.error) < Decimal(10) ** -digits
    assert outcome != "too-far" or "ask for fewer digits or nearer times" in reason


def test_many_digits_have_a_hundred_thousand_times() -> None:
    with pytest.raises(vs.InvalidInput, match=r"times: required 100000 times at most, where .*"):
        vs.solve(BODY, np.linspace(0, 5, 2_000_000), digits=30)


def same(one: vs.Trajectory, other: vs.Trajectory) -> bool:
    names = one.problem.stored
    alike = all(np.array_equal(one.series(name), other.series(name)) for name in names)
    return alike and np.array_equal(one.error, other.error)


@pytest.mark.daily(3)
@pytest.mark.parametrize(
    ("count", "options"),
    [
        (700, {"engine": "numeric"}),
        (700, {"engine": "analytic"}),
        (700, {"method": "angles"}),
        (100, {"digits": 30}),
        (100, {"certified": True}),
    ],
)
def test_limits_change_no_bit(count: int, options: dict[str, Any]) -> None:
    times = np.linspace(-1, 3, count)
    plain = vs.solve(BODY, times, **options)
    watched = vs.solve(BODY, times, **options, budget_s=600, progress=lambda done, total: None)
    assert same(plain, watched)


@pytest.mark.daily(4)
def test_what_was_stopped_leaves_nothing_half_made() -> None:
    """The same motion object goes on answering, and with the same bits, after many stops."""
    precision = flint.ctx.prec
    for options in ({"engine": "analytic"}, {"digits": 40}):
        expected = vs.solve(WIDE, [0.5, 2.0], **options)
        again = vs.solve(WIDE, [0.0], **options)
        for budget_s in np.geomspace(1e-4, 0.3, 12):
            try:
                again.at([0.5, 2.0], budget_s=budget_s)
            except vs.OverBudget:
                assert flint.ctx.prec == precision
        assert same(again.at([0.5, 2.0]), expected)


@pytest.mark.daily(3)
def test_each_thread_has_its_own_budget() -> None:
    ended: dict[str, Any] = {}

    def run(name: str, time: float, **options: Any) -> None:
        try:
            ended[name] = vs.solve(BODY, [time], "numeric", **options)
        except vs.OverBudget as error:
            ended[name] = error

    threads = [
        threading.Thread(target=run, args=("short", 1e6), kwargs={"budget_s": 0.1}),
        threading.Thread(target=run, args=("long", 50.0), kwargs={"budget_s": 600}),
        threading.Thread(target=run, args=("none", 50.0)),
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert isinstance(ended["short"], vs.OverBudget)
    assert same(ended["long"], ended["none"])


@pytest.mark.parametrize("given", [0, -1, float("nan"), float("inf"), True, "5", [1]])
def test_a_budget_is_a_number_of_seconds(given: Any) -> None:
    for door in (vs.torus, lambda problem, **o: vs.solve(problem, [1.0], **o)):
        with pytest.raises(vs.InvalidInput, match="budget_s: required a finite number of seconds"):
            door(BODY, budget_s=given)
    assert vs.torus(BODY, budget_s=10**400).n == 4


def test_progress_is_a_truth_value_or_a_function() -> None:
    with pytest.raises(vs.InvalidInput, match=r"progress: required True, False, None or a funct"):
        vs.torus(BODY, progress="yes")  # type: ignore[arg-type]


@pytest.mark.daily(4)
@pytest.mark.parametrize("name", ["dop853", "windows", "panels", "modes"])
def test_progress_is_told_of_every_kind_of_work(name: str) -> None:
    heard: list[tuple[float, float]] = []

    def hear(done: float, total: float) -> None:
        heard.append((done, total))
        if len(heard) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        LONG[name](budget_s=600, progress=hear)
    assert all(0 <= done <= total for done, total in heard)


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_nobody_else_is_shown_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress_lines, "_PATIENCE_S", 0.0)
    quiet = io.StringIO()
    monkeypatch.setattr(sys, "stderr", quiet)
    assert not has_reader()
    for progress in (None, False):
        vs.solve(BODY, [20], "numeric", progress=progress)
    monkeypatch.setattr(sys, "stderr", Terminal())
    vs.solve(BODY, [20], "numeric", progress=False)
    with limits(progress=False):  # as in the workers of a server
        vs.solve(BODY, [20], "numeric")
    inside: list[bool] = []
    thread = threading.Thread(target=lambda: inside.append(has_reader()))
    thread.start()
    thread.join()
    assert inside == [False]
    assert sys.stderr.getvalue() == quiet.getvalue() == ""
    monkeypatch.setattr(sys, "stderr", None)
    assert not has_reader()
    ProgressLine()("motion", 1, 2)


def test_a_worker_ends_its_work_itself_and_lives_on() -> None:
    pool = Processes(1, 2048)
    try:
        worker = pool.submit(os.getpid).result()
        with pytest.raises(vs.OverBudget) as raised:
            pool.submit(vs.solve, BODY, [1e6], "numeric", budget_s=0.3).result()
        assert pool.submit(os.getpid).result() == worker
    finally:
        pool.close().join()
    document = problem_document(raised.value)
    assert (document["status"], document["type"]) == (504, "urn:veselova:problem:over-budget")
    assert str(raised.value) == document["detail"]
