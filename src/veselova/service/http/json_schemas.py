"""JSON schemas of all requests and answers: for the OpenAPI document, and for /v1/schemas, where
each stands alone.
"""

from __future__ import annotations

import re
from functools import cache
from typing import Any

import orjson
from pydantic.json_schema import models_json_schema

from veselova.mechanics.core.decimals import FEWEST_DIGITS
from veselova.mechanics.results.closed_form_schema import SCHEMA as CLOSED_FORM
from veselova.mechanics.results.curve import QUASI_PERIODS
from veselova.service.api.problem_models import SYSTEMS
from veselova.service.api.sweep_request import SweepRequest
from veselova.service.http.drift_schema import DRIFT
from veselova.service.http.ensemble_schema import ensemble_schema
from veselova.service.http.job_document import JobDocument, JobList
from veselova.service.workers.tasks import TASKS

__all__ = ["PREFIX", "answer_name", "component_schemas", "schema_document", "schema_names"]

#: Where the schemas stand in the OpenAPI document.
PREFIX = "#/components/schemas/"

_NUMBERS: dict[str, Any] = {"type": "array", "items": {"type": "number"}}
_MATRIX: dict[str, Any] = {"type": "array", "items": _NUMBERS}


def _series(number: dict[str, Any]) -> dict[str, Any]:
    """Return the schemas of all outputs, by the schema of their numbers."""
    schemas: dict[str, Any] = {}
    for model in SYSTEMS.values():
        for name, axes in model.problem_class.outputs.items():
            schemas[name] = number
            for _ in range(len(axes) + 1):
                schemas[name] = {"type": "array", "items": schemas[name]}
    return schemas


_TEXT = {"type": "string"}
_TEXTS = {"type": "array", "items": _TEXT}
_DECIMAL = {"type": "string", "pattern": r"^-?\d", "description": "a decimal"}
_NUMBER_OR_DECIMAL = {"anyOf": [{"type": "number"}, _DECIMAL]}
_PAIR = {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}
_NUMBER_OR_NUMBERS = {"anyOf": [{"type": "number"}, _NUMBERS]}
_DECIMALS = {"type": "array", "items": _DECIMAL}
_MATRIX_OR_DECIMALS = {"anyOf": [_MATRIX, {"type": "array", "items": _DECIMALS}]}
_MATRIX_OR_NULL = {"anyOf": [*_MATRIX_OR_DECIMALS["anyOf"], {"type": "null"}]}
_PAIR_OR_DECIMALS = {"anyOf": [_PAIR, {**_DECIMALS, "minItems": 2, "maxItems": 2}]}
_NESTED = {"type": "array", "items": {}, "description": "nested arrays of pairs"}
_BY_NAME = {"type": "object", "additionalProperties": {"type": "number"}}


def _object(
    properties: dict[str, Any],
    required: list[str] | None = None,
    optional: dict[str, Any] | None = None,
) -> dict[str, Any]:
    return {
        "type": "object",
        "properties": {**properties, **(optional or {})},
        "required": list(properties) if required is None else required,
    }


_PROVENANCE = _object(
    {
        "engine": {"type": "string"},
        "method": {"type": "string"},
        "digits": {"type": "integer"},
        "version": {"type": "string"},
        "seconds": {"type": "number"},
        "details": {"type": "object"},
    }
)

#: Schemas of answers, by their names; a problem document is one of them.
_ANSWERS: dict[str, dict[str, Any]] = {
    "Trajectory": _object(
        {
            "engine": {"type": "string"},
            "times": {
                **_NUMBERS,
                "description": "the doubles nearest to the times asked for, in their order",
            },
            "remainders": {
                **_NUMBERS,
                "description": "what the exact times are beyond these doubles; left out where that "
                "is nothing",
            },
            "series": {
                **_object(_series(_NUMBER_OR_DECIMAL), required=[]),
                "description": f"decimals where more than {FEWEST_DIGITS} digits, or certified "
                "errors, were asked for",
            },
            "radii": {
                **_object(_series(_DECIMAL), required=[]),
                "description": "the error of every decimal",
            },
            "integrals": {
                "type": "object",
                "additionalProperties": _object(
                    {
                        "initial": {"anyOf": [{"type": "number"}, _NUMBERS]},
                        "drift": {"type": "number"},
                    }
                ),
            },
            "error": {
                "type": "array",
                "items": _NUMBER_OR_DECIMAL,
                "description": "bounds the true error of every component of the bounded series at "
                "each time: true ≤ error; "
                "bounded series of system veselova: q and frame",
            },
            "provenance": _PROVENANCE,
        },
        required=["engine", "times", "series", "integrals", "error", "provenance"],
    ),
    "Ensemble": ensemble_schema(_PROVENANCE),
    "Comparison": _object(
        {
            "deviation": {
                **_BY_NAME,
                "description": "largest difference of the engines, per output",
            },
            "agrees": {
                "type": "boolean",
                "description": "whether they differ by no more than the sum of both errors",
            },
            "conditioning_floor": {
                "type": "number",
                "description": "the formula ε·max(1, |ω||t|) at the farthest time: what one "
                "rounding of doubles moves in a motion that loses nothing",
            },
            "error": _BY_NAME,
            "drift": {"type": "object", "additionalProperties": _BY_NAME},
            "seconds": _BY_NAME,
            "provenance": {"type": "object", "additionalProperties": _PROVENANCE},
            "analytic": {"$ref": f"{PREFIX}Trajectory"},
            "numeric": {"$ref": f"{PREFIX}Trajectory"},
            "formulations": {
                "type": "object",
                "additionalProperties": {"$ref": f"{PREFIX}Trajectory"},
                "description": "instead of analytic and numeric, for a system of one engine: two "
                "formulations by name",
            },
        },
        required=[
            "deviation",
            "agrees",
            "conditioning_floor",
            "error",
            "drift",
            "seconds",
            "provenance",
        ],
    ),
    "Torus": _object(
        {
            "n": {"type": "integer"},
            "energy": {
                "anyOf": [{"type": "number"}, {"type": "null"}],
                "description": "null beyond the range of a double, or with jacobi_integral",
            },
            "constants": _NUMBERS,
            "branch_points": _NUMBERS,
            "origins": {"type": "array", "items": {"type": "string"}},
            "periods": {
                "anyOf": [_MATRIX, {"type": "null"}],
                "description": "null beyond the range of a double",
            },
            "riemann_matrix": _MATRIX,
            "riemann_matrix_residual": {"type": "number"},
            "frequencies_tau1": _NUMBERS,
            "frequencies_t": _NUMBERS,
            "phases": _NUMBERS,
            "mean_rate": {"type": "number"},
            "regime": {"type": "string"},
        },
        optional={"drift": DRIFT, "jacobi_integral": {"type": "number"}},
    ),
    "ClosedForm": {name: part for name, part in CLOSED_FORM.items() if name != "$schema"},
    "Curve": _object(
        {
            "genus": {"type": "integer"},
            "sign": {"type": "integer"},
            "branch_points": {**_NUMBERS, "description": "increasing"},
            "cuts": {**_MATRIX, "description": "the intervals round which a_1 … a_g go"},
            "gaps": {**_MATRIX, "description": "the intervals that b_1 … b_g are made of"},
            "a_periods": {
                **_MATRIX_OR_NULL,
                "description": "∮ λ^{k−1}dλ/w over a_s, column s; null beyond the range of a "
                "double",
            },
            "b_periods": {
                **_MATRIX_OR_NULL,
                "description": "the same over b_s, without the factor i",
            },
            "normalized_differentials": {
                **_MATRIX_OR_NULL,
                "description": "c: v_j = Σ_k c_jk λ^{k−1}dλ/w has ∮_{a_s} v_j = δ_js",
            },
            "riemann_matrix": {
                **_MATRIX_OR_DECIMALS,
                "description": "T; the Riemann matrix is iT. Decimals, here and below, where more "
                f"than {FEWEST_DIGITS} digits, or certified errors, were asked for",
            },
            "riemann_matrix_error": {
                "type": "number",
                "description": "the error of T in double precision",
            },
            "characteristics": {
                "type": "array",
                "items": _MATRIX,
                "description": "[ε, δ] of each branch point: τε + δ is its image",
            },
            "abel": {
                "type": "array",
                "items": {"type": "array", "items": _PAIR_OR_DECIMALS},
                "description": "images of the points from the last branch point, as pairs "
                "[real, imaginary]; left out without points",
            },
            "points": {
                **_MATRIX_OR_DECIMALS,
                "description": "λ on each cut at the points z; left out without z",
            },
            "signs": {**_MATRIX, "description": "the signs of w there"},
            "quasi_periods": {
                **_object(dict.fromkeys(QUASI_PERIODS, _MATRIX_OR_DECIMALS)),
                "description": "half the periods of the first and second kind over a_s and b_s, "
                "omega and eta without the factor i; where outputs names them",
            },
            "thomae": {
                "type": "array",
                "items": _object(
                    {
                        "subset": {"type": "array", "items": {"type": "integer"}},
                        "characteristic": _MATRIX,
                        "fourth_power": _NUMBER_OR_DECIMAL,
                    }
                ),
                "description": "|θ[ε;δ](0)|⁴ of each partition; where outputs names it",
            },
            "digits": {"type": "integer"},
            "certified": {"type": "boolean"},
            "radii": {
                "type": "object",
                "additionalProperties": {
                    "type": "array",
                    "items": {},
                    "description": "decimals, nested as the field is",
                },
                "description": "the error of every decimal, by the name of its field",
            },
        },
        required=["genus", "riemann_matrix", "riemann_matrix_error", "characteristics"],
    ),
    "Theta": _object(
        {
            "values": {
                "type": "array",
                "items": {"type": "array", "items": {"anyOf": [{"type": "number"}, _NESTED]}},
                "description": "by points, then characteristics where several were given, then "
                "derivatives, as pairs [real, imaginary]",
            },
            "exponent": {
                "type": "array",
                "items": _NUMBER_OR_NUMBERS,
                "description": "θ = values·exp(exponent), by points and characteristics; 0 where "
                "the value is in the range of a double",
            },
            "error": {
                "type": "array",
                "items": _NUMBER_OR_NUMBERS,
                "description": "by how much the values are off at most",
            },
        }
    ),
    "Problem": _object(
        {
            "type": {"type": "string", "examples": ["urn:veselova:problem:invalid-input"]},
            "title": {"type": "string"},
            "status": {"type": "integer"},
            "detail": {"type": "string"},
            "outcome": {
                "type": "string",
                "description": "the named outcome of an engine that cannot serve the problem",
            },
            "errors": {
                "type": "array",
                "items": _object({"pointer": {"type": "string"}, "detail": {"type": "string"}}),
            },
        },
        required=["type", "title", "status", "detail"],
    ),
    "SystemList": _object(
        {
            "systems": {
                "type": "array",
                "items": _object(
                    {
                        **dict.fromkeys(("system", "title", "schema", "time"), _TEXT),
                        **dict.fromkeys(("fields", "formulations", "outputs"), _TEXTS),
                        "closed_form": {
                            "type": "boolean",
                            "description": "whether motions run on tori and are given as data",
                        },
                        "engines": {
                            "type": "object",
                            "additionalProperties": _TEXTS,
                            "description": "engine → its methods",
                        },
                    }
                ),
            },
            "toolkit": {
                "type": "array",
                "items": _object(
                    {**dict.fromkeys(("path", "title", "schema"), _TEXT), "fields": _TEXTS}
                ),
                "description": "what is served besides motions",
            },
            "version": _TEXT,
            "limits": {**_BY_NAME, "description": "largest dimension, most times, longest budget"},
        }
    ),
    "SchemaList": _object(
        {
            "schemas": {
                "type": "array",
                "items": _object(dict.fromkeys(("name", "title", "link"), _TEXT)),
            }
        }
    ),
    "Health": _object({"status": _TEXT, "version": _TEXT}, required=["status"]),
}


@cache
def _components() -> bytes:
    """Return all schemas by their names, as JSON."""
    requests: list[tuple[Any, Any]] = [
        (model, "validation") for model in (*(model for model, _ in TASKS.values()), SweepRequest)
    ]
    jobs: list[tuple[Any, Any]] = [(model, "serialization") for model in (JobDocument, JobList)]
    _, definitions = models_json_schema([*requests, *jobs], ref_template=PREFIX + "{model}")
    return orjson.dumps({**definitions["$defs"], **_ANSWERS})


def component_schemas() -> dict[str, Any]:
    """Return the schemas of all requests and answers by their names, which refer to one another
    below ``PREFIX``.
    """
    return dict(orjson.loads(_components()))


def answer_name(kind: str) -> str:
    """Return the name of the schema of a kind of answer: ClosedForm for closed_form."""
    return "".join(word.capitalize() for word in kind.split("_"))


def schema_names() -> dict[str, str]:
    """Return the names of all schemas, and what each is of, in a sentence (of an
    answer, its name).
    """
    return {
        name: schema.get("description", name).split("\n")[0]
        for name, schema in component_schemas().items()
    }


def schema_document(name: str) -> dict[str, Any]:
    """Return one schema by its name, those that it refers to among its ``$defs``;
    raises KeyError.

    ``closed-form.json`` is another name of ClosedForm, and so are those of the others.
    """
    schemas = component_schemas()
    if name not in schemas:
        files = {_file_name(known): known for known in schemas}
        name = files[name]
    schema = schemas[name]
    needed = {name}
    found = set[str]()
    while needed := {other for known in needed for other in _references(schemas[known])} - found:
        found |= needed
    definitions = {other: schemas[other] for other in schemas if other in found}
    text = orjson.dumps({**schema, "$defs": definitions}).decode().replace(PREFIX, "#/$defs/")
    dialect = "https://json-schema.org/draft/2020-12/schema"
    return {"$schema": dialect, "$id": f"urn:veselova:schema:{name}", **orjson.loads(text)}


def _file_name(name: str) -> str:
    return re.sub("(?<=[a-z])(?=[A-Z])", "-", name).lower() + ".json"


def _references(schema: dict[str, Any]) -> list[str]:
    return re.findall(f'"{PREFIX}([^"]*)"', orjson.dumps(schema).decode())
