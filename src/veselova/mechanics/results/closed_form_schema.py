"""What a closed-form document must hold, as a JSON schema and as checks that say what
is missing.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from veselova.mechanics.core.decimals import FEWEST_DIGITS
from veselova.mechanics.core.errors import InvalidInput, show
from veselova.mechanics.core.exact_input import positive_number
from veselova.mechanics.core.names import require_name
from veselova.mechanics.results.closed_form_parts import (
    require_area,
    require_ball,
    require_numbers,
    require_path,
)

__all__ = ["AREA_FORMAT", "FORMAT", "SCHEMA", "require_document"]

#: The name and version of the format; another number is another set of fields.
FORMAT = "veselova.closed-form/1"

#: That of documents with the field ``area``, without which an evaluator gives another motion.
AREA_FORMAT = "veselova.closed-form/2"

_NUMBER: dict[str, Any] = {"type": "number"}
_VECTOR: dict[str, Any] = {"type": "array", "items": _NUMBER}
_MATRIX: dict[str, Any] = {"type": "array", "items": _VECTOR}
# no enumerations: generators of clients know none of numbers with fractions
_HALVES: dict[str, Any] = {
    "type": "array",
    "items": {"type": "number", "minimum": 0, "maximum": 0.5, "multipleOf": 0.5},
}
_QUARTER_TURN: dict[str, Any] = {
    "type": "number",
    "minimum": -0.25,
    "maximum": 0,
    "multipleOf": 0.25,
}
_PAIR: dict[str, Any] = {
    "type": "array",
    "items": _NUMBER,
    "minItems": 2,
    "maxItems": 2,
}
_PAIRS: dict[str, Any] = {"type": "array", "items": _PAIR}
_INTEGERS: dict[str, Any] = {"type": "array", "items": {"type": "integer"}}

_FIELDS: dict[str, tuple[dict[str, Any], str]] = {
    "format": (
        {"type": "string", "enum": [FORMAT, AREA_FORMAT]},
        "the name and version of this format; the second has the field area",
    ),
    "version": ({"type": "string"}, "the version of veselova that made the document"),
    "problem": ({"type": "object", "required": ["system"]}, "the problem as it was given"),
    "time": ({"type": "string", "enum": ["t", "s", "tau1"]}, "the independent variable"),
    "digits": (
        {"type": "integer", "minimum": FEWEST_DIGITS, "maximum": FEWEST_DIGITS},
        "significant digits of the numbers, which are doubles",
    ),
    "genus": ({"type": "integer", "minimum": 1}, "g, the number of phases"),
    "A": (_VECTOR, "A_1 … A_n along the principal axes"),
    "axes": (
        {"anyOf": [_MATRIX, {"type": "null"}]},
        "the principal axes as columns, where A was a matrix",
    ),
    "riemann_matrix": (_MATRIX, "T, g × g; the Riemann matrix is iT"),
    "reduction": (
        {
            "anyOf": [
                {
                    "type": "object",
                    "required": ["basis", "waves"],
                    "properties": {
                        "basis": {"type": "array", "items": _INTEGERS},
                        "waves": _INTEGERS,
                    },
                },
                {"type": "null"},
            ]
        },
        "basis U and waves F of the theta sums, where T has a small eigenvalue",
    ),
    "characteristics": (
        {
            "type": "array",
            "items": {"type": "array", "items": _HALVES, "minItems": 2, "maxItems": 2},
        },
        "[ε, δ] of each theta function; the first is the denominator",
    ),
    "q": (_PAIRS, "[index of characteristic, κ] of q along each direction that moves"),
    "q_prime": (_PAIRS, "the same of (q', n_k), k = 2 … g, and (q', γ)"),
    "normals": (
        {"type": "array", "items": _PAIRS},
        "the same of n_2 … n_g along the directions that move",
    ),
    "gamma": (_PAIRS, "the same of γ"),
    "phases": (_VECTOR, "z⁰ in cycles"),
    "frequencies": (_VECTOR, "f in cycles per unit of τ₁"),
    "rotation": (_MATRIX, "ℜ, g × (n−1)"),
    "directions": (_MATRIX, "the directions that move as columns, n × (g+1)"),
    "frozen": (_MATRIX, "what stays of e_2 … e_n, n × (n−1)"),
    "mean_rate": (_NUMBER, "F_0, the mean of d(time)/dτ₁"),
    "modes": ({"type": "array", "items": _INTEGERS}, "m of the time map, m and −m once"),
    "coefficients": (_VECTOR, "F_m of each mode"),
    "rate": (
        {
            "type": "object",
            "required": ["characteristic", "constant", "power"],
            "properties": {
                "characteristic": {"type": "integer"},
                "constant": _NUMBER,
                "power": {"type": "integer", "enum": [-2, 0, 1]},
            },
        },
        "d(time)/dτ₁ = constant·|θ[characteristic]/θ|^power",
    ),
    "units": ({"type": "object"}, "the units of times, lengths and phases"),
    "error": (
        {"type": "object", "required": ["at_start", "per_unit_time", "per_cycle"]},
        "the bound at_start + per_unit_time·|t| on q and frame; per_cycle is per cycle of "
        "the fastest phase",
    ),
}

#: The matrix may be off its transpose by this part of its largest entry.
_SYMMETRY = 1e-12

#: A function of period 2 on the torus.
_SERIES: dict[str, Any] = {
    "type": "object",
    "required": ["modes", "coefficients", "turn"],
    "properties": {
        "modes": {"type": "array", "items": _INTEGERS},
        "coefficients": _VECTOR,
        "turn": _QUARTER_TURN,
    },
}

#: Fields of some documents only.
_FURTHER: dict[str, tuple[dict[str, Any], str]] = {
    "path": (
        {
            "type": "object",
            "required": ["radius", "position", "speed", "transverse"],
            "properties": {
                "radius": _NUMBER,
                "position": _VECTOR,
                "speed": _NUMBER,
                "transverse": {"type": "array", "items": _SERIES},
                "plane": _MATRIX,
                "odd": _NUMBER,
            },
        },
        "the contact point of a rolling ball: radius, start, speed along the momentum, and for k = "
        "2 … g the doubled modes M and coefficients of (q', n_k) = Σ 2c cos 2π(M·z/2 + turn); with "
        "an area constant also the directions of these parts, and the factor of the odd time",
    ),
    "ball": (
        {
            "type": "object",
            "required": ["roots", "momentum", "added"],
            "properties": {
                "roots": _VECTOR,
                "momentum": _VECTOR,
                "added": {"anyOf": [_NUMBER, {"type": "null"}]},
            },
        },
        "of a ball in ℝⁿ, n ≥ 4: x with J_ij = x_ix_j, the momentum p in space, and ma² where it "
        "twists freely; its ω is q∧ξ, or (xq∧xξ)/ma² − q∧ξ, ξ = [x⁻¹p − (p,x⁻¹q)q]/(q,xq)",
    ),
    "area": (
        {
            "type": "object",
            "required": ["odd", "attitude", "momentum", "inverse", "form", "constant"],
            "properties": {
                "odd": _SERIES,
                "attitude": _MATRIX,
                "momentum": _VECTOR,
                "inverse": _MATRIX,
                "form": _MATRIX,
                "constant": _NUMBER,
            },
        },
        "of a body with an area constant: the odd part of dt/dτ₁, the rotation from the frame of "
        "the torus to that of the body, and K in space, B, G, c of Ω = B(K + σγ), σ = (c − "
        "(BK,γ))/(Gγ,γ)",
    ),
}

SCHEMA: dict[str, Any] = {
    "$schema": "https://json-schema.org/draft/2020-12/schema",
    "title": "A motion in closed form",
    "type": "object",
    "required": list(_FIELDS),
    "properties": {
        name: {**schema, "description": text}
        for name, (schema, text) in {**_FIELDS, **_FURTHER}.items()
    },
}


def require_document(document: Any) -> None:
    """Raise InvalidInput unless the value has every field of the format with numbers of the right
    shapes.
    """
    if not isinstance(document, Mapping):
        raise InvalidInput(("document",), "a JSON object of the format " + FORMAT, show(document))
    form = AREA_FORMAT if "area" in document else FORMAT
    if document.get("format") != form:
        raise InvalidInput(("document", "format"), form, show(document.get("format")))
    missing = [name for name in _FIELDS if name not in document]
    if missing:
        raise InvalidInput(
            ("document",),
            f"the fields {', '.join(missing)} too",
            f"only {', '.join(map(str, document))}"[:200],
        )
    problem = document["problem"]
    if not isinstance(problem, Mapping) or not isinstance(problem.get("system"), str):
        raise InvalidInput(
            ("document", "problem"), "an object with the field system", show(problem)
        )
    g = document["genus"]
    if isinstance(g, bool) or not isinstance(g, int) or g < 1:
        raise InvalidInput(("document", "genus"), "a whole number of at least 1", show(g))
    if document["digits"] != FEWEST_DIGITS:
        required = f"{FEWEST_DIGITS}; more digits at given times come from solve(…, digits=)"
        raise InvalidInput(("document", "digits"), required, show(document["digits"]))
    require_name(document["time"], ("document", "time"), _FIELDS["time"][0]["enum"])
    if not isinstance(document["version"], str):
        raise InvalidInput(("document", "version"), "a text", show(document["version"]))
    units = document["units"]
    if not isinstance(units, Mapping) or not all(isinstance(unit, str) for unit in units.values()):
        raise InvalidInput(("document", "units"), "an object of texts", show(units))
    _require_shapes(document, g)


def _require_shapes(document: Mapping[str, Any], g: int) -> None:
    """Raise InvalidInput where an array has another shape than n, g and the number of modes say."""
    n = _length(document, "A", None)
    count = _length(document, "modes", None)
    functions = _length(document, "characteristics", None)
    if not functions:
        required = "a list of characteristics, the denominator's first"
        raise InvalidInput(("document", "characteristics"), required, "an empty list")
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
        require_numbers((name,), document[name], shape)
    require_numbers(("mean_rate",), document["mean_rate"], ())
    positive_number(document["mean_rate"], ("document", "mean_rate"))
    if document["axes"] is not None:
        require_numbers(("axes",), document["axes"], (n, n))
    if "path" in document:
        require_path(document["path"], g, n, "area" in document)
    if "area" in document:
        require_area(document["area"], g, n)
    if "ball" in document:
        require_ball(document["ball"], n)
    T = np.array(document["riemann_matrix"], dtype=float)
    defect = float(np.max(np.abs(T - T.T)))
    least = float(np.linalg.eigvalsh(T)[0])
    if defect > _SYMMETRY * np.max(np.abs(T)) or not least > 0:
        required = "a symmetric, positive definite matrix"
        given = f"least eigenvalue {least:.3g}, off its transpose by {defect:.3g}"
        raise InvalidInput(("document", "riemann_matrix"), required, given)
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
            require_numbers((name, key), inner.get(key) if isinstance(inner, Mapping) else None, ())
    place = document["rate"]["characteristic"]
    if not isinstance(place, int) or not 0 <= place < functions:
        raise InvalidInput(
            ("document", "rate", "characteristic"), f"an index below {functions}", show(place)
        )


def _require_reduction(reduction: Any, g: int) -> None:
    """Raise InvalidInput unless the basis is a matrix of whole numbers of determinant ±1 and the
    waves are some of its rows.
    """
    basis = reduction.get("basis") if isinstance(reduction, Mapping) else None
    require_numbers(("reduction", "basis"), basis, (g, g))
    matrix = np.array(basis, dtype=float)
    if np.any(matrix != np.rint(matrix)) or abs(abs(np.linalg.det(matrix)) - 1) > 1e-6:
        raise InvalidInput(
            ("document", "reduction", "basis"),
            "whole numbers with determinant 1 or −1",
            show(basis),
        )
    waves = reduction.get("waves")
    if (
        not isinstance(waves, list)
        or not all(isinstance(i, int) and 0 <= i < g for i in waves)
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
            or not isinstance(pair[0], int)
            or not 0 <= pair[0] < functions
        ):
            raise InvalidInput(
                ("document", *path, i), f"a pair [index below {functions}, constant]", show(pair)
            )
        require_numbers((*path, i, 1), pair[1], ())
