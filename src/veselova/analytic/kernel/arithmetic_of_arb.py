"""Arb's balls, at the working precision of python-flint: what the text calculates with for digits.

Recurrences run on midpoints (``middle``), since their radii grow exponentially: errors are
estimated by the text, and radii prove nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from flint import arb, ctx

F = TypeVar("F", bound=Callable[..., Any])

#: Derived: digits of the working precision that the text does not ask for.
SPARE = 6

EPSILON = 10.0 ** (SPARE - ctx.dps)
NATS = math.log(10) * (ctx.dps - SPARE + 1)
pi = arb.pi()
number = arb


def jit(function: F) -> F:
    """Return the function itself."""
    return function


jit_sum = jit


def size(x: Any) -> float:
    """Return |x| as a double."""
    return abs(float(x.mid())) if isinstance(x, arb) else abs(float(x))


def positive(x: Any) -> bool:
    """Return whether the midpoint is positive."""
    return bool(x.mid() > 0)


def whole(x: Any) -> int:
    """Return the nearest integer."""
    return round(float(x.mid()))


def middle(x: Any) -> Any:
    """Return the midpoint."""
    return x.mid()


def sqrt(x: Any) -> Any:
    """Return √x."""
    return x.sqrt()


def sin(x: Any) -> Any:
    """Return sin x."""
    return x.sin()


def cos(x: Any) -> Any:
    """Return cos x."""
    return x.cos()


def atan(x: Any) -> Any:
    """Return atan x."""
    return x.atan()


def exp(x: Any) -> Any:
    """Return e^x."""
    return x.exp()


def log(x: Any) -> Any:
    """Return log x, of a double as a double."""
    return x.log() if isinstance(x, arb) else math.log(x)


def zeros(*shape: int) -> Any:
    """Return zeros of a shape."""
    result = np.empty(shape, dtype=object)
    result.fill(arb(0))
    return result


zeros2 = zeros3 = zeros4 = zeros


def turns(high: Any, low: Any, t: Any) -> Any:
    """Return (high + low)·t modulo two."""
    product = (high + low) * t
    return product - 2 * (product / 2).mid().floor().mid()


def dot(a: Any, b: Any, count: int) -> Any:
    """Return Σ_{i<count} a_i b_i."""
    total = arb(0)
    for i in range(count):
        total += a[i] * b[i]
    return total
