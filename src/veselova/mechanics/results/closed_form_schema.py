"""What a closed-form document must hold: its JSON schema, ``closed_form_schema.json``, and the
reader of documents by it.

The schema states the length of arrays by the keyword ``x-length``: g, n, their neighbours, the
number of modes, or ``pair`` for [index of a characteristic, constant].
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from veselova.mechanics.core.arguments import FEWEST_DIGITS
from veselova.mechanics.core.errors import InvalidInput, show

__all__ = ["AREA_FORMAT", "FORMAT", "SCHEMA", "SHELL_FORMAT", "read_document"]

#: The name and version of the format; another number is another set of fields.
FORMAT = "veselova.closed-form/1"

#: That of documents with the field ``area``, without which an evaluator gives another motion.
AREA_FORMAT = "veselova.closed-form/2"

#: That of documents with the field ``shell``, whose attitude has a field of its own.
SHELL_FORMAT = "veselova.closed-form/3"

SCHEMA: dict[str, Any] = json.loads(Path(__file__).with_suffix(".json").read_text("utf-8"))

#: The matrix may be off its transpose by this part of its largest entry.
_SYMMETRY = 1e-12

Place = tuple[str | int, ...]


def read_document(document: Any) -> dict[str, Any]:
    """Return the fields of a document by name, lists of numbers as arrays of doubles in the shapes
    of the schema. Raises InvalidInput, located below ``document``, for what is none of the format.
    """
    _require(isinstance(document, Mapping), (), f"a JSON object of the format {FORMAT}", document)
    form = AREA_FORMAT if "area" in document else FORMAT
    form = SHELL_FORMAT if "shell" in document else form
    _require(document.get("format") == form, ("format",), form, document.get("format"))
    digits = document.get("digits", FEWEST_DIGITS)
    required = f"{FEWEST_DIGITS}; more digits at given times come from solve(…, digits=)"
    _require(digits == FEWEST_DIGITS, ("digits",), required, digits)
    g = document["genus"] if isinstance(document.get("genus"), int) else 0
    n = len(document["A"]) if isinstance(document.get("A"), list) else 0
    lengths = {"g - 1": g - 1, "g": g, "g + 1": g + 1, "n - 1": n - 1, "n": n, "pair": 2}
    found: dict[str, Any] = _read(document, SCHEMA, (), lengths)
    for name in ("odd", "plane"):
        holds = "area" not in found or name in found.get("path", {name: None})
        _require(holds, ("path", name), "this field", None)
    if "shell" in found:
        _require(found["axes"] is not None, ("axes",), "the axes of a shell as columns", None)
    _require_indices(found)
    _require_matrices(found)
    return found


def _require(holds: Any, place: Place, required: str, given: Any) -> None:
    if not holds:
        raise InvalidInput(("document", *place), required, show(given))


def _read(value: Any, schema: Mapping[str, Any], place: Place, lengths: Mapping[str, int]) -> Any:
    """Return a value of the schema; raises InvalidInput with its place."""
    if "anyOf" in schema:
        return None if value is None else _read(value, schema["anyOf"][0], place, lengths)
    kind = schema["type"]
    if kind == "string":
        known = isinstance(value, str) and value in schema.get("enum", [value])
        _require(known, place, f"a text: {schema.get('enum', 'any')}", value)
        return value
    if kind == "object":
        return _read_object(value, schema, place, lengths)
    if kind == "array" and schema["items"]["type"] == "object":
        count = lengths[schema["x-length"]]
        given = value if isinstance(value, list) else ()
        _require(given is value and len(given) == count, place, f"a list of {count}", value)
        return [_read(x, schema["items"], (*place, i), lengths) for i, x in enumerate(given)]
    return _read_numbers(value, schema, place, lengths)


def _read_object(
    value: Any, schema: Mapping[str, Any], place: Place, lengths: Mapping[str, int]
) -> dict[str, Any]:
    _require(isinstance(value, Mapping), place, "an object", value)
    for name in schema.get("required", ()):
        _require(name in value, (*place, name), "this field", None)
    if isinstance(modes := value.get("modes"), list):
        lengths = {**lengths, "modes": len(modes)}
    schemas = {name: schema.get("additionalProperties") for name in value}
    schemas |= {name: x for name, x in schema.get("properties", {}).items() if name in value}
    return {
        name: value[name] if inner is None else _read(value[name], inner, (*place, name), lengths)
        for name, inner in schemas.items()
    }


def _read_numbers(
    value: Any, schema: Mapping[str, Any], place: Place, lengths: Mapping[str, int]
) -> Any:
    """Return a number, or an array of doubles."""
    try:
        found = np.array("" if bool in map(type, np.array(value, object).flat) else value)
    except ValueError:  # rows of different lengths
        found = np.array("")
    count, shape = len(np.atleast_1d(found)), []
    while schema["type"] == "array":
        shape.append(lengths.get(schema.get("x-length", ""), schema.get("maxItems", count)))
        _require(shape[-1] >= schema.get("minItems", 0), place, "a list of numbers", value)
        schema = schema["items"]
    if found.size == prod(shape) == 0:
        found = found.reshape(shape)
    kinds = "iu" if schema["type"] == "integer" and found.size else "iuf"
    numeric = found.dtype.kind in kinds and found.shape == tuple(shape)
    least, most = schema.get("minimum", -np.inf), schema.get("maximum", np.inf)
    required = f"{schema['type']}s of shape {tuple(shape)}, finite, from {least} to {most}"
    _require(numeric and np.isfinite(found).all(), place, required, value)
    _require(np.all((found >= least) & (found <= most)), place, required, value)
    above = schema.get("exclusiveMinimum", -np.inf)
    _require(np.all(found > above), place, f"numbers greater than {above}", value)
    if step := schema.get("multipleOf"):
        _require(np.all(found % step == 0), place, f"multiples of {step}", value)
    if known := schema.get("enum"):
        _require(np.isin(found, known).all(), place, f"one of {known}", value)
    return found.astype(np.float64) if shape else found.item()


def _require_indices(found: Mapping[str, Any]) -> None:
    """Raise InvalidInput unless all pairs, and the rate, have characteristics of the document."""
    indices = {name: found[name][..., 0] for name in ("q", "q_prime", "normals", "gamma")}
    indices["rate"] = found["rate"]["characteristic"]
    functions = len(found["characteristics"])
    for name, given in indices.items():
        known = np.isin(given, np.arange(functions)).all()
        _require(known, (name,), f"indices of characteristics below {functions}", given)
    if "shell" in found:
        entries, given = (found["genus"] + 1) ** 2, found["shell"]["columns"]
        _require(np.all(given < entries), ("shell", "columns"), f"indices below {entries}", given)


def _require_matrices(found: Mapping[str, Any]) -> None:
    """Raise InvalidInput unless T is symmetric and positive definite, and the reduction a
    unimodular basis with some of its rows.
    """
    T = found["riemann_matrix"]
    defect, least = float(np.max(np.abs(T - T.T))), float(np.linalg.eigvalsh(T)[0])
    if defect > _SYMMETRY * np.max(np.abs(T)) or not least > 0:
        required = "a symmetric, positive definite matrix"
        given = f"least eigenvalue {least:.3g}, off its transpose by {defect:.3g}"
        raise InvalidInput(("document", "riemann_matrix"), required, given)
    if (reduction := found["reduction"]) is not None:
        basis, waves = reduction["basis"], reduction["waves"].tolist()
        unimodular = abs(abs(np.linalg.det(basis)) - 1) <= 1e-6
        _require(unimodular, ("reduction", "basis"), "integers with determinant 1 or −1", basis)
        some = len(set(waves)) == len(waves) and set(waves) <= set(range(len(T)))
        required = f"different whole numbers from 0 to {len(T) - 1}"
        _require(some, ("reduction", "waves"), required, waves)
