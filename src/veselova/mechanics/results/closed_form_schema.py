"""What a closed-form document must hold, as a JSON schema."""

from __future__ import annotations

from typing import Any

__all__ = ["CLOSED_FORM_FIELDS", "FORMAT", "MOST_CLOSED_FORM_DIGITS", "SCHEMA"]

#: The name and version of the format; another number is another set of fields.
FORMAT = "veselova.closed-form/1"

#: Digits that a document may have: accuracies are doubles.
MOST_CLOSED_FORM_DIGITS = 200

_NUMBER: dict[str, Any] = {
    "oneOf": [
        {"type": "number"},
        {"type": "string", "pattern": r"^-?[0-9]+(\.[0-9]+)?([eE][-+]?[0-9]+)?$"},
    ]
}
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
    "format": ({"const": FORMAT}, "the name and version of this format"),
    "version": ({"type": "string"}, "the version of veselova that made the document"),
    "problem": ({"type": "object", "required": ["system"]}, "the problem as it was given"),
    "time": ({"type": "string", "enum": ["t", "s", "tau1"]}, "the independent variable"),
    "digits": (
        {"type": "integer", "minimum": 15, "maximum": MOST_CLOSED_FORM_DIGITS},
        "significant digits of the numbers; above 15 they are strings",
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
                "transverse": {
                    "type": "array",
                    "items": {
                        "type": "object",
                        "required": ["modes", "coefficients", "turn"],
                        "properties": {
                            "modes": {"type": "array", "items": _INTEGERS},
                            "coefficients": _VECTOR,
                            "turn": _QUARTER_TURN,
                        },
                    },
                },
            },
        },
        "the contact point of a rolling ball: radius, start, speed along the momentum, and for k = "
        "2 … g the doubled modes M and coefficients of (q', n_k) = Σ 2c cos 2π(M·z/2 + turn)",
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

#: The fields that every document has.
CLOSED_FORM_FIELDS = tuple(_FIELDS)
