"""Checks of the parts that some closed-form documents have: an area constant, a ball, its path."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Any

from veselova.mechanics.core.errors import InvalidInput, show

__all__ = ["require_area", "require_ball", "require_numbers", "require_path"]

#: The largest double: a whole number beyond has no value there.
_MOST = sys.float_info.max


def require_area(area: Any, g: int, n: int) -> None:
    """Raise InvalidInput unless the body with an area constant has a series, vectors and
    matrices.
    """
    if not isinstance(area, Mapping):
        raise InvalidInput(("document", "area"), "an object", show(area))
    for name in ("attitude", "inverse", "form"):
        require_numbers(("area", name), area.get(name), (n, n))
    require_numbers(("area", "momentum"), area.get("momentum"), (n,))
    require_numbers(("area", "constant"), area.get("constant"), ())
    require_series(("area", "odd"), area.get("odd"), g)


def require_ball(ball: Any, n: int) -> None:
    """Raise InvalidInput unless a ball in ℝⁿ has its vectors."""
    if not isinstance(ball, Mapping) or "added" not in ball:
        raise InvalidInput(("document", "ball"), "an object with the field added", show(ball))
    for name in ("roots", "momentum"):
        require_numbers(("ball", name), ball.get(name), (n,))
    if ball["added"] is not None:
        require_numbers(("ball", "added"), ball["added"], ())


def require_path(path: Any, g: int, n: int, has_area: bool) -> None:
    """Raise InvalidInput unless the path has numbers and g − 1 series."""
    if not isinstance(path, Mapping) or not isinstance(path.get("transverse"), list):
        raise InvalidInput(("document", "path"), "an object with a list of series", show(path))
    for name in ("radius", "speed"):
        require_numbers(("path", name), path.get(name), ())
    require_numbers(("path", "position"), path.get("position"), (n - 1,))
    if len(path["transverse"]) != g - 1:
        required = f"a list of {g - 1} series"
        raise InvalidInput(("document", "path", "transverse"), required, show(path["transverse"]))
    for k, series in enumerate(path["transverse"]):
        require_series(("path", "transverse", k), series, g)
    if has_area:
        require_numbers(("path", "odd"), path.get("odd"), ())
        require_numbers(("path", "plane"), path.get("plane"), (g, n - 1))


def require_series(where: tuple[str | int, ...], series: Any, g: int) -> None:
    """Raise InvalidInput unless a function of period 2 has modes, coefficients and a turn."""
    if not isinstance(series, Mapping) or not isinstance(series.get("modes"), list):
        raise InvalidInput(("document", *where), "an object with modes", show(series))
    count = len(series["modes"])
    require_numbers((*where, "modes"), series["modes"], (count, g))
    require_numbers((*where, "coefficients"), series.get("coefficients"), (count,))
    require_numbers((*where, "turn"), series.get("turn"), ())


def require_numbers(path: tuple[str | int, ...], value: Any, shape: tuple[int, ...]) -> None:
    """Raise InvalidInput unless the value is nested lists of this shape with finite numbers."""
    if shape:
        if not isinstance(value, list) or len(value) != shape[0]:
            raise InvalidInput(("document", *path), f"a list of length {shape[0]}", show(value))
        for i, item in enumerate(value):
            require_numbers((*path, i), item, shape[1:])
        return
    if not isinstance(value, (int, float)) or isinstance(value, bool) or not abs(value) <= _MOST:
        raise InvalidInput(("document", *path), "a finite number", show(value))
