"""Results do not depend on the caller's floating-point, decimal and interval contexts."""

from __future__ import annotations

import decimal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import flint
import numpy as np
import pytest

import veselova as vs
from veselova.curves import RealHyperelliptic
from veselova.theta import riemann_theta

POINT = vs.Veselova([3, 2, 1], ["0.6", 0, "0.8"], [0, 1, 0])
BODY: dict[str, Any] = {"inertia": [1, 2, 2.5], "gamma": ["0.6", 0, "0.8"], "Omega": [0.3, 1, 2]}
MOTION = cache(lambda: vs.solve(POINT, ["0.1", 5], digits=30))
CLOSED = cache(lambda: vs.closed_form(POINT))

DOORS: dict[str, Callable[[], Any]] = {
    "numeric": lambda: vs.solve(POINT, [0, 1, 5], "numeric").frame,
    "digits": lambda: vs.solve(vs.VeselovaSO3(**BODY), [0, 1.5], digits=30).decimals,
    "at": lambda: CLOSED().at([0, 1.0]).frame,
    "later": lambda: MOTION().at([0.3]).decimals,
    "theta": lambda: riemann_theta([0.1, 3j], np.array([[1, 0.2], [0.2, 1.3]]) * 1j),
    "curve": lambda: RealHyperelliptic([1, 0.5, 1 / 3, 0.2, 0]).periods.b,
}


@contextmanager
def hostile() -> Iterator[None]:
    """Raise at rounded decimals and at floats beyond range, and keep few digits."""
    context = decimal.Context(
        prec=3, rounding=decimal.ROUND_UP, Emax=20, Emin=-20, traps=[decimal.Inexact]
    )
    strict = np.errstate(over="raise", divide="raise", invalid="raise")
    with strict, decimal.localcontext(context), flint.ctx.workprec(11):
        yield


@pytest.mark.parametrize("door", DOORS)
def test_no_context_of_the_caller_changes_a_result(door: str) -> None:
    expected = DOORS[door]()
    with hostile():
        found = DOORS[door]()
    assert str(found) == str(expected)
    if isinstance(found, np.ndarray):
        assert np.array_equal(found, expected)
