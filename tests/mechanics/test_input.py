"""Input is taken exactly or refused with one sentence that names the field, what was required and
what was given.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Callable
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import veselova as vs
from problems import TABLE
from veselova import InvalidInput, Veselova, solve
from veselova.mechanics.core.errors import VeselovaError
from veselova.mechanics.core.exact_input import exact_number
from veselova.mechanics.core.times import TimeGrid
from veselova.theta import riemann_theta

GOOD: dict[str, Any] = {"A": [3, 2, 1], "q": [0.6, 0.0, 0.8], "q_dot": [0.8, 1.0, -0.6]}


@pytest.mark.parametrize(
    "times",
    [
        [],
        [float("nan")],
        [0, float("inf")],
        ["a"],
        [True],
        float("nan"),
        "0,1",
        None,
        [[0, 1]],
        {"start": 0},
    ],
)
@pytest.mark.parametrize("engine", ["analytic", "numeric"])
def test_bad_times_are_refused(times: Any, engine: str) -> None:
    with pytest.raises(InvalidInput) as raised:
        solve(Veselova(**GOOD), times, engine)
    assert raised.value.path[0] == "times"


@pytest.mark.parametrize(
    ("field", "call"),
    [
        ("engine", ("other", None)),
        ("method", ("analytic", "taylor")),
        ("method", ("numeric", "theta")),
    ],
)
def test_unknown_engines_and_methods_are_refused(field: str, call: tuple[str, str | None]) -> None:
    with pytest.raises(InvalidInput) as raised:
        solve(Veselova(**GOOD), [0, 1], *call)
    assert raised.value.field == field


def test_something_else_than_a_problem_is_refused() -> None:
    with pytest.raises(InvalidInput):
        solve([3, 2, 1], [0, 1])  # type: ignore[arg-type]


def test_numbers_are_taken_exactly() -> None:
    assert exact_number("0.7", ()) == Fraction(7, 10)
    assert exact_number("7/10", ()) == Fraction(7, 10)
    assert exact_number(" -1.5e-3 ", ()) == Fraction(-3, 2000)
    assert exact_number(0.1, ()) == Fraction(0.1)
    assert exact_number(Decimal("0.1"), ()) == Fraction(1, 10)
    assert exact_number(np.float32(0.5), ()) == Fraction(1, 2)
    assert exact_number(np.int64(3), ()) == 3


@pytest.mark.parametrize(
    "text",
    [
        "",
        "0x10",
        "١",
        "nan",
        "1//2",
        "--1",
        "9" * 3000,
    ],
)
def test_odd_numerals_are_refused(text: str) -> None:
    with pytest.raises(InvalidInput):
        exact_number(text, ("x",))


@given(
    st.recursive(
        st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=8),
        lambda x: st.lists(x, max_size=4),
        max_leaves=12,
    )
)
def test_no_value_of_any_shape_escapes_validation(value: Any) -> None:
    for field in ("A", "q", "q_dot", "frame"):
        with contextlib.suppress(InvalidInput):
            Veselova(**{**GOOD, field: value})


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1, max_size=6))
def test_times_are_kept_to_the_last_bit(times: list[float]) -> None:
    assert TimeGrid.of(times).asked.tolist() == times


def test_uniform_times_include_both_ends() -> None:
    def uniform(*grid: float) -> TimeGrid:
        return TimeGrid.of(dict(zip(("start", "stop", "count"), grid, strict=True)))

    assert uniform(0.0, 1.0, 5).doubles.tolist() == [0, 0.25, 0.5, 0.75, 1]
    assert uniform(2.0, 2.0, 1).doubles.tolist() == [2.0]
    assert uniform(-1e308, 1e308, 3).doubles.tolist() == [-1e308, 0, 1e308]
    for bad in ((0.0, 1.0, 0), (1.0, 0.0, 3)):
        with pytest.raises(InvalidInput):
            uniform(*bad)


def test_normalize_scales_and_projects_first() -> None:
    problem = Veselova([3, 2, 1], [3, 0, 4], [1, 1, 1], normalize=True)
    assert np.allclose(problem.q, [0.6, 0, 0.8], atol=1e-16)
    assert abs(problem.q @ problem.q_dot) < 1e-16


def test_data_off_the_manifold_within_the_tolerance_are_put_on_it() -> None:
    problem = Veselova([3, 2, 1], [0.6 + 4e-10, 0, 0.8], [0.8, 1 + 1e-10, -0.6])
    assert abs(problem.q @ problem.q - 1) < 1e-15
    assert abs(problem.q @ problem.q_dot) < 1e-15


def test_a_problem_is_immutable_and_keeps_its_own_copy() -> None:
    A = np.array([3.0, 2.0, 1.0])
    problem = Veselova(A, **{k: v for k, v in GOOD.items() if k != "A"})
    A[0] = 7
    assert problem.A[0] == 3
    with pytest.raises(ValueError, match="read-only"):
        problem.q[0] = 1.0
    with pytest.raises(AttributeError):
        problem.A = A  # type: ignore[misc]


@pytest.mark.parametrize("case", TABLE, ids=lambda case: case.name)
def test_a_problem_survives_its_json_form(case: Any) -> None:
    problem = case.problem()
    document = problem.as_dict()
    assert document.pop("system") == "veselova"
    again = Veselova(**document)
    assert again.exact == problem.exact
    assert np.array_equal(again.frame, problem.frame)


def test_errors_survive_pickling() -> None:
    import pickle

    from veselova.mechanics.core import errors

    samples: list[VeselovaError] = [
        errors.InvalidInput(("A", 1), "a number", "x"),
        errors.InvalidRequest([errors.InvalidInput(("A",), "a", "b")]),
        errors.Unsolved("closed-gap", "why"),
        errors.BackendMissing("heyoka", "this", "pip"),
        errors.InternalContradiction("what"),
        errors.ProblemResponse(422, {"detail": "d"}),
    ]
    for error in samples:
        again = pickle.loads(pickle.dumps(error))
        assert type(again) is type(error)
        assert str(again) == str(error)
        assert again.__dict__.keys() == error.__dict__.keys()


Q, V = np.array([[0.6, 0.48, 0.64]]), np.array([[0.8, -0.36, -0.48]])
BODY = Veselova([3, 2, 1], Q[0], V[0])
MOTION = solve(BODY, [0, 1])
GEODESIC = vs.EllipsoidGeodesic.from_angles("WGS84", 1, 2, 3)


def many(**changes: Any) -> vs.Ensemble:
    return vs.solve_many({"A": [3, 2, 1], "q": Q, "q_dot": V, **changes}, [0.0])


@pytest.mark.parametrize(
    ("field", "ask"),
    [
        ("A", lambda: many(A=np.ma.array([3.0, 2, 1], mask=[1, 0, 0]))),
        ("q_dot", lambda: many(q_dot=np.ma.array(V, mask=[[0, 0, 1]]))),
        ("A", lambda: many(A=np.array([3 + 1j, 2, 1]))),
        ("q", lambda: many(q=Q.astype(np.longdouble) / 3)),
        ("A", lambda: vs.FlowMap(np.ma.array([3.0, 2, 1], mask=[1, 0, 0]))),
        ("A[0]", lambda: vs.FlowMap([True, 2, 3])),
        ("times", lambda: solve(BODY, np.ma.masked)),
        ("A", lambda: vs.from_torus([], 0.7, [0.7], [0.1, 0.2], [1, 1, 1])),
        ("ellipsoid[0]", lambda: vs.EllipsoidGeodesic.from_angles([1e200, 1, 1], 1, 1, 1)),
        ("y", lambda: BODY.rhs(0, "x")),
        ("z[0]", lambda: riemann_theta(np.ma.array([0.1, 0.2], mask=[1, 0]), 1j * np.eye(2))),
        ("indent", lambda: vs.closed_form(BODY).to_json(np.nan)),  # type: ignore[arg-type]
        ("basis", lambda: vs.MatrixGroup(np.array(3))),
        ("most_bytes", lambda: vs.solve_many([BODY], [0], most_bytes=np.ones(2))),  # type: ignore[arg-type]
    ],
)
def test_numbers_that_would_be_changed_are_refused(field: str, ask: Callable[[], Any]) -> None:
    with pytest.raises(InvalidInput) as raised:
        ask()
    assert raised.value.field == field


LISTS: Any = (np.zeros((2, 3)), ["q"])


@pytest.mark.parametrize("given", LISTS, ids=repr)
@pytest.mark.parametrize(
    ("field", "ask"),
    [
        ("engine", lambda x: solve(BODY, [0], x)),
        ("formulation", lambda x: solve(BODY, [0], "numeric", formulation=x)),
        ("method", lambda x: vs.compare(BODY, [0], x)),
        ("digits", lambda x: solve(BODY, [0], digits=(x, x))),
        ("coordinates", lambda x: GEODESIC.geographic(None, x)),
        ("scalar_first", lambda x: MOTION.quaternions(scalar_first=x)),
        ("outputs", lambda x: MOTION.to_csv(io.BytesIO(), [x])),
    ],
)
def test_what_is_no_name_and_no_truth_value_is_refused(
    field: str, ask: Callable[[Any], Any], given: Any
) -> None:
    with pytest.raises(InvalidInput) as raised:
        ask(given)
    assert raised.value.field.startswith(field)
    assert given not in MOTION


@pytest.mark.parametrize(
    "given", [None, 3, io.StringIO("{"), Q], ids=["None", "3", "stream", "array"]
)
def test_what_is_no_file_is_refused(given: Any) -> None:
    doors = {
        "source": (vs.Trajectory.from_npz,),
        "target": (MOTION.to_csv, MOTION.to_npz, MOTION.to_parquet, MOTION.to_arrow),
        "document": (vs.ClosedForm.from_json,),
    }
    for field, functions in doors.items():
        for ask in functions:
            with pytest.raises(InvalidInput) as raised:
                ask(given)
            assert raised.value.field == field
