"""Hostile requests: what no honest client sends, and every one must be answered with a 4xx problem
document.
"""

from __future__ import annotations

import json
from typing import Any

from veselova import Veselova

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


#: Work that no machine ends within the longest budget.
ENDLESS = {**GOOD, "times": [0, 1e7], "engine": "numeric"}

#: The problem of these requests.
PROBLEM = Veselova(GOOD_PROBLEM["A"], GOOD_PROBLEM["q"], GOOD_PROBLEM["q_dot"])


def changed(**fields: Any) -> str:
    return json.dumps({**GOOD, **fields})


def problem(**fields: Any) -> str:
    return json.dumps({**GOOD, "problem": {**GOOD_PROBLEM, **fields}})


def without(field: str) -> str:
    return json.dumps({**GOOD, "problem": {k: v for k, v in GOOD_PROBLEM.items() if k != field}})


#: (name, body, pointer of the first fault): invalid input, status 422.
INVALID: list[tuple[str, str, str]] = [
    ("NaN in A", problem(A=[3, 2, float("nan")]), "/problem/A/2"),
    ("1e999", changed().replace("[3, 2, 1]", "[3, 2, 1e999]"), "/problem/A/2"),
    ("huge integer", changed().replace("[3, 2, 1]", "[3, 2, 1" + "0" * 400 + "]"), "/problem/A/2"),
    ("object in A", problem(A=[3, {}, 1]), "/problem/A/1"),
    ("control characters in A", problem(A=[3, "\u0000\n", 1]), "/problem/A/1"),
    ("A is null", problem(A=None), "/problem/A"),
    ("unknown system", problem(system="double-pendulum"), "/problem/system"),
    ("unknown field of the problem", problem(mass=1), "/problem/mass"),
    ("unknown field of the request", changed(verbose=True), "/verbose"),
    ("prototype pollution", changed(__proto__={"a": 1}), "/__proto__"),
    ("field with a slash", json.dumps({**GOOD, "a/b~c": 1}), "/a~1b~0c"),
    ("system is missing", without("system"), "/problem/system"),
    ("problem is missing", json.dumps({"times": [0]}), "/problem"),
    ("problem is a list", changed(problem=[1]), "/problem"),
    ("times are missing", json.dumps({"problem": GOOD_PROBLEM}), "/times"),
    ("times are empty", changed(times=[]), "/times"),
    (
        "times of an unknown field",
        changed(times={"start": 0, "stop": 1, "count": 3, "step": 1}),
        "/times/step",
    ),
    ("fractional count", changed(times={"start": 0, "stop": 1, "count": 2.5}), "/times/count"),
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
    ("unknown output", changed(outputs=["q", "p"]), "/outputs/1"),
    ("no outputs", changed(outputs=[]), "/outputs"),
    ("digits beyond the offer", changed(digits=1001), "/digits"),
    ("boolean digits", changed(digits=True), "/digits"),
    ("zero budget", changed(budget_s=0), "/budget_s"),
    ("NaN budget", changed(budget_s=float("nan")), "/budget_s"),
    ("too long a budget", changed(budget_s=1e9), "/budget_s"),
    ("the body is a list", "[]", ""),
    ("the body is null", "null", ""),
    ("deeply nested value", changed().replace("[3, 2, 1]", "[" * 500 + "]" * 500), ""),
]

#: (name, body): not JSON at all, status 400.
MALFORMED: list[tuple[str, bytes]] = [
    ("empty", b""),
    ("half an object", b'{"problem": '),
    ("trailing comma", b'{"times": [1,]}'),
    ("binary", bytes(range(256))),
    ("100 000 brackets", b"[" * 100_000),
    ("5000 digits", b'{"problem": 1' + b"0" * 5000 + b"}"),
]
