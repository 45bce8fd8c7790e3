"""Complex numbers in JSON: a real number, or a pair [real, imaginary]."""

from __future__ import annotations

from typing import Any

from veselova.mechanics.core.complex_input import complex_number
from veselova.mechanics.core.errors import InvalidInput


def from_pairs(value: Any, depth: int) -> Any:
    """Return nested lists whose entries, ``depth`` levels inside, were numbers or pairs.

    Other values stay as they are: the caller knows what is required there.
    """
    if depth and isinstance(value, list):
        return [from_pairs(item, depth - 1) for item in value]
    if depth or not isinstance(value, list) or len(value) != 2:
        return value
    try:
        real, imaginary = (complex_number(part, ()) for part in value)
    except InvalidInput:
        return value
    return complex(real.real, imaginary.real) if imaginary.real else value[0]
