"""What a closed-form document must hold: its JSON schema, ``closed_form_schema.json``, and the
check of documents by it.

The schema states the length of arrays by the keyword ``x-length``: g, n, their neighbours, the
number of modes, or ``pair`` for [index of a characteristic, constant].
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from veselova.mechanics.core.decimals import FEWEST_DIGITS
from veselova.mechanics.core.errors import InvalidInput, show

__all__ = ["AREA_FORMAT", "FORMAT", "SCHEMA", "require_document"]

#: The name and version of the format; another number is another set of fields.
FORMAT = "veselova.closed-form/1"

#: That of documents with the field ``area``, without which an evaluator gives another motion.
AREA_FORMAT = "veselova.closed-form/2"

SCHEMA: dict[str, Any] = json.loads(Path(__file__).with_suffix(".json").read_text("utf-8"))

#: The matrix may be off its transpose by this part of its largest entry.
_SYMMETRY = 1e-12

#: JSON's types as Python has them; truth values are no numbers.
_TYPES: Mapping[str, tuple[type, ...]] = {
    "object": (dict,),
    "array": (list,),
    "string": (str,),
    "integer": (int,),
    "number": (int, float),
    "null": (type(None),),
}

#: What a fault calls them.
_NAMES: Mapping[str, str] = {
    "object": "an object",
    "array": "a list",
    "string": "a text",
    "integer": "a whole number",
    "number": "a finite number",
    "null": "null",
}

Place = tuple[str | int, ...]


def require_document(document: Any) -> None:
    """Raise InvalidInput unless the value has every field of the format with numbers of the right
    shapes.
    """
    if not isinstance(document, Mapping):
        raise InvalidInput(("document",), "a JSON object of the format " + FORMAT, show(document))
    form = AREA_FORMAT if "area" in document else FORMAT
    if document.get("format") != form:
        raise InvalidInput(("document", "format"), form, show(document.get("format")))
    if document.get("digits", FEWEST_DIGITS) != FEWEST_DIGITS:
        required = f"{FEWEST_DIGITS}; more digits at given times come from solve(…, digits=)"
        raise InvalidInput(("document", "digits"), required, show(document["digits"]))
    g, n, functions = document.get("genus"), *_counts(document, "A", "characteristics")
    _require(document, SCHEMA, ("document",), _lengths(g, n), functions)
    _require_matrices(document)
    places = [("path", name) for name in ("odd", "plane") if "area" in document]
    for where, name in places:
        if where in document and name not in document[where]:
            raise InvalidInput(("document", where, name), "this field", "nothing")


def _counts(document: Mapping[str, Any], *names: str) -> list[int]:
    return [len(x) if isinstance(x := document.get(name), list) else 0 for name in names]


def _lengths(g: Any, n: int) -> dict[str, int]:
    """Return the lengths that the schema names; g is not checked yet."""
    genus = g if isinstance(g, int) else 0
    return {"g - 1": genus - 1, "g": genus, "g + 1": genus + 1, "n - 1": n - 1, "n": n, "pair": 2}


def _require(
    value: Any, schema: Mapping[str, Any], path: Place, lengths: Mapping[str, int], functions: int
) -> None:
    """Raise InvalidInput, with its place, unless a value is of the schema."""
    if "anyOf" in schema:
        if value is None:
            return
        schema = schema["anyOf"][0]
    _require_scalar(value, schema, path)
    if isinstance(value, Mapping):
        for name in schema.get("required", ()):
            if name not in value:
                raise InvalidInput((*path, name), "this field", "nothing")
        known = schema.get("properties", {})
        lengths = {**lengths, "modes": _counts(value, "modes")[0]}
        for name, entry in value.items():
            inner = known.get(name, schema.get("additionalProperties", {}))
            _require(entry, inner, (*path, name), lengths, functions)
    elif isinstance(value, list) and "items" in schema:
        size = schema.get("x-length")
        least, most = schema.get("minItems", 0), schema.get("maxItems", len(value))
        if size is not None:
            least = most = lengths[size]
        if not least <= len(value) <= most:
            raise InvalidInput(path, f"a list of length {least}", show(value))
        for i, entry in enumerate(value):
            _require(entry, schema["items"], (*path, i), lengths, functions)
        if size == "pair":
            _require_index(value[0], functions, (*path, 0))
    if path[-1] == "characteristic":
        _require_index(value, functions, path)


def _require_scalar(value: Any, schema: Mapping[str, Any], path: Place) -> None:
    """Raise InvalidInput unless a value has the type of the schema and is within its bounds."""
    kind = schema.get("type")
    if kind is None:
        return
    known = isinstance(value, _TYPES[kind]) and not isinstance(value, bool)
    if not known or (kind == "number" and not abs(value) <= sys.float_info.max):
        raise InvalidInput(path, _NAMES[kind], show(value))
    if "enum" in schema and value not in schema["enum"]:
        raise InvalidInput(path, f"one of {', '.join(map(str, schema['enum']))}", show(value))
    if value is not None and kind in ("number", "integer"):
        least = schema.get("minimum", schema.get("exclusiveMinimum", -np.inf))
        if not value >= least or value == schema.get("exclusiveMinimum"):
            raise InvalidInput(path, f"a number of at least {least}, or greater", show(value))


def _require_index(value: Any, functions: int, path: Place) -> None:
    if not isinstance(value, int) or not 0 <= value < functions:
        raise InvalidInput(path, f"an index below {functions}", show(value))


def _require_matrices(document: Mapping[str, Any]) -> None:
    """Raise InvalidInput unless T is symmetric and positive definite, and the reduction a
    unimodular basis with some of its rows.
    """
    T = np.array(document["riemann_matrix"], dtype=float)
    defect = float(np.max(np.abs(T - T.T)))
    least = float(np.linalg.eigvalsh(T)[0])
    if defect > _SYMMETRY * np.max(np.abs(T)) or not least > 0:
        required = "a symmetric, positive definite matrix"
        given = f"least eigenvalue {least:.3g}, off its transpose by {defect:.3g}"
        raise InvalidInput(("document", "riemann_matrix"), required, given)
    if document["reduction"] is None:
        return
    basis, waves = (document["reduction"][name] for name in ("basis", "waves"))
    if abs(abs(np.linalg.det(np.array(basis, dtype=float))) - 1) > 1e-6:
        required = "whole numbers with determinant 1 or −1"
        raise InvalidInput(("document", "reduction", "basis"), required, show(basis))
    if len(set(waves)) < len(waves) or not all(i < len(T) for i in waves):
        required = f"different whole numbers from 0 to {len(T) - 1}"
        raise InvalidInput(("document", "reduction", "waves"), required, show(waves))
