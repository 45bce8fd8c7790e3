"""Does any text make the parsers of requests raise something that is not a refusal?

    python benchmarks/fuzz.py [COUNT [SEED]]

COUNT (1 000 000) texts are made from valid requests of every kind and system: values replaced by
others of the wrong kind or size, fields dropped, doubled or renamed, bytes changed, texts cut off.
Each goes the way of a body: decoding, the model of its request, then the problem, the times and,
for a sweep, its parameters. Exits with status 1 at the first exception that is no VeselovaError and
no Refused, and prints the text and the seed.
"""

from __future__ import annotations

import copy
import json
import random
import sys
import time
import warnings
from collections import Counter
from typing import Any

from veselova.mechanics.core.errors import VeselovaError
from veselova.service.api.problem_details import Refused, loads, problem_document
from veselova.service.api.request_models import (
    ComparisonRequest,
    TorusRequest,
    TrajectoryRequest,
    read_request,
)
from veselova.service.api.sweep_request import SweepRequest

V3 = {"system": "veselova", "A": [3, "3/2", 1], "q": [0.6, 0, "0.8"], "q_dot": [0, 1, 0]}
PROBLEMS: list[dict[str, Any]] = [
    V3,
    {**V3, "normalize": True, "frame": [[0.6, 0.8, 0], [0, 0, 1], [0.8, -0.6, 0]]},
    {**V3, "A": [[3, 0.1, 0], [0.1, 2, 0], [0, 0, 1]]},
    {"system": "neumann", "A": [3, 2], "q": [1, 0], "q_prime": [0, 1]},
    {
        "system": "ellipsoid-geodesic",
        "A": [3, 2, 1],
        "X": [1, 1, 1],
        "X_dot": [1, -1, 0.2],
        "normalize": True,
    },
    {
        "system": "veselova-so3",
        "inertia": [1, 2, 3],
        "gamma": [0.6, 0, 0.8],
        "Omega": [0.8, 1, -0.6],
        "potential": {"clebsch": 1},
    },
    {"system": "euler-poisson", "inertia": [1, 2, 3], "gamma": [0, 0, 1], "Omega": [1, 0, 0.1]},
    {
        "system": "separable",
        "A": [3, 2, 1],
        "q": [0.6, 0, 0.8],
        "q_dot": [0, 1, 0],
        "potential": {"quartic": 1, "centrifugal": [1, 0, 0]},
    },
    {
        "system": "lr",
        "n": 3,
        "rank": 1,
        "inertia": {"special": [3, 2, 1]},
        "omega": [[0, 1, 0], [-1, 0, 0], [0, 0, 0]],
    },
    {
        "system": "stiefel",
        "inertia": {"special": [3, 2, 1]},
        "X": [[1], [0], [0]],
        "X_dot": [[0], [1], [0]],
    },
]
MOTION = {"times": [0, 1], "method": None, "outputs": None, "digits": 15, "budget_s": 3}
VARY = {"/A/0": {"start": 1, "stop": 2, "count": 3}, "/q_dot": {"normal": [0, 1]}, "/A/1": [1, "2"]}
KINDS: list[tuple[type[TorusRequest], dict[str, Any]]] = [
    (TorusRequest, {"budget_s": 3}),
    (ComparisonRequest, MOTION),
    (TrajectoryRequest, {**MOTION, "engine": "numeric", "certified": False}),
    (TrajectoryRequest, {**MOTION, "times": {"start": 0, "stop": "1/2", "count": 4}}),
    (SweepRequest, {"vary": VARY, "samples": 2, "seed": 3, "times": None}),
]
WRONG: list[Any] = [
    *(
        None,
        True,
        False,
        0,
        -1,
        1,
        15,
        1000,
        1e308,
        -1e-308,
        5e-324,
        1e-300,
        2**63,
        -(10**30),
        10**400,
        float("nan"),
        float("inf"),
    ),
    *(
        "",
        " ",
        "x",
        "1/0",
        "0/1",
        "1e400",
        "١",
        "1_000",
        "0x10",
        "∞",
        "\ud800",
        "\x00",
        "7/10" * 700,
        "/A/0",
        "~1",
    ),
    *("veselova", "lr", "analytic", "theta", "frame"),
    *([], [[]], [None], [0, 0, 0], [1, 0, 0], [[1, 0], [0, 1]], [1] * 65, [1e-300, 1e300, 1]),
    *(
        {},
        {"": 0},
        {"start": 0},
        {"start": 0, "stop": 1, "count": 10**9},
        {"uniform": [0, 1]},
        {"normal": [0, -1]},
    ),
    *(
        {"clebsch": None},
        {"polynomial": [{"coefficient": 1, "powers": [2, 0, 99]}]},
        {"special": [1, 1, 1]},
        {"matrix": [[1]]},
    ),
]


def mutated(document: Any, draw: random.Random) -> Any:
    """Return a document with one thing in it changed."""
    place: Any = document
    while True:
        keys = list(place) if isinstance(place, dict) else list(range(len(place)))
        if not keys:
            return document
        key = draw.choice(keys)
        if isinstance(place[key], (dict, list)) and place[key] and draw.random() < 0.7:
            place = place[key]
            continue
        action = draw.random()
        if action < 0.7:
            place[key] = copy.deepcopy(draw.choice(WRONG))
        elif action < 0.8:
            del place[key]
        elif isinstance(place, dict):
            place[draw.choice(["", "x", "/A/9", "times", "q", "é" * 50, "system"])] = copy.deepcopy(
                place[key]
            )
        else:
            place.append(copy.deepcopy(draw.choice(WRONG)))
        return document


def text_of(draw: random.Random) -> tuple[type[TorusRequest], bytes]:
    """Return the model of a request, and a text that nearly states one."""
    model, fields = draw.choice(KINDS)
    document = json.loads(json.dumps({"problem": draw.choice(PROBLEMS), **fields}))
    for _ in range(draw.choice((0, 1, 1, 2, 3))):
        document = mutated(document, draw)
    text = bytearray(json.dumps(document).encode("utf-8", "surrogatepass"))
    if draw.random() < 0.1:
        for _ in range(draw.randint(1, 4)):
            text[draw.randrange(len(text))] = draw.randrange(256)
    if draw.random() < 0.02:
        del text[draw.randrange(len(text)) :]
    return model, bytes(text)


def followed(model: type[TorusRequest], text: bytes) -> str:
    """Return how a text ends: ``valid``, or the code of its problem document."""
    try:
        request = read_request(model, loads(text))
        if isinstance(request, SweepRequest):
            request.request_of(request.values(request.total - 1))
    except (VeselovaError, Refused) as error:
        document = problem_document(error)
        json.dumps(document).encode()
        assert document["status"] < 500, document
        return str(document["type"]).rsplit(":", 1)[1]
    return "valid"


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 0
    warnings.simplefilter("ignore")  # of NumPy, over data at the ends of the range
    draw, ends, began = random.Random(seed), Counter[str](), time.perf_counter()
    for i in range(count):
        model, text = text_of(draw)
        try:
            ends[followed(model, text)] += 1
        except Exception as error:
            print(
                f"seed {seed}, text {i}, {model.__name__}: {type(error).__name__}: "
                f"{error}\n{text!r}"
            )
            raise SystemExit(1) from error
    print(
        f"{count} texts in {time.perf_counter() - began:.0f} s, no exception that is not a "
        f"refusal: {dict(ends)}"
    )


if __name__ == "__main__":
    main()
