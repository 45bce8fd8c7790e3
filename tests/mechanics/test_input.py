"""Input is taken exactly or refused with one sentence that names the field, what was required and
what was given.
"""

from __future__ import annotations

import contextlib
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from problems import TABLE
from veselova import InvalidInput, Veselova, solve
from veselova.mechanics.core.errors import VeselovaError, show
from veselova.mechanics.core.exact_input import exact_number, plain
from veselova.mechanics.core.times import TimeGrid


def test_numerals_given_as_texts_are_shown_as_texts() -> None:
    texts = [show(value) for value in ("50", " 1e3", "inf", "", "None")]
    assert texts == ["'50'", "' 1e3'", "'inf'", "''", "'None'"]
    numbers = [show(value) for value in ("abc", 50, Fraction(1, 10), Decimal("0.5"))]
    assert numbers == ["abc", "50", "1/10", "0.5"]


GOOD: dict[str, Any] = {"A": [3, 2, 1], "q": [0.6, 0.0, 0.8], "q_dot": [0.8, 1.0, -0.6]}

#: (field that the error must name, changes to GOOD): the list at the end of the HTTP contract, at
#: the Python door.
BAD = [
    ("A[1]", {"A": [3, float("nan"), 1]}),
    ("A[1]", {"A": [3, float("inf"), 1]}),
    ("A[0]", {"A": [True, 2, 1]}),
    ("A[2]", {"A": [3, 2, "1e999"]}),
    ("A[2]", {"A": [3, 2, "one"]}),
    ("A[2]", {"A": [3, 2, "1/0"]}),
    ("A[2]", {"A": [3, 2, None]}),
    ("A[2]", {"A": [3, 2, 1j]}),
    ("A[2]", {"A": [3, 2, 10**400]}),
    ("A[1]", {"A": [3, 0, 1]}),
    ("A[1]", {"A": [3, -2, 1]}),
    ("A", {"A": [3]}),
    ("A", {"A": []}),
    ("A", {"A": "321"}),
    ("A", {"A": {"a": 1}}),
    ("A[0][1]", {"A": [[3, 1, 0], [0, 2, 0], [0, 0, 1]]}),
    ("A", {"A": [[1, 2], [2, 1]], "q": [1, 0], "q_dot": [0, 1]}),
    ("A[1]", {"A": [[3, 0, 0], [0, 2], [0, 0, 1]]}),
    ("q", {"q": [0, 0, 0]}),
    ("q", {"q": [0.6, 0.8]}),
    ("q", {"q": [0.6, 0.0, 0.9]}),
    ("q", {"q": 0.6}),
    ("q[1]", {"q": [0.6, [0.0], 0.8]}),
    ("q_dot", {"q_dot": [0.8, 1.0]}),
    ("q_dot", {"q_dot": [0.8, 1.0, 0.6]}),
    ("q_dot[0]", {"q_dot": [float("-inf"), 1.0, 0.6]}),
    ("frame", {"frame": np.eye(2).tolist()}),
    ("frame", {"frame": np.eye(3).tolist()}),
    ("frame", {"frame": (2 * np.eye(3)).tolist()}),
    ("frame[1][2]", {"frame": [[1, 0, 0], [0, 1, "x"], [0, 0, 1]]}),
    ("normalize", {"normalize": 1}),
    ("q_dot", {"q_dot": [0.8e200, 1e200, -0.6e200]}),
    ("q_dot", {"A": [1, 2], "q": [0.6, 0.8], "q_dot": [1.7e308, -1.7e308], "normalize": True}),
    (
        "q_dot",
        {"A": [[2, 0.5], [0.5, 1]], "q": [1, 0], "q_dot": [1.7e308, 1.7e308], "normalize": True},
    ),
    ("q[0]", {"q": [Decimal("1e99999999"), 0, 1]}),
    ("q", {"q": np.ma.masked_array([0.6, 0.0, 0.8], [False, True, False])}),
]


@pytest.mark.parametrize(("field", "changes"), BAD)
def test_bad_input_is_refused_by_name(field: str, changes: dict[str, Any]) -> None:
    with pytest.raises(InvalidInput) as raised:
        Veselova(**{**GOOD, **changes})
    assert raised.value.field == field
    assert isinstance(raised.value, ValueError)
    message = str(raised.value)
    assert message.startswith(f"{field}: required ")
    assert "; given " in message
    assert "\n" not in message
    assert len(message) < 250


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
        " ",
        "0x10",
        "1_000",
        "١",
        "inf",
        "nan",
        "1e",
        "1//2",
        "1/2/3",
        "--1",
        "1e99999",
        "9" * 3000,
        "1/0.0",
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
    for bad in ((0.0, 1.0, 0), (1.0, 0.0, 3), (-1e308, 1e308, 3)):
        with pytest.raises(InvalidInput):
            uniform(*bad)


def test_normalize_scales_and_projects_first() -> None:
    problem = Veselova([3, 2, 1], [3, 0, 4], [1, 1, 1], normalize=True)
    assert np.allclose(problem.q, [0.6, 0, 0.8], atol=1e-16)
    assert abs(problem.q @ problem.q_dot) < 1e-16


def test_a_velocity_along_q_is_rest() -> None:
    problem = Veselova([3, 2, 1], [0.1, 0.2, 0.3], ["0.3", "0.6", "0.9"], normalize=True)
    assert problem.moves  # 0.1 as a double is not one tenth
    problem = Veselova([3, 2, 1], ["0.1", "0.2", "0.3"], ["0.3", "0.6", "0.9"], normalize=True)
    assert not problem.moves


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


def test_ratios_and_decimals_become_strings_in_json() -> None:
    assert plain([Fraction(7, 10), Decimal("0.1"), 1, 0.5, "2/3", np.float64(2.5)]) == [
        "7/10",
        "0.1",
        1,
        0.5,
        "2/3",
        2.5,
    ]


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
