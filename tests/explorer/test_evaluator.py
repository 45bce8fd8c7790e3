"""The evaluator of the explorer, in Node, against the engine: every preset that has a closed form,
and bodies of two, three and four dimensions.
"""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from explorer_bundle import BALLS_IN_R4, EXPLORER, PRESETS, ball_in_r4, npm_or_skip

import veselova as vs
from veselova.mechanics.core.problem import Problem
from veselova.service.api.request_models import TorusRequest, read_request

#: Presets that the page takes from the service as series: one without a closed form, and one on a
#: separatrix.
SERIES = {"chaos", "umbilic"}

#: Times up to which twice a document's own error bounds the evaluator.
TIMES: list[Any] = [0, 0.25, -2.75, 1, 17.25, 123, 999.5, 10_000]

#: A time beyond, and the deviation that is allowed there.
FAR = 10**6, 1e-9

BODIES: dict[str, Problem] = {
    "plane": vs.Veselova([3, 2], ["0.6", "0.8"], ["0.8", "-0.6"]),
    "pairs of equal A": vs.Veselova([3, 3, 1, 1], ["0.5"] * 4, ["1.1", "-0.7", "0.3", "-0.7"]),
    "matrix": vs.Veselova(
        [["2.5", "0.25", 0], ["0.25", 2, "0.125"], [0, "0.125", 1]],
        ["0.6", 0, "0.8"],
        ["0.8", 1, "-0.6"],
    ),
    "neumann": vs.NeumannSystem([3, 2, 1], ["0.6", 0, "0.8"], ["0.8", 1, "-0.6"]),
    "area constant, matrix": vs.VeselovaSO3(
        [["1", "0.1", 0], ["0.1", "1.4", 0], [0, 0, 2]], ["0.6", 0, "0.8"], ["0.3", "-0.7", "0.9"]
    ),
    "area constant, equal moments": vs.VeselovaSO3(
        [1, 1, 2], ["0.6", 0, "0.8"], ["0.3", "-0.7", "0.9"]
    ),
    "ball with constant spin": vs.RubberBall(
        ["0.4", "0.6", "0.9"], "0.2", 1, ["0.6", 0, "0.8"], ["0.8", 1, "-0.3"]
    ),
    "Chaplygin's ball, one phase": vs.ChaplyginBall(
        ["0.6", "0.6", "0.6"], 1, 1, [0, "0.28", "0.96"], [0, "0.5", "0.8"]
    ),
    **{f"{name} in R^4": ball_in_r4(name) for name in BALLS_IN_R4},
}


def problems() -> dict[str, Problem]:
    """Return the problems of the presets that have a closed form, and further ones."""
    found = dict(BODIES)
    for name in PRESETS.keys() - SERIES:
        request = read_request(TorusRequest, {"problem": PRESETS[name]})
        found[name] = request.problem.problem
    return found


def case(name: str, problem: Problem, times: list[Any], bound: float | None) -> Any:
    """Return a document, what the engine has at these times, and the deviations allowed."""
    document = vs.closed_form(problem).document
    error = document["error"]
    truth = vs.solve(problem, times)
    bounds = (
        np.full(len(times), bound)
        if bound
        else 2
        * (
            float(error["at_start"])
            + float(error["per_unit_time"]) * np.abs(np.asarray(truth.times, float))
        )
    )
    found = {
        "name": f"{name}, far" if bound else name,
        "document": document,
        "times": [str(time) for time in times],
        "bounds": (bounds + truth.error).tolist(),
        "frame": truth.frame.tolist(),
    }
    if "path" in document or "shell" in document:
        found["position"] = truth.position.tolist()
    if "path" in document:
        found["drift"] = problem.drift.velocity.tolist()  # type: ignore[attr-defined]
    if "area" in document or "shell" in document:
        found["Omega"] = truth.Omega.tolist()
    if document["problem"]["system"] == "veselova" and not bound:
        found["velocity"] = truth.q_dot.tolist()
    return found


@pytest.mark.daily(4)
def test_the_evaluator_has_what_the_engine_has(tmp_path: Path) -> None:
    npm = npm_or_skip()
    cases = []
    for name, problem in problems().items():
        cases.append(case(name, problem, TIMES, None))
        try:
            cases.append(case(name, problem, [FAR[0]], FAR[1]))
        except vs.Unsolved as refusal:  # beside a separatrix modes are too many
            if refusal.outcome != "too-far":
                raise
    file = tmp_path / "cases.json"
    file.write_text(json.dumps(cases))
    answer = subprocess.run(
        [*npm, "test", "--silent"],
        cwd=EXPLORER,
        env={
            **os.environ,
            "PATH": f"{Path(npm[0]).parent}:{os.environ['PATH']}",
            "EVALUATOR_CASES": str(file),
        },
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert answer.returncode == 0, answer.stdout.partition("failing tests:")[2].strip()[:2000]
    assert f"tests {2 * len(cases) + 6}" in answer.stdout
