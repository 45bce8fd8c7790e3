"""Hostile requests: what no honest client sends, and every one must be answered with a 4xx problem
document.
"""

from __future__ import annotations

import json
from typing import Any

GOOD_PROBLEM: dict[str, Any] = {
    "system": "veselova",
    "A": [3, 2, 1],
    "q": [0.6, 0.0, 0.8],
    "q_dot": [0.8, 1.0, -0.6],
}

#: The longest budget that a server gives unless told otherwise: what is not about budgets shall not
#: depend on the machine.
BUDGET_S = 60.0

GOOD: dict[str, Any] = {"problem": GOOD_PROBLEM, "times": [0, 1], "budget_s": BUDGET_S}


def changed(**fields: Any) -> str:
    return json.dumps({**GOOD, **fields})


def problem(**fields: Any) -> str:
    return json.dumps({**GOOD, "problem": {**GOOD_PROBLEM, **fields}})


def without(field: str) -> str:
    return json.dumps({**GOOD, "problem": {k: v for k, v in GOOD_PROBLEM.items() if k != field}})


#: (name, body, pointer of the first fault): invalid input, status 422.
INVALID: list[tuple[str, str, str]] = [
    ("NaN in A", problem(A=[3, 2, float("nan")]), "/problem/A/2"),
    ("Infinity in q", problem(q=[float("inf"), 0, 0]), "/problem/q/0"),
    ("minus Infinity in times", changed(times=[float("-inf"), 0]), "/times/0"),
    ("1e999", changed().replace("[3, 2, 1]", "[3, 2, 1e999]"), "/problem/A/2"),
    ("NaN as a string", problem(A=[3, 2, "NaN"]), "/problem/A/2"),
    ("huge integer", changed().replace("[3, 2, 1]", "[3, 2, 1" + "0" * 400 + "]"), "/problem/A/2"),
    ("huge exponent as a string", problem(A=[3, 2, "1e999999999"]), "/problem/A/2"),
    ("boolean in A", problem(A=[True, 2, 1]), "/problem/A/0"),
    ("boolean in times", changed(times=[0, True]), "/times/1"),
    ("null in A", problem(A=[3, None, 1]), "/problem/A/1"),
    ("object in A", problem(A=[3, {}, 1]), "/problem/A/1"),
    ("text in A", problem(A=[3, "two", 1]), "/problem/A/1"),
    ("lone surrogate in A", problem(A=[3, "\ud800", 1]), "/problem/A/1"),
    ("control characters in A", problem(A=[3, "\u0000\n", 1]), "/problem/A/1"),
    ("nested list in q", problem(q=[[0.6], 0, 0.8]), "/problem/q/0"),
    ("A is a number", problem(A=3), "/problem/A"),
    ("A is null", problem(A=None), "/problem/A"),
    ("A is empty", problem(A=[]), "/problem/A"),
    ("A is an object", problem(A={"0": 3}), "/problem/A"),
    ("ragged matrix", problem(A=[[3, 0, 0], [0, 2], [0, 0, 1]]), "/problem/A/1"),
    ("asymmetric matrix", problem(A=[[3, 1, 0], [0, 2, 0], [0, 0, 1]]), "/problem/A/0/1"),
    ("n = 1", problem(A=[3], q=[1], q_dot=[0]), "/problem/A"),
    ("zero in A", problem(A=[3, 0, 1]), "/problem/A/1"),
    ("negative A", problem(A=[3, -2, 1]), "/problem/A/1"),
    ("zero q", problem(q=[0, 0, 0]), "/problem/q"),
    ("q too short", problem(q=[0.6, 0.8]), "/problem/q"),
    ("q too long", problem(q=[0.6, 0.0, 0.8, 0.0]), "/problem/q"),
    ("q not of unit length", problem(q=[0.6, 0.1, 0.8]), "/problem/q"),
    ("q_dot not tangent", problem(q_dot=[0.8, 1.0, 0.6]), "/problem/q_dot"),
    ("frame not orthogonal", problem(frame=[[2, 0, 0], [0, 1, 0], [0, 0, 1]]), "/problem/frame"),
    ("e_1 is not q", problem(frame=[[1, 0, 0], [0, 1, 0], [0, 0, 1]]), "/problem/frame"),
    ("frame of the wrong size", problem(frame=[[1, 0], [0, 1]]), "/problem/frame"),
    ("normalize is a number", problem(normalize=1), "/problem/normalize"),
    ("unknown system", problem(system="double-pendulum"), "/problem/system"),
    ("unknown field of the problem", problem(mass=1), "/problem/mass"),
    ("unknown field of the request", changed(verbose=True), "/verbose"),
    ("prototype pollution", changed(__proto__={"a": 1}), "/__proto__"),
    ("field with a slash", json.dumps({**GOOD, "a/b~c": 1}), "/a~1b~0c"),
    ("system is missing", without("system"), "/problem/system"),
    ("A is missing", without("A"), "/problem/A"),
    ("problem is missing", json.dumps({"times": [0]}), "/problem"),
    ("problem is a list", changed(problem=[1]), "/problem"),
    ("times are missing", json.dumps({"problem": GOOD_PROBLEM}), "/times"),
    ("times are empty", changed(times=[]), "/times"),
    ("times are a number", changed(times=1), "/times"),
    (
        "times of an unknown field",
        changed(times={"start": 0, "stop": 1, "count": 3, "step": 1}),
        "/times/step",
    ),
    ("times without a count", changed(times={"start": 0, "stop": 1}), "/times/count"),
    ("fractional count", changed(times={"start": 0, "stop": 1, "count": 2.5}), "/times/count"),
    ("boolean count", changed(times={"start": 0, "stop": 1, "count": True}), "/times/count"),
    ("negative count", changed(times={"start": 0, "stop": 1, "count": -1}), "/times/count"),
    ("astronomical count", changed(times={"start": 0, "stop": 1, "count": 10**15}), "/times"),
    ("stop before start", changed(times={"start": 1, "stop": 0, "count": 3}), "/times/stop"),
    ("too many times", changed(times={"start": 0, "stop": 1, "count": 5_000_000}), "/times"),
    (
        "too large a dimension",
        problem(A=[1] * 1000, q=[1] + [0] * 999, q_dot=[0, 1] + [0] * 998),
        "/problem/A",
    ),
    ("unknown engine", changed(engine="magic"), "/engine"),
    ("unknown method", changed(method="euler"), "/method"),
    ("method is a number", changed(method=3), "/method"),
    ("unknown output", changed(outputs=["q", "p"]), "/outputs/1"),
    ("no outputs", changed(outputs=[]), "/outputs"),
    ("outputs are text", changed(outputs="q"), "/outputs"),
    ("digits beyond the offer", changed(digits=1001), "/digits"),
    ("boolean digits", changed(digits=True), "/digits"),
    ("zero budget", changed(budget_s=0), "/budget_s"),
    ("negative budget", changed(budget_s=-1), "/budget_s"),
    ("NaN budget", changed(budget_s=float("nan")), "/budget_s"),
    ("infinite budget", changed(budget_s=float("inf")), "/budget_s"),
    ("boolean budget", changed(budget_s=True), "/budget_s"),
    ("too long a budget", changed(budget_s=1e9), "/budget_s"),
    ("the body is a list", "[]", ""),
    ("the body is a number", "3", ""),
    ("the body is null", "null", ""),
    ("the body is text", '"veselova"', ""),
    ("the body is an empty object", "{}", "/problem"),
    ("deeply nested value", changed().replace("[3, 2, 1]", "[" * 500 + "]" * 500), ""),
]

#: (name, body): not JSON at all, status 400.
MALFORMED: list[tuple[str, bytes]] = [
    ("empty", b""),
    ("half an object", b'{"problem": '),
    ("two documents", b"{}{}"),
    ("trailing comma", b'{"times": [1,]}'),
    ("single quotes", b"{'times': [1]}"),
    ("comment", b'{"times": [1]} // now'),
    ("binary", bytes(range(256))),
    ("invalid UTF-8", b'{"a": "\xff"}'),
    ("100 000 brackets", b"[" * 100_000),
    ("an integer of 10 000 digits", b'{"times": [' + b"1" * 10_000 + b"e]}"),
    ("raw control character", b'{"a": "\x01"}'),
]
