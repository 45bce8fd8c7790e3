"""Names that are none: refused at once at every door, with the one that may have been meant, and
with all other faults.
"""

from __future__ import annotations

import pickle
from typing import Any

import pytest
from test_http import is_problem, post

import veselova as vs
from conftest import Server
from veselova.mechanics.core.errors import did_you_mean
from veselova.service.api.examples import BODY4_PROBLEM

COMPARED = {"path": "/v1/comparisons"}

NAMES = [
    ({**COMPARED, "method": "theta"}, "/method", None),
    ({**COMPARED, "method": "tailor"}, "/method", "taylor"),
    ({"method": "theeta"}, "/method", "theta"),
    ({"method": "theta", "engine": "numeric"}, "/method", None),
    ({"method": "dop583", "engine": "numeric"}, "/method", "dop853"),
    ({"engine": "numeric", "formulation": "reducde"}, "/formulation", "reduced"),
    ({"formulation": "reduced"}, "/formulation", None),
    ({"outputs": ["q", "fraem"]}, "/outputs/1", "frame"),
    ({"problem": {**BODY4_PROBLEM, "system": "veselovaa"}}, "/problem/system", "veselova"),
    ({"problem": {**BODY4_PROBLEM, "qdot": [1]}}, "/problem/qdot", "q_dot"),
    ({"outpust": ["q"]}, "/outpust", "outputs"),
]


@pytest.mark.parametrize(("change", "pointer", "meant"), NAMES)
def test_an_unknown_name_is_refused_at_once(
    server: Server, change: Any, pointer: str, meant: str | None
) -> None:
    body = {"problem": BODY4_PROBLEM, "times": [0, 1], **change}
    path = body.pop("path", "/v1/trajectories")
    document = is_problem(post(server, path, body), 422, "invalid-input")
    assert [error["pointer"] for error in document["errors"]] == [pointer]
    assert (f"(did you mean {meant}?)" in document["detail"]) == (meant is not None)


def test_attributes_that_are_none_name_the_nearest() -> None:
    with pytest.raises(
        AttributeError, match=r"no attribute 'Veselovaa' \(did you mean Veselova\?\)$"
    ):
        _ = vs.Veselovaa
    trajectory = vs.solve(vs.Veselova([3, 2, 1], [1, 0, 0], [0, 1, 1]), [0, 1])
    with pytest.raises(AttributeError, match=r"has no 'omga' \(did you mean omega\?\)$"):
        _ = trajectory.omga
    with pytest.raises(AttributeError, match=r"\(did you mean error\?\)$"):
        _ = trajectory.eror
    assert pickle.loads(pickle.dumps(trajectory)).error.shape == (2,)


def test_a_suggestion_is_near_or_none() -> None:
    assert did_you_mean("OMEGA", ["omega", "q"]) == " (did you mean omega?)"
    for given in ("zzz", "", 3, None, ["omega"], "omega" * 10**6):
        assert did_you_mean(given, ["omega", "q"]) == ""
