"""Complex numbers as given, one or nested in lists, with every fault named by its place."""

from __future__ import annotations

import cmath
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.arguments import as_given
from veselova.mechanics.core.errors import Faults, InvalidInput, show
from veselova.mechanics.core.exact_input import exact_number

__all__ = ["complex_array", "complex_number"]

Complex = NDArray[np.complex128]

Path = tuple[str | int, ...]

#: Lists are not looked into any deeper: no argument has as many axes.
_DEEPEST = 4


def complex_number(value: Any, path: Path) -> complex:
    """Return a number in double precision; texts ("0.7", "7/10") are rounded once.

    Raises InvalidInput for anything that is not a finite number.
    """
    if isinstance(value, np.generic):
        value = value.item()
    if type(value) is complex:
        if cmath.isfinite(value):
            return value
        raise InvalidInput(path, "a finite number", show(value))
    return complex(float(exact_number(value, path)))


def complex_array(value: Any, path: Path, required: str) -> Complex:
    """Return nested lists of numbers, or an array, as a complex array of any shape.

    Raises InvalidInput, with all faults, where an entry is no finite number, or with what is
    ``required`` where the lists are ragged.
    """
    value = as_given(value)
    numbers = isinstance(value, np.ndarray) and value.dtype.kind in "iufc"
    if numbers and not np.ma.is_masked(value) and np.all(np.isfinite(value)):
        return np.array(value, dtype=complex, subok=False)
    faults = Faults()
    entries = _entries(value, path, faults, _DEEPEST)
    faults.require_none()
    try:
        return np.array(entries, dtype=complex)
    except (TypeError, ValueError):
        raise InvalidInput(path, required, f"lists of different lengths: {show(value)}") from None


def _entries(value: Any, path: Path, faults: Faults, depth: int) -> Any:
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, Sequence) and not isinstance(value, (str, bytes)) and depth:
        return [_entries(item, (*path, i), faults, depth - 1) for i, item in enumerate(value)]
    return faults.attempt(complex_number, value, path)
