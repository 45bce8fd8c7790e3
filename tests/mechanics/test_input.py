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
from veselova import InvalidInput, Veselova
from veselova.mechanics.core.errors import VeselovaError
from veselova.mechanics.core.exact_input import exact_number
from veselova.mechanics.core.times import TimeGrid

GOOD: dict[str, Any] = {"A": [3, 2, 1], "q": [0.6, 0.0, 0.8], "q_dot": [0.8, 1.0, -0.6]}


def test_numbers_are_taken_exactly() -> None:
    assert exact_number("0.7", ()) == Fraction(7, 10)
    assert exact_number("7/10", ()) == Fraction(7, 10)
    assert exact_number(" -1.5e-3 ", ()) == Fraction(-3, 2000)
    assert exact_number(0.1, ()) == Fraction(0.1)
    assert exact_number(Decimal("0.1"), ()) == Fraction(1, 10)
    assert exact_number(np.float32(0.5), ()) == Fraction(1, 2)
    assert exact_number(np.int64(3), ()) == 3


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
