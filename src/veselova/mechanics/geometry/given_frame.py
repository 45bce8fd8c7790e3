"""A frame [e_1 … e_n] as given: admitted to rounding, or made orthonormal where that
was asked for.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.enclosures import enclose, precision, rational
from veselova.mechanics.core.errors import InvalidInput
from veselova.mechanics.core.exact_input import exact_matrix, to_float
from veselova.mechanics.geometry.natural_frame import orthonormalize
from veselova.mechanics.geometry.sphere import INPUT_TOLERANCE, over_largest, unit
from veselova.mechanics.geometry.symmetric_axes import orthonormal

__all__ = ["ExactFrame", "admissible_frame", "read_frame"]

Array = NDArray[np.float64]
ExactFrame = tuple[tuple[Fraction, ...], ...]

#: Bits of a mended frame: beyond all digits that can be asked for, and, in
#: dimensions without digits, beyond doubles.
_ALL_BITS = 4096
_DOUBLE_BITS = 320

#: The largest dimension with digits.
_WITH_DIGITS = 8

#: A least singular value of columns of size one that are dependent.
_DEPENDENT = 1e-12


def read_frame(
    frame: Any, point: tuple[Fraction, ...] | None, n: int, normalize: bool, name: str = "q"
) -> ExactFrame | None:
    """Return the columns of a frame exactly, row by row; None for None. ``point`` is q, of any
    length, None where it is unreadable; ``name`` is its name.

    As given, where it is orthogonal with e_1 = q/|q| to 1e-9. With ``normalize`` any other is
    mended: e_1 becomes q/|q|, and e_2 … e_n are made orthonormal in turn, each against those before
    it. The sign of the determinant is kept, by reversing e_n where the new e_1 would change it.
    Raises InvalidInput unless the columns are independent, with q in place of e_1 as well.
    """
    if frame is None:
        return None
    exact = exact_matrix(frame, ("frame",), n)
    if point is None:
        return exact
    try:
        _require_admissible(to_float(exact), unit(to_float(over_largest(point))), name)
    except InvalidInput:
        if not normalize:
            raise
        return _mend(exact, point, name)
    return exact


def admissible_frame(frame: Array, q: Array) -> Array:
    """Return a nearly orthogonal frame, first column nearly q, made so to rounding."""
    rest = frame[:, 1:] - np.outer(q, q @ frame[:, 1:])
    return orthonormalize(np.column_stack([q, rest]))


def _require_admissible(frame: Array, q: Array, name: str) -> None:
    """Raise InvalidInput unless the frame is orthogonal with first column q, both to
    the tolerance.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        defect = float(np.max(np.abs(frame.T @ frame - np.eye(q.size))))
    if not defect <= INPUT_TOLERANCE:
        required = "an orthogonal matrix to 1e-9 (or normalize=True)"
        raise InvalidInput(("frame",), required, f"one with |EᵀE − 1| up to {defect:.3g}")
    offset = float(np.max(np.abs(frame[:, 0] - q)))
    if offset > INPUT_TOLERANCE:
        required = f"first column e_1 equal to {name} to 1e-9 (or normalize=True)"
        raise InvalidInput(("frame",), required, f"a difference of {offset:.3g}")


def _mend(frame: ExactFrame, q: tuple[Fraction, ...], name: str) -> ExactFrame:
    """Return q/|q| and the other columns after Gram–Schmidt."""
    columns = list(zip(*frame, strict=True))
    # columns over their largest entries, so that the determinants are floats
    before, mended = (
        np.column_stack([to_float(over_largest(x)) if any(x) else np.zeros(len(x)) for x in given])
        for given in (columns, [q, *columns[1:]])
    )
    for matrix, what in ((before, "each other"), (mended, name)):
        if np.linalg.svd(matrix, compute_uv=False)[-1] <= _DEPENDENT:
            required = f"columns independent of {what}"
            raise InvalidInput(("frame",), required, "a column in the span of others")
    with precision(_ALL_BITS if len(q) <= _WITH_DIGITS else _DOUBLE_BITS):
        vectors = enclose(np.array([q, *columns[1:]], dtype=object))
        exact = [tuple(map(rational, column)) for column in orthonormal(vectors)]
    if np.linalg.det(before) * np.linalg.det(mended) < 0:
        exact[-1] = tuple(-x for x in exact[-1])
    return tuple(zip(*exact, strict=True))
