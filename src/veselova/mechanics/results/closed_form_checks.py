"""Checks of a closed-form document, which say what is missing or wrong before it is evaluated."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from veselova.mechanics.core.errors import InvalidInput, show
from veselova.mechanics.core.exact_input import whole_number
from veselova.mechanics.results.closed_form_schema import (
    CLOSED_FORM_FIELDS,
    FORMAT,
    MOST_CLOSED_FORM_DIGITS,
)

__all__ = ["require_document"]

#: Largest genus of a document, entries and eigenvalues of T or its inverse, modes, and relative
#: difference of entries of T that are one number: beyond what any motion has, and before sums grow
#: beyond the memory.
_LARGEST_GENUS = 32
_LARGEST_PERIOD = 1e6
_LARGEST_MODE = 10**6
_ASYMMETRY = 1e-9


def require_document(document: Any) -> None:
    """Raise InvalidInput unless the value has every field of the format with numbers of the right
    shapes.
    """
    if not isinstance(document, Mapping):
        raise InvalidInput(("document",), "a JSON object of the format " + FORMAT, show(document))
    if document.get("format") != FORMAT:
        raise InvalidInput(("document", "format"), FORMAT, show(document.get("format")))
    missing = [name for name in CLOSED_FORM_FIELDS if name not in document]
    if missing:
        raise InvalidInput(
            ("document",),
            f"the fields {', '.join(missing)} too",
            f"only {', '.join(map(str, document))}"[:200],
        )
    problem = document["problem"]
    if not isinstance(problem, Mapping) or not isinstance(problem.get("system"), str):
        required = "an object with the field system"
        raise InvalidInput(("document", "problem"), required, show(problem))
    time = document["time"]
    if not isinstance(time, str) or time not in ("t", "s", "tau1"):
        raise InvalidInput(("document", "time"), "t, s or tau1", show(time))
    if not isinstance(document["version"], str):
        raise InvalidInput(("document", "version"), "a text", show(document["version"]))
    whole_number(document["digits"], ("document", "digits"), 15, MOST_CLOSED_FORM_DIGITS)
    g = whole_number(document["genus"], ("document", "genus"), 1, _LARGEST_GENUS)
    _require_shapes(document, g)
    _require_ranges(document)


def _require_shapes(document: Mapping[str, Any], g: int) -> None:
    """Raise InvalidInput where an array has another shape than n, g and the number of modes say."""
    n = _length(document, "A", None)
    count = _length(document, "modes", None)
    functions = _length(document, "characteristics", None)
    shapes: dict[str, tuple[int, ...]] = {
        "riemann_matrix": (g, g),
        "phases": (g,),
        "frequencies": (g,),
        "rotation": (g, n - 1),
        "directions": (n, g + 1),
        "frozen": (n, n - 1),
        "A": (n,),
        "coefficients": (count,),
        "characteristics": (functions, 2, g),
        "modes": (count, g),
    }
    for name, shape in shapes.items():
        _require_numbers((name,), document[name], shape)
    _require_numbers(("mean_rate",), document["mean_rate"], ())
    if document["axes"] is not None:
        _require_numbers(("axes",), document["axes"], (n, n))
    if "path" in document:
        _require_path(document["path"], g, n)
    _require_matrix(document["riemann_matrix"])
    if document["reduction"] is not None:
        _require_reduction(document["reduction"], g)
    for name, length in (("q", g + 1), ("q_prime", g), ("gamma", g + 1)):
        _require_pairs((name,), document[name], length, functions)
    if _length(document, "normals", g - 1):
        for k, column in enumerate(document["normals"]):
            _require_pairs(("normals", k), column, g + 1, functions)
    for name, keys in (
        ("rate", ("characteristic", "constant", "power")),
        ("error", ("at_start", "per_unit_time")),
    ):
        for key in keys:
            inner = document[name]
            _require_numbers(
                (name, key), inner.get(key) if isinstance(inner, Mapping) else None, ()
            )
    place = document["rate"]["characteristic"]
    if not _is_whole(place) or not 0 <= place < functions:
        raise InvalidInput(
            ("document", "rate", "characteristic"), f"an index below {functions}", show(place)
        )


def _require_path(path: Any, g: int, n: int) -> None:
    """Raise InvalidInput unless the path has numbers and g − 1 series."""
    if not isinstance(path, Mapping) or not isinstance(path.get("transverse"), list):
        raise InvalidInput(("document", "path"), "an object with a list of series", show(path))
    for name in ("radius", "speed"):
        _require_numbers(("path", name), path.get(name), ())
    _require_numbers(("path", "position"), path.get("position"), (n - 1,))
    if len(path["transverse"]) != g - 1:
        required = f"a list of {g - 1} series"
        raise InvalidInput(("document", "path", "transverse"), required, show(path["transverse"]))
    for k, series in enumerate(path["transverse"]):
        where = ("path", "transverse", k)
        if not isinstance(series, Mapping) or not isinstance(series.get("modes"), list):
            raise InvalidInput(("document", *where), "an object with modes", show(series))
        count = len(series["modes"])
        _require_numbers((*where, "modes"), series["modes"], (count, g))
        _require_numbers((*where, "coefficients"), series.get("coefficients"), (count,))
        _require_numbers((*where, "turn"), series.get("turn"), ())


def _require_reduction(reduction: Any, g: int) -> None:
    """Raise InvalidInput unless the basis is a matrix of whole numbers of determinant ±1 and the
    waves are some of its rows.
    """
    basis = reduction.get("basis") if isinstance(reduction, Mapping) else None
    _require_numbers(("reduction", "basis"), basis, (g, g))
    matrix = np.array(basis, dtype=float)
    if (
        np.any(np.abs(matrix) > _LARGEST_MODE)
        or np.any(matrix != np.rint(matrix))
        or abs(abs(np.linalg.det(matrix)) - 1) > 1e-6
    ):
        raise InvalidInput(
            ("document", "reduction", "basis"),
            "whole numbers with determinant 1 or −1",
            show(basis),
        )
    waves = reduction.get("waves")
    if (
        not isinstance(waves, list)
        or not all(_is_whole(i) and 0 <= i < g for i in waves)
        or len(set(waves)) < len(waves)
    ):
        raise InvalidInput(
            ("document", "reduction", "waves"),
            f"different whole numbers from 0 to {g - 1}",
            show(waves),
        )


def _length(document: Mapping[str, Any], name: str, wanted: int | None) -> int:
    value = document[name]
    if not isinstance(value, list) or (wanted is not None and len(value) != wanted):
        raise InvalidInput(
            ("document", name),
            "a list" + (f" of length {wanted}" if wanted is not None else ""),
            show(value),
        )
    return len(value)


def _require_pairs(path: tuple[str | int, ...], value: Any, length: int, functions: int) -> None:
    if not isinstance(value, list) or len(value) != length:
        raise InvalidInput(
            ("document", *path), f"a list of {length} pairs [index, constant]", show(value)
        )
    for i, pair in enumerate(value):
        if (
            not isinstance(pair, list)
            or len(pair) != 2
            or not _is_whole(pair[0])
            or not 0 <= pair[0] < functions
        ):
            raise InvalidInput(
                ("document", *path, i), f"a pair [index below {functions}, constant]", show(pair)
            )
        _require_numbers((*path, i, 1), pair[1], ())


def _require_numbers(path: tuple[str | int, ...], value: Any, shape: tuple[int, ...]) -> None:
    """Raise InvalidInput unless the value is nested lists of this shape with finite numbers, or
    strings of them.
    """
    if shape:
        if not isinstance(value, list) or len(value) != shape[0]:
            raise InvalidInput(("document", *path), f"a list of length {shape[0]}", show(value))
        for i, item in enumerate(value):
            _require_numbers((*path, i), item, shape[1:])
        return
    try:
        number = (
            float(value)
            if isinstance(value, (int, float, str)) and not isinstance(value, bool)
            else float("nan")
        )
    except (ValueError, OverflowError):
        number = float("nan")
    if not abs(number) < float("inf"):
        raise InvalidInput(("document", *path), "a finite number, or a string of one", show(value))


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _require_matrix(given: Any) -> None:
    """Raise InvalidInput unless T is symmetric with eigenvalues of 1e-6 to 1e6."""
    path = ("document", "riemann_matrix")
    T = np.array(given, dtype=float)
    if not np.max(np.abs(T)) <= _LARGEST_PERIOD:
        raise InvalidInput(path, f"entries of at most {_LARGEST_PERIOD:g}", "a larger one")
    if not np.max(np.abs(T - T.T)) <= _ASYMMETRY * np.max(np.abs(T)):
        raise InvalidInput(path, "a symmetric matrix", show(given))
    least = float(np.linalg.eigvalsh(T)[0])
    if not least >= 1 / _LARGEST_PERIOD:
        required = f"a positive definite matrix, eigenvalues of at least {1 / _LARGEST_PERIOD:g}"
        raise InvalidInput(path, required, f"least eigenvalue {least:.3g}")


def _require_ranges(document: Mapping[str, Any]) -> None:
    """Raise InvalidInput where a number has no meaning: characteristics other than 0 and ½, modes
    that are not whole or do not move, and constants that must be positive.
    """
    for i, characteristic in enumerate(document["characteristics"]):
        for j, row in enumerate(characteristic):
            if any(float(x) not in (0, 0.5) for x in row):
                raise InvalidInput(
                    ("document", "characteristics", i, j), "numbers 0 or 0.5", show(row)
                )
    _require_modes(("modes",), document["modes"], document)
    for k, series in enumerate(document["path"]["transverse"] if "path" in document else ()):
        _require_modes(("path", "transverse", k, "modes"), series["modes"], document)
    positive: dict[tuple[str | int, ...], Any] = {("mean_rate",): document["mean_rate"]}
    positive[("rate", "constant")] = document["rate"]["constant"]
    positive |= {("A", i): value for i, value in enumerate(document["A"])}
    for path, value in positive.items():
        if not float(value) > 0:
            raise InvalidInput(("document", *path), "a number above 0", show(value))
    for name in ("at_start", "per_unit_time"):
        if not float(document["error"][name]) >= 0:
            required = "a number of at least 0"
            raise InvalidInput(("document", "error", name), required, show(document["error"][name]))
    power = document["rate"]["power"]
    if not _is_whole(power) or power not in (-2, 0, 1):
        raise InvalidInput(("document", "rate", "power"), "-2, 0 or 1", show(power))


def _require_modes(path: tuple[str | int, ...], modes: Any, document: Mapping[str, Any]) -> None:
    """Raise InvalidInput unless modes are whole numbers m with m·f other than 0."""
    for i, mode in enumerate(modes):
        if not all(_is_whole(m) and abs(m) <= _LARGEST_MODE for m in mode):
            required = f"whole numbers from −{_LARGEST_MODE} to {_LARGEST_MODE}"
            raise InvalidInput(("document", *path, i), required, show(mode))
    frequencies = np.array(document["frequencies"], dtype=float)
    resting = np.flatnonzero(
        np.array(modes, dtype=float).reshape(-1, len(frequencies)) @ frequencies == 0
    )
    if resting.size:
        i = int(resting[0])
        required = "a mode m with m·frequencies other than 0"
        raise InvalidInput(("document", *path, i), required, show(modes[i]))
