"""The text of the kernel over arrays: its functions with Arb's numbers in the place of doubles, or
with NumPy's arrays of doubles, which need no compiler.

A function that takes one point takes an array of balls for many: entries of arrays of objects are
arrays then.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from types import FunctionType, SimpleNamespace
from typing import Any

import numpy as np
from flint import arb

from veselova.analytic.arithmetic.balls import Balls, Values
from veselova.analytic.kernel import arithmetic, elliptic, frame, periods, rate

__all__ = ["DOUBLES", "LEFT_OUT", "rebound", "text_over", "zeros"]

#: Derived: k² of the last modulus of an interval, in the precision, and levels until there. What is
#: neglected there is below k² of the functions, and a level makes three times as much of it at
#: most, so far less than _LEFT_OUT of the precision.
_NEGLIGIBLE, _LEVELS = 2.0**-100, 40

#: Derived: what the circular functions at the last modulus leave out of the elliptic ones, relative
#: to them and in the precision.
LEFT_OUT = 2.0**-24


class _Doubles:
    """Doubles in arrays with the names of ``Balls``; nothing is known of their radii."""

    digits, nats, certified = 16, 42.0, False
    pi, epsilon, number = math.pi, arithmetic.EPSILON, float
    log, sin, cos, atan, sqrt = np.log, np.sin, np.cos, np.arctan, np.sqrt
    inverse = staticmethod(np.linalg.inv)

    def nodes(self, count: int) -> Values:
        return np.asarray((2 * np.arange(count) + 1) * (math.pi / (2 * count)))

    def add_error(self, values: Any, _: Any) -> Any:
        return values


DOUBLES: Any = _Doubles()


@lru_cache(maxsize=64)
def text_over(xp: Balls) -> Any:
    """Return the functions of elliptic angles, differentials, rate, and frame with its error by
    their names; call them ``with xp:``.
    """
    parts = (arithmetic, elliptic, periods, frame, rate)
    text = rebound({name: value for part in parts for name, value in vars(part).items()})
    text |= {name: getattr(xp, name) for name in ("atan", "cos", "log", "pi", "sin", "sqrt")}
    text |= {
        "EPSILON": xp.epsilon * _NEGLIGIBLE,
        "MOST_LEVELS": _LEVELS,
        "ROOM": elliptic.SCALE + 2 * _LEVELS,
    }
    return SimpleNamespace(**text)


def rebound(names: Mapping[str, Any]) -> dict[str, Any]:
    """Return the names of a text, its functions bound to what is returned: they call what is put
    there in the place of an arithmetic.
    """
    text = dict(names)
    for name, value in names.items():
        function = getattr(value, "py_func", value)  # where numba compiled it
        if isinstance(function, FunctionType):
            text[name] = FunctionType(function.__code__, text, name)
    return text


def zeros(shape: Any) -> Values:
    """Return balls that are zero."""
    return np.full(shape, arb(0), dtype=object)
