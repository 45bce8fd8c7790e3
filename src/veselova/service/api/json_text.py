"""JSON as text: decoded in linear time, with pointers to repeated names, and numbers as they were
written.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterator, Mapping
from itertools import islice
from typing import Any

from veselova.mechanics.core.errors import MOST_FAULTS, InvalidInput, InvalidRequest
from veselova.service.api.problem_details import Refused

__all__ = ["BeyondFloat", "decode", "layers"]

Path = tuple[str | int, ...]

#: Objects further inside than this have no pointers: none that is valid is.
_DEEPEST = 16

#: Python reads integers of 4300 digits.
_LONGEST_INTEGER = 4000


class BeyondFloat(float):
    """An infinite float that shows the numeral it was read from, such as 1e400."""

    text: str

    def __new__(cls, sign: float, text: str) -> BeyondFloat:
        """Return infinity of a sign, shown as a numeral."""
        number = super().__new__(cls, math.copysign(math.inf, sign))
        number.text = text
        return number

    def __repr__(self) -> str:
        return self.text

    def __reduce__(self) -> tuple[Any, ...]:  # to a worker
        return type(self), (float(self), self.text)


#: More of a numeral no message shows.
_SHOWN_DIGITS = 100


def decode(text: bytes) -> Any:
    """Return the document that a text states; raises Refused when it is not JSON, InvalidRequest
    where names come twice.

    NaN, Infinity and 1e999 are no JSON, but their sender is helped more by the name of the field:
    Python's own parser takes them, and the validation that follows refuses every number that is not
    finite. Of two fields of one name neither is taken.
    """
    if not text.strip():
        raise Refused("malformed-json", "The body: required one JSON document; given nothing.")
    repeated: dict[int, tuple[dict[str, Any], list[str]]] = {}

    def fields(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        found = dict(pairs)
        if len(found) < len(pairs):
            counts = Counter(name for name, _ in pairs)
            names = [name for name, count in counts.items() if count > 1]
            # the object is kept, and its id with it
            repeated[id(found)] = (found, names[:MOST_FAULTS])
        return found

    decoder = json.JSONDecoder(object_pairs_hook=fields, parse_int=_integer, parse_float=_float)
    try:
        # some editors put a byte order mark before it
        document = decoder.decode(text.decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        reason = "nested too deeply" if isinstance(error, RecursionError) else str(error)
        raise Refused(
            "malformed-json", f"The body: required one JSON document; {reason}."
        ) from None
    if repeated:
        raise InvalidRequest(list(islice(_repetitions(document, repeated), MOST_FAULTS + 1)))
    return document


def _repetitions(
    document: Any, repeated: Mapping[int, tuple[Any, list[str]]]
) -> Iterator[InvalidInput]:
    """Yield a fault for every name that comes twice, deeper ones last."""
    reached = False
    for path, value in _objects(document):
        for name in repeated[id(value)][1] if id(value) in repeated else ():
            reached = True
            yield InvalidInput((*path, name), "each field once", "two fields of this name")
    if not reached:
        yield InvalidInput(
            (),
            f"each field once, and at most {_DEEPEST} levels of nesting",
            "two fields of one name",
        )


def layers(document: Any) -> Iterator[list[Any]]:
    """Yield the values of a document level by level, the document itself first,
    without recursion.
    """
    layer = [document]
    while layer:
        yield layer
        layer = [
            item
            for value in layer
            if isinstance(value, (dict, list))
            for item in (value.values() if isinstance(value, dict) else value)
        ]


def _objects(document: Any) -> Iterator[tuple[Path, dict[str, Any]]]:
    """Yield the objects of a document with their places, in the order of the text; those further
    inside are left out.
    """
    ahead: list[tuple[Path, Any]] = [((), document)]
    while ahead:
        path, value = ahead.pop()
        if isinstance(value, dict):
            yield path, value
        if len(path) < _DEEPEST:
            inner = value.items() if isinstance(value, dict) else enumerate(value)
            ahead += [
                ((*path, part), item) for part, item in inner if isinstance(item, (dict, list))
            ][::-1]


def _integer(text: str) -> int | str:
    """Return an integer; one of more digits than Python reads stays a text, which its field then
    refuses.
    """
    return int(text) if len(text) < _LONGEST_INTEGER else text


def _float(text: str) -> float:
    """Return a float; one beyond the range of doubles shows what was written."""
    number = float(text)
    return number if math.isfinite(number) else BeyondFloat(number, text[:_SHOWN_DIGITS])
