"""Points of the unit sphere with a tangent velocity, as given and exactly."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from operator import mul
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.errors import Faults, InvalidInput
from veselova.mechanics.core.exact_input import exact_vector, to_float

__all__ = [
    "INPUT_TOLERANCE",
    "ExactState",
    "exact_cross",
    "inverse_length",
    "nonzero_vector",
    "over_largest",
    "point_on_sphere",
    "read_direction",
    "unit",
]

Array = NDArray[np.float64]

#: How far from unit length, tangency and orthogonality an input may be: ten-digit data pass, typing
#: errors do not.
INPUT_TOLERANCE = 1e-9


@dataclass(frozen=True)
class ExactState:
    """The data as exact rationals in principal axes, q not yet scaled and q_dot not yet projected.

    - frame: rows of the frame as given, along the body axes where A was a matrix; None for the
      natural frame
    """

    A: tuple[Fraction, ...]
    q: tuple[Fraction, ...]
    q_dot: tuple[Fraction, ...]
    frame: tuple[tuple[Fraction, ...], ...] | None

    @property
    def natural(self) -> bool:
        """Return whether the frame was left to us, so that the constant rotation ℜ of (orth,
        printed 7.6) is a sign matrix.
        """
        return self.frame is None

    @property
    def position(self) -> Array:
        """Return q/|q| in doubles."""
        return unit(to_float(over_largest(self.q)))

    @cached_property
    def tangent(self) -> tuple[Fraction, ...]:
        """Return q̇ − (q,q̇)/(q,q) q: exactly zero where q̇ is along q."""
        along = sum(map(mul, self.q, self.q_dot)) / sum(map(mul, self.q, self.q), Fraction())
        return tuple(b - along * a for a, b in zip(self.q, self.q_dot, strict=True))


def unit(vector: Array) -> Array:
    """Return the vector scaled to unit length."""
    # squares of very large or small entries would leave the float range
    scaled = vector / np.max(np.abs(vector))
    return np.asarray(scaled / np.linalg.norm(scaled), dtype=np.float64)


def exact_cross(a: tuple[Fraction, ...], b: tuple[Fraction, ...]) -> tuple[Fraction, ...]:
    """Return the vector product a×b, exactly."""
    return tuple(a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2] for i in range(3))


def inverse_length(vector: tuple[Fraction, ...], bits: int) -> Fraction:
    """Return 1/|x|, exactly where it is rational, and otherwise to a part 2^−bits of itself."""
    square = sum((x * x for x in vector), Fraction())
    above = math.isqrt(square.numerator)
    below = math.isqrt(square.denominator)
    if (above * above, below * below) == square.as_integer_ratio():
        return Fraction(below, above)
    bits += max(0, square.numerator.bit_length() - square.denominator.bit_length())
    return Fraction(math.isqrt((square.denominator << 2 * bits) // square.numerator), 1 << bits)


def over_largest(vector: tuple[Fraction, ...]) -> tuple[Fraction, ...]:
    """Return the vector over its largest entry, so that its floats have squares."""
    largest = max(abs(x) for x in vector)
    return tuple(x / largest for x in vector)


def read_direction(
    given: Any, n: int, normalize: bool, name: str = "gamma"
) -> tuple[tuple[Fraction, ...], Array]:
    """Return γ as given, exactly, and the unit vector; ``name`` is that of the argument."""
    exact = nonzero_vector(given, n, normalize, name)
    vector = to_float(over_largest(exact) if normalize else exact)
    if not normalize:
        _require_unit_length(vector, name)
    return exact, unit(vector)


def point_on_sphere(
    A: tuple[Fraction, ...], q: Any, velocity: Any, normalize: bool, name: str = "q_dot"
) -> ExactState:
    """Return a given point and its velocity of that name, exactly.

    Raises InvalidInput for q = 0 and, where not to be normalized, unless (q,q) = 1 and (q,q̇) = 0
    to the tolerance; InvalidRequest for faults of both.
    """
    faults = Faults()
    point = faults.attempt(nonzero_vector, q, len(A), normalize, "q")
    exact_velocity = faults.attempt(exact_vector, velocity, (name,), len(A))
    faults.require_none()
    if not normalize:
        faults.attempt(_require_unit_length, to_float(point), "q")
        faults.attempt(_require_tangent, to_float(point), to_float(exact_velocity), name)
        faults.require_none()
    return ExactState(A, point, exact_velocity, None)


def nonzero_vector(given: Any, n: int, normalize: bool, name: str) -> tuple[Fraction, ...]:
    """Return a vector of n numbers exactly; raises InvalidInput for zero."""
    exact = exact_vector(given, (name,), n)
    if not any(exact):
        required = "a vector other than zero" if normalize else "a vector of unit length"
        raise InvalidInput((name,), required, "the zero vector")
    return exact


def _require_unit_length(vector: Array, name: str) -> None:
    largest = float(np.max(np.abs(vector)))
    length = float(np.linalg.norm(vector / largest)) * largest
    if not abs(length - 1) <= INPUT_TOLERANCE:
        required = "a vector of unit length to 1e-9 (or normalize=True)"
        raise InvalidInput((name,), required, f"length {length!r}")


def _require_tangent(q: Array, velocity: Array, name: str) -> None:
    """Raise InvalidInput unless the velocity of that name is zero or orthogonal to q."""
    if np.any(velocity):
        slope = float(unit(velocity) @ unit(q))
        if abs(slope) > INPUT_TOLERANCE:
            required = "a vector orthogonal to q to 1e-9 of its length (or normalize=True)"
            raise InvalidInput((name,), required, f"cosine {slope:.3g} with q")
