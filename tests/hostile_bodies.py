"""Bodies, each the costliest of its kind to decode, to validate or to hash: as large as a server
takes them, or small ones whose numbers have many digits.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import Any

from hostile import GOOD, GOOD_PROBLEM

#: Bytes that the server takes, less what stands around the costly part.
SIZE = 990_000


def _filled(before: str, piece: Callable[[int], str], after: str) -> bytes:
    """Return a text of nearly SIZE bytes: pieces with commas between them."""
    count = max(1, (SIZE - len(before) - len(after)) // (len(piece(10**6)) + 1))
    return (before + ",".join(piece(k) for k in range(count)) + after).encode()


def _request(field: str, **changes: Any) -> tuple[str, str]:
    """Return what stands before and after the value of a field of a request."""
    text = json.dumps({**GOOD, **changes, field: "HERE"})
    before, after = text.split('"HERE"')
    return before, after


def _inside(field: str) -> tuple[str, str]:
    before, after = json.dumps({**GOOD, "problem": {**GOOD_PROBLEM, field: "HERE"}}).split('"HERE"')
    return before, after


def hostile_bodies() -> Iterator[tuple[str, bytes]]:
    """Yield names and bodies; none is a request that can be answered."""
    start, end = _request("times")
    yield "one name again and again", _filled("{", lambda k: '"a":1', "}")
    yield "every name twice", _filled("{", lambda k: f'"{k // 2}":1', "}")
    yield "surrogates twice", _filled("{", lambda k: f'"\\ud800{k // 2}":1', "}")
    yield "objects with two names alike", _filled("[", lambda k: '{"a":1,"a":2}', "]")
    yield (
        "names twice, deep inside",
        ("[" * 900 + _filled("[", lambda k: '{"a":1,"a":2}', "]").decode() + "]" * 900).encode(),
    )
    yield "many names", _filled("{", lambda k: f'"{k}":1', "}")
    yield "one long name", ('{"' + "x" * SIZE + '":1}').encode()
    yield "one long text", (start + '"' + "9" * SIZE + '"' + end).encode()
    yield "long integers", _filled(start + "[", lambda k: "9" * 3999, "]" + end)
    yield "one long integer", (start + "[" + "9" * SIZE + "]" + end).encode()
    yield "one long fraction", (start + "[0." + "9" * SIZE + "]" + end).encode()
    yield "long texts of numbers", _filled(start + "[", lambda k: f'"{k}.{"9" * 2080}"', "]" + end)
    yield "times as texts", _filled(start + "[", lambda k: f'"{k}"', "]" + end)
    yield "times as ratios", _filled(start + "[", lambda k: f'"{k}/7e300"', "]" + end)
    yield "whole times that fall", _filled(start + "[", lambda k: f"{2 * 10**7 - k}", "]" + end)
    yield "numbers beyond the range", _filled(start + "[", lambda k: "1e400", "]" + end)
    yield "constants that are none", _filled(start + "[", lambda k: "NaN", "]" + end)
    yield "texts that are no numbers", _filled(start + "[", lambda k: '"x"', "]" + end)
    yield "empty lists", _filled(start + "[", lambda k: "[]", "]" + end)
    yield "empty objects", _filled(start + "[", lambda k: "{}", "]" + end)
    yield "nested lists", _filled(start + "[", lambda k: "[[[[1]]]]", "]" + end)
    yield "brackets", b"[" * SIZE
    yield (
        "unknown outputs",
        _filled(_request("outputs")[0] + "[", lambda k: f'"{k}"', "]" + _request("outputs")[1]),
    )
    yield (
        "outputs that are numbers",
        _filled(_request("outputs")[0] + "[", lambda k: "1", "]" + _request("outputs")[1]),
    )
    yield (
        "a long system",
        _filled(_inside("system")[0] + '"', lambda k: "x" * 99, '"' + _inside("system")[1]),
    )
    for field in ("A", "q", "frame", "normalize"):
        yield (
            f"{field} without end",
            _filled(_inside(field)[0] + "[", lambda k: "1", "]" + _inside(field)[1]),
        )
        yield (
            f"{field} of texts",
            _filled(_inside(field)[0] + "[[", lambda k: '"1/3"', "]]" + _inside(field)[1]),
        )
    yield "a list of requests", _filled("[", lambda k: json.dumps(GOOD), "]")
    yield "white space", b" " * SIZE
    yield "escapes", (start + '"' + "\\u0041" * (SIZE // 6) + '"' + end).encode()
    yield "bytes that are no text", b"\xff" * SIZE


def hostile_sweeps() -> Iterator[tuple[str, bytes]]:
    """Yield names and bodies of sweeps."""
    base = json.dumps(GOOD_PROBLEM)
    vary = f'{{"problem":{base},"vary":{{'
    yield "many places", _filled(vary, lambda k: f'"/A/{k}":[1]', "}}")
    yield "a long place", (vary + '"' + "/A" * (SIZE // 2) + '":[1]}}').encode()
    yield "many values", _filled(vary + '"/A/0":[', lambda k: f"{k}.5", "]}}")
    yield "many texts", _filled(vary + '"/A/0":[', lambda k: f'"{k}/7"', "]}}")
    yield "many vectors", _filled(vary + '"/A":[', lambda k: "[3,2,1]", "]}}")
    yield "values of the wrong shape", _filled(vary + '"/A":[', lambda k: "[3,2,1,[]]", "]}}")
    yield "a union of patches", _filled(vary + '"/A/0":[{"union":[', lambda k: '{"A":[1]}', "]}]}}")
    yield "a patch without end", _filled(vary + '"/A/0":{', lambda k: f'"{k}":[]', "}}}")


def hostile_numbers() -> Iterator[tuple[str, str, bytes]]:
    """Yield paths, names and small bodies of a problem that takes a second to build."""

    def numerals(digits: int, step: int) -> list[str]:
        return [f"0.{k * step + 3}{'123456789' * (digits // 9)}" for k in range(1, 17)]

    problem = {
        "system": "ellipsoid-geodesic",
        "A": numerals(300, 7),
        "X": numerals(18, 5),
        "X_dot": numerals(18, 11),
        "normalize": True,
    }
    faulty = {"problem": problem, "outputs": ["x"], "digits": -1, "accuracy": 3, "budget_s": 1e9}
    for path, fields in (
        ("/v1/trajectories", ("outputs", "digits")),
        ("/v1/comparisons", ("outputs",)),
        ("/v1/closed-forms", ("accuracy",)),
        ("/v1/tori", ("budget_s",)),
    ):
        times = {} if path in ("/v1/closed-forms", "/v1/tori") else {"times": [0, 1]}
        body = {name: faulty[name] for name in ("problem", *fields)}
        yield path, f"many digits at {path}", json.dumps({**body, **times}).encode()
    sweep = {"problem": problem, "vary": {"/A/0": [1, 2]}, "times": [0, 1], "outputs": ["x"]}
    yield "/v1/sweeps", "many digits in a sweep", json.dumps(sweep).encode()
