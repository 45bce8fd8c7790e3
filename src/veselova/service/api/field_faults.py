"""What pydantic finds wrong with a field, in the words of the other doors."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from veselova.mechanics.core.errors import InvalidInput, did_you_mean, show, unknown_name
from veselova.service.api.problem_models import SYSTEMS

__all__ = ["MOST_OUTPUTS", "field_fault"]

#: No system has as many series.
MOST_OUTPUTS = 20

#: A field name is quoted up to here.
_LONGEST_NAME = 100


def field_fault(item: Any, fields: Sequence[str]) -> InvalidInput:
    """Return pydantic's finding in the words of the other doors: field, required, given."""
    path = tuple(part[:_LONGEST_NAME] if isinstance(part, str) else part for part in item["loc"])
    # where pydantic says which model it took
    if len(path) > 1 and path[0] == "problem" and path[1] in SYSTEMS:
        path = ("problem", *path[2:])
    kind = item["type"]
    error = item.get("ctx", {}).get("error")
    if isinstance(error, InvalidInput):
        return error
    given = show(item.get("input"))
    if kind == "union_tag_not_found":
        if isinstance(item.get("input"), dict):
            return InvalidInput((*path, "system"), "this field", "nothing")
        return InvalidInput(path, "a JSON object", given)
    if kind == "union_tag_invalid":
        return unknown_name((*path, "system"), item["input"]["system"], list(SYSTEMS))
    if kind == "missing":
        return InvalidInput(path, "this field", "nothing")
    if kind == "extra_forbidden":
        return InvalidInput(
            path,
            "no field of this name",
            f"the field {show(str(path[-1]))}{did_you_mean(path[-1], fields)}",
        )
    if kind == "literal_error":
        return unknown_name(path, item["input"], re.findall("'([^']*)'", item["ctx"]["expected"]))
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        return InvalidInput(path, "a JSON object", given)
    required: str = {
        "bool_type": "true or false",
        "too_short": "at least one entry",
        "too_long": f"at most {MOST_OUTPUTS} entries",
        "float_type": "a number",
        "int_type": "a whole number",
        "greater_than": "a number greater than 0",
        "finite_number": "a finite number",
        "list_type": "a list",
        "string_type": "a string",
        "greater_than_equal": f"a whole number of at least {item.get('ctx', {}).get('ge')}",
        "less_than_equal": f"a whole number of at most {item.get('ctx', {}).get('le')}",
    }.get(kind, item["msg"][:1].lower() + item["msg"][1:])
    return InvalidInput(path, required, given)
