"""How far motions are apart, and whether their errors allow that."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

__all__ = ["agree", "apart", "largest"]


def largest(values: Any) -> float:
    """Return the largest size of any number."""
    return float(np.max(np.abs(values)))


def apart(one: Any, other: Any, names: Iterable[str]) -> Any:
    """Return the largest difference of series at each time, (N,), of anything that has them as
    attributes.
    """
    gaps = [np.abs(getattr(one, name) - getattr(other, name)) for name in names]
    return np.max([gap.reshape(len(gap), -1).max(axis=1) for gap in gaps], axis=0)


def agree(one: Any, other: Any, *names: str, room: float = 0.0) -> None:
    """Hold motions to one another within both their errors: in series by name, by default in all
    bounded ones of the first.
    """
    off, allowed = apart(one, other, names or one.problem.bounded), one.error + other.error
    assert np.all(off <= allowed + room), (off, allowed)
