"""The modes of a series in a closed-form document: runs of neighbours, and coefficients written to
the digits that count.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from decimal import Context, Decimal
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.errors import InvalidInput, show

__all__ = ["coefficients_of", "modes_of", "pack_modes", "require_modes"]

#: Digits of products by powers of ten: those of a double, written out, and of any document.
_EXACT = Context(prec=2000)

#: Entries of modes that a sum in doubles can hold.
_LARGEST = 2**31


def pack_modes(modes: Any, coefficients: Any, steps: Any, stride: int = 1) -> dict[str, Any]:
    """Return the fields ``modes``, ``coefficients`` and ``scale`` of a document for modes (M, g).

    A row [m_1, …, m_g, count] stands for modes whose last entries are m_g, m_g + stride, ….
    Coefficients are F·scale in this order. Each F is off by half of its step (M,) at most. F are
    doubles or Decimals; of these all numbers become texts.
    """
    order = np.lexsort(modes.T[::-1])
    modes = modes[order]
    along = np.zeros(modes.shape[1], dtype=np.int64)
    along[-1] = stride
    apart = np.any(np.diff(modes, axis=0) != along, axis=1)
    first = np.flatnonzero(np.concatenate([np.ones(min(1, len(modes)), dtype=bool), apart]))
    counts = np.diff(np.append(first, len(modes)))
    least = np.maximum(np.asarray(steps, dtype=float)[order], np.finfo(float).tiny)
    finest = [-math.floor(math.log10(step)) for step in least]
    power = int(np.clip(np.median(finest or [0]), -300, 300))
    texts = [
        format(_EXACT.scaleb(Decimal(coefficients[k]), power), f"z.{max(0, places - power)}f")
        for k, places in zip(order.tolist(), finest, strict=True)
    ]
    in_texts = len(texts) > 0 and isinstance(coefficients[0], Decimal)
    numbers = texts if in_texts else [float(x) if "." in x else int(x) for x in texts]
    return {
        "modes": np.column_stack([modes[first], counts]).tolist(),
        "coefficients": numbers,
        "scale": f"1e{power}" if in_texts else float(f"1e{power}"),
    }


def modes_of(series: Mapping[str, Any], genus: int, stride: int = 1) -> NDArray[np.int64]:
    """Return the modes (M, g) of a series; a row without a count, as in formats 1 and 2, is one."""
    if not series["modes"]:
        return np.empty((0, genus), dtype=np.int64)
    rows = np.array([[*row, 1][: genus + 1] for row in series["modes"]], dtype=np.int64)
    counts = rows[:, genus]
    modes = np.repeat(rows[:, :genus], counts, axis=0)
    places = np.arange(len(modes)) - np.repeat(np.cumsum(counts) - counts, counts)
    modes[:, -1] += stride * places
    return modes


def coefficients_of(series: Mapping[str, Any]) -> NDArray[np.float64]:
    """Return F_m (M,) of a series in double precision; formats 1 and 2 have no scale."""
    return np.array(series["coefficients"], dtype=np.float64) / float(series.get("scale", 1))


def require_modes(path: tuple[str | int, ...], rows: Any, genus: int, count: int) -> None:
    """Raise InvalidInput unless the rows stand for as many modes as there are coefficients."""
    if not isinstance(rows, list):
        raise InvalidInput(("document", *path), "a list of rows [m_1, …, m_g, count]", show(rows))
    total = 0
    for i, row in enumerate(rows):
        whole = isinstance(row, list) and all(type(m) is int and abs(m) < _LARGEST for m in row)
        if not whole or not genus <= len(row) <= genus + 1 or [*row, 1][genus] < 1:
            required = f"{genus} whole numbers and a count"
            raise InvalidInput(("document", *path, i), required, show(row))
        total += [*row, 1][genus]
    if total != count:
        raise InvalidInput(("document", *path), f"rows of {count} modes", f"rows of {total}")
