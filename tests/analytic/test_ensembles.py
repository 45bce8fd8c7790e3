"""Many problems in one call: the motions and tori of each, whatever else is computed with them."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest

import veselova as vs
from conftest import slow
from draws import random_problem
from veselova.mechanics.core.errors import InvalidInput, OverBudget

Array = np.ndarray[Any, Any]

TIMES: list[Any] = [0.0, 7.0, 0.3, "1/3", -90.0, 1e4]

#: Times that panels reach.
NEAR_TIMES: list[Any] = [0.0, 7.0, 0.3, "1/3", -20.0, 60]


def starts(rng: np.random.Generator, count: int, n: int) -> dict[str, Any]:
    A = np.exp(rng.uniform(0, np.log(10), (count, n)))
    return {"A": A, "q": rng.normal(size=(count, n)), "q_dot": rng.normal(size=(count, n))}


def single(given: dict[str, Any], i: int) -> vs.Veselova:
    return vs.Veselova(given["A"][i], given["q"][i], given["q_dot"][i], normalize=True)


def require_truth(ensemble: vs.Ensemble, i: int, problem: vs.Veselova, times: Any) -> None:
    """Hold one row of an ensemble against 22 digits from the exact data: true ≤ error."""
    truth = vs.solve(problem, times, digits=22)
    off = np.abs(truth.frame - ensemble.frame[i]).max(axis=(1, 2)) - truth.error
    assert np.all(off <= ensemble.error[i])
    speed = np.abs(truth.q_dot).max()
    assert np.abs(truth.q_dot - ensemble.q_dot[i]).max() <= 8 * speed * ensemble.error[i].max()
    elapsed = 1 + np.abs(truth.tau1)
    assert np.max(np.abs(truth.tau1 - ensemble.tau1[i]) / elapsed) < 1e-13


@pytest.mark.daily(4)
@pytest.mark.parametrize("n", [2, slow(3), 4, slow(5)])
def test_errors_bound_the_truth_side_by_side(n: int, rng: np.random.Generator) -> None:
    problems = [
        random_problem(rng, n, float(np.exp(rng.uniform(0, np.log(100)))), framed=k % 2 == 0)
        for k in range(12 if n < 4 else 4)
    ]
    times = TIMES if n < 4 else NEAR_TIMES
    ensemble = vs.solve_many(problems, times)
    assert ensemble.together.all()
    assert ensemble.solved.all()
    for i, problem in enumerate(problems):
        require_truth(ensemble, i, problem, times)


def test_any_start_is_served_or_named(rng: np.random.Generator) -> None:
    given = starts(rng, 12, 3)
    given["A"][1] = [2.0, 2.0, 1.0]
    given["q"][2, 0] = given["q_dot"][2, 0] = 0.0
    given["q"][3] = [0.0, 1.0, 1.0]
    given["q_dot"][4] = 0.0
    given["q"][5, 1] = np.nan
    given["A"][6, 0] = -1.0
    given["q_dot"][7] = given["q"][7] * 3
    ensemble = vs.solve_many({**given, "normalize": True}, TIMES)
    assert ensemble.outcome[[5, 6]].tolist() == ["invalid-input"] * 2
    assert "q[1]" in ensemble.detail[5]
    assert "A[0]" in ensemble.detail[6]
    assert np.isnan(ensemble.frame[5]).all()
    others = np.delete(np.arange(12), [5, 6])
    assert ensemble.solved[others].all()
    assert not ensemble.together[[1, 2, 4]].any()
    for i in others:
        alone = vs.solve(single(given, i), TIMES)
        off = np.abs(ensemble.frame[i] - alone.frame).max(axis=(1, 2))
        assert np.all(off <= ensemble.error[i] + alone.error)


def require_independence(rng: np.random.Generator) -> None:
    """Hold problems among many to the same numbers as among few."""
    given = starts(rng, 60, 3)
    whole = vs.solve_many({**given, "normalize": True}, TIMES)
    chosen = rng.permutation(60)[:17]
    part = {name: values[chosen] for name, values in given.items()}
    found = vs.solve_many({**part, "normalize": True}, TIMES)
    for name in ("frame", "q_dot", "tau1"):
        assert np.array_equal(getattr(found, name), getattr(whole, name)[chosen])
    assert np.array_equal(found.error, whole.error[chosen])


def test_no_number_depends_on_the_other_problems(rng: np.random.Generator) -> None:
    require_independence(rng)


ROWS = [[0.6, 0.0, 0.8], [0.8, 0.0, 0.6]]
TURNS = [[0.8, 1.0, -0.6], [0.1, 0.2, 0.3]]
BALL = {"mass": 1.5, "radius": [0.5, 0.7], "gamma": ROWS, "Omega": TURNS}


@pytest.mark.parametrize(
    ("given", "kind"),
    [
        ({"inertia": [3, 4, 5], "gamma": ROWS, "Omega": TURNS}, vs.VeselovaSO3),
        ({"inertia": [[3, 4, 5], [1, 2, 2]], "gamma": ROWS[0], "Omega": TURNS}, vs.VeselovaSO3),
        ({"system": "rubber-ball", "inertia": [np.diag([3, 4, 5])], **BALL}, vs.RubberBall),
        ({"system": "chaplygin-ball", "inertia": [3, 4, 5], **BALL}, vs.ChaplyginBall),
        ({"A": [3, 2, 1], "q": ROWS, "q_prime": TURNS, "normalize": True}, vs.NeumannSystem),
        ({"A": [3, 2, 1], "X": ROWS, "X_dot": TURNS, "normalize": True}, vs.EllipsoidGeodesic),
        ({"A": [3, 2, 1], "q": ROWS[0], "q_dot": TURNS, "normalize": True}, vs.Veselova),
    ],
)
def test_fields_of_any_system_with_a_torus_are_taken(
    given: dict[str, Any], kind: type[vs.Problem]
) -> None:
    pytest.importorskip("xarray")
    names = list(kind.outputs)
    many = vs.solve_many(given, [0.0, 0.5], names if kind is vs.Veselova else None)
    assert list(many.arrays) == names
    for i in range(2):
        fields = {
            name: value[min(i, len(value) - 1)] if np.ndim(value) > single_axes(name) else value
            for name, value in given.items()
            if name != "system"
        }
        alone = vs.solve(kind(**fields), [0.0, 0.5])
        for name in names:
            assert np.array_equal(many.arrays[name][i], alone.series(name))
        assert np.array_equal(many.error[i], alone.error)
    data = many.to_xarray()
    assert all(data[name].attrs["long_name"] != name for name in names)
    time_of = {"neumann": "Neumann time", "ellipsoid-geodesic": "arc length"}
    assert data.time.attrs["long_name"] == time_of.get(kind.system, "time")
    first = "frame_1_1"
    assert many.to_dataframe().loc[(1, 0.5), first] == many.frame[1, 1, 0, 0]


def bodies(rng: np.random.Generator, count: int) -> tuple[Array, Array]:
    """Return γ and Ω that rounding alone keeps from (Ω,γ) = 0, the last of them with a spin."""
    gamma, q_dot = body_starts(rng, count)
    Omega = np.cross(gamma, q_dot)
    Omega[-1] += gamma[-1]
    return gamma, Omega


@pytest.mark.daily(3)
@pytest.mark.parametrize("by_flow_map", [False, True])
def test_errors_bound_the_truth_of_bodies_in_space(
    by_flow_map: bool, rng: np.random.Generator
) -> None:
    inertia = [3.0, 4.3, 5.1]
    gamma, Omega = bodies(rng, 8)
    if by_flow_map:
        many = vs.FlowMap(inertia=inertia).solve(gamma, Omega, TIMES)
    else:
        given = {"inertia": inertia, "gamma": gamma, "Omega": Omega}
        many = vs.solve_many(given, TIMES)
    assert many.solved.all()
    for i in range(0, 8, 2):
        body = vs.VeselovaSO3(inertia, gamma[i], Omega[i])
        truth = vs.solve(body, TIMES, digits=22)
        off = np.abs(truth.frame - many.frame[i]).max(axis=(1, 2)) - truth.error
        assert np.all(off <= many.error[i])
        for name, values in many.arrays.items():
            size = 1 + np.abs(truth.series(name)).max()
            assert np.abs(truth.series(name) - values[i]).max() <= 20 * size * many.error[i].max()


def single_axes(name: str) -> int:
    """Return the axes of a field of one problem."""
    return {"mass": 0, "radius": 0, "normalize": 0}.get(name, 1)


def test_archives_keep_all(tmp_path: Any, rng: np.random.Generator) -> None:
    ensemble = vs.solve_many({**starts(rng, 3, 3), "normalize": True}, [1.0])
    ensemble.to_npz(tmp_path / "many.npz")
    with np.load(tmp_path / "many.npz") as archive:
        assert np.array_equal(archive["frame"], ensemble.frame)
        assert archive["outcome"].tolist() == ["solved"] * 3


def test_more_memory_than_the_limit_is_refused_before_the_work(rng: np.random.Generator) -> None:
    given = {**starts(rng, 1000, 3), "normalize": True}
    with pytest.raises(InvalidInput, match=r"1000 problems at 1000000 times: 112 GB"):
        vs.solve_many(given, {"start": 0, "stop": 1, "count": 1_000_000})
    with pytest.raises(InvalidInput, match="at most 1e-06 GB"):
        vs.solve_many(given, [1.0], most_bytes=1000)


@pytest.mark.parametrize("count", [20_000, 150_000])
def test_budgets_end_ensembles(count: int, rng: np.random.Generator) -> None:
    given = {**starts(rng, count, 3), "normalize": True}
    began = time.process_time()
    for solve in (lambda: vs.solve_many(given, [1.0], budget_s=0.05), lambda: tori_within(given)):
        with pytest.raises(OverBudget):
            solve()
    assert time.process_time() - began < 3  # not that of all starts, which is eight for so many


def tori_within(given: dict[str, Any]) -> vs.Tori:
    return vs.tori(**given, budget_s=0.05)


def test_tori_name_what_has_none(rng: np.random.Generator) -> None:
    given = starts(rng, 6, 4)
    given["q_dot"][1] = 0.0
    given["q"][2, 0] = np.nan
    given["q"][3, 0] = given["q_dot"][3, 0] = 0.0
    given["q"][4, 0] = 0.0
    tori = vs.tori(**given, normalize=True)
    assert tori.outcome.tolist() == [
        "solved",
        "at-rest",
        "invalid-input",
        "fewer-phases",
        "solved",
        "solved",
    ]
    for i in np.flatnonzero(tori.solved):
        alone = vs.torus(single(given, i))
        assert tori.frequencies_t[i] == pytest.approx(alone.frequencies_t, rel=1e-13)
        assert tuple(tori.origins[i]) == alone.origins
    assert np.isnan(tori.phases[1]).all()
    one_body = vs.tori([3, 2, 1.5, 1], given["q"][4:], given["q_dot"][4:], normalize=True)
    assert len(one_body) == 2


BODY = [1.6, 1.05, 0.5]


def body_starts(rng: np.random.Generator, count: int) -> tuple[Array, Array]:
    q, q_dot = rng.normal(size=(2, count, 3))
    q /= np.linalg.norm(q, axis=1)[:, None]
    q_dot -= np.sum(q * q_dot, axis=1)[:, None] * q
    return q, q_dot


@pytest.mark.daily(3)
@pytest.mark.parametrize("A", [BODY, slow([1.0, 40.0, 3.0]), slow([1.0, 1.02, 1.05])])
def test_a_flow_map_bounds_the_truth(A: list[float], rng: np.random.Generator) -> None:
    q, q_dot = body_starts(rng, 40)
    flow = vs.FlowMap(A)
    found = flow.solve(q, q_dot, TIMES, normalize=True)
    assert found.solved.all()
    # of a body with wide A's some starts have slow modes, and go to solve
    assert np.mean(found.together) > (0.8 if max(A) > 10 else 0.99)
    for i in range(0, 40, 4):
        problem = vs.Veselova(A, q[i], q_dot[i], normalize=True)
        require_truth(found, i, problem, TIMES)


@pytest.mark.parametrize(
    "A", [[1e28, 2e27, 3e27], [1e4, 1.0, 1e-4], [1e-29, 1.0, 1e29], [2, 2, 1], [4, 3, 2, 1]]
)
def test_a_flow_map_of_any_body_gives_what_solve_many_gives(
    A: list[float], rng: np.random.Generator
) -> None:
    q, q_dot = rng.normal(size=(2, 9, len(A)))
    times = [0.0, 1e-20 if min(A) < 1e-20 else 1.0]
    found = vs.FlowMap(A).solve(q, q_dot, times, normalize=True)
    other = vs.solve_many({"A": A, "q": q, "q_dot": q_dot, "normalize": True}, times)
    assert found.outcome.tolist() == other.outcome.tolist()
    off = np.abs(found.frame - other.frame).max(axis=(2, 3))
    assert np.all((off <= found.error + other.error) | ~found.solved[:, None])


@pytest.mark.parametrize(
    ("A", "words"),
    [([2, -1, 1], r"A\[1\]: required a finite number greater than 0"), ("abc", "a list of")],
)
def test_flow_maps_of_other_bodies_are_refused(A: Any, words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        vs.FlowMap(A)
    with pytest.raises(InvalidInput, match=words.replace("A", "inertia")):
        vs.FlowMap(inertia=A)
    for given in ({}, {"A": BODY, "inertia": BODY}):
        with pytest.raises(InvalidInput, match="A or inertia"):
            vs.FlowMap(**given)
    flow = vs.FlowMap(BODY)
    with pytest.raises(InvalidInput, match=r"q_dot: required an array of shape \(3,\) or \(2, 3\)"):
        flow.solve(np.ones((2, 3)), np.ones((1, 3)), [1.0])
    with pytest.raises(InvalidInput, match=r"problems\.q: required this field"):
        flow.solve(None, np.ones((1, 3)), [1.0])  # type: ignore[arg-type]
