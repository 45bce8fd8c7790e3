"""Trajectories over HTTP in every format and coding, and what is kept of them."""

from __future__ import annotations

import io
import json
from typing import Any

import numpy as np
import pytest
from pyarrow import ipc, parquet
from starlette.datastructures import Headers
from test_http import is_problem, post

from conftest import Server
from deviations import decimals_of
from hostile import GOOD, PROBLEM
from veselova import solve
from veselova.service.api.media_types import FORMATS, negotiate_type
from veselova.service.api.problem_details import Refused

TYPES = {name: entry.media_type for name, entry in FORMATS.items()}

#: More numbers than fit into memory answers: these are files.
LARGE = {**GOOD, "times": {"start": 0, "stop": 20, "count": 20_000}, "engine": "numeric"}


def columns(kind: str, content: bytes) -> dict[str, Any]:
    """Return what a body holds, by the names of the flat table where it is one."""
    if kind == "json":
        document = json.loads(content)
        return {**document["series"], "times": document["times"], "error": document["error"]}
    if kind == "npz":
        with np.load(io.BytesIO(content)) as archive:
            return dict(archive)
    if kind == "csv":
        table = np.genfromtxt(io.BytesIO(content), delimiter=",", names=True)
        return {name: table[name] for name in table.dtype.names}
    table = (
        ipc.open_stream(content).read_all()
        if kind == "arrow"
        else parquet.read_table(io.BytesIO(content))
    )
    assert json.loads(table.schema.metadata[b"provenance"])["version"]
    return {name: table[name].to_numpy() for name in table.column_names}


@pytest.mark.daily(4)
@pytest.mark.parametrize("body", [{**GOOD, "engine": "numeric"}, LARGE], ids=["small", "large"])
@pytest.mark.parametrize("kind", list(FORMATS))
def test_every_format_has_series_error_integrals_and_provenance(
    server: Server, kind: str, body: dict[str, Any]
) -> None:
    response = post(
        server, "/v1/trajectories", {**body, "outputs": ["q", "tau1"]}, accept=TYPES[kind]
    )
    assert response.status_code == 200
    assert response.headers["content-type"] == TYPES[kind]
    times = [0, 1] if body["times"] == [0, 1] else np.linspace(0, 20, 20_000)
    expected, found = solve(PROBLEM, times, "numeric"), columns(kind, response.content)
    assert np.array_equal(found["tau1"], expected.tau1)
    assert np.array_equal(found["error"], expected.error)
    assert json.loads(response.headers["veselova-provenance"])["method"] == "dop853"
    if kind == "json":
        document = response.json()
        assert document["integrals"]["energy"]["drift"] == expected.drift["energy"]
        assert document["provenance"] == json.loads(response.headers["veselova-provenance"])
    else:
        assert np.array_equal(found["integral_energy"], expected.integrals["energy"])
        assert f'.{kind}"' in response.headers["content-disposition"]
    assert not [name for name in found if name.startswith("omega")]


def test_digits_come_along_where_a_format_has_them(server: Server) -> None:
    exact = {**GOOD, "digits": 30, "outputs": ["q"]}
    expected = decimals_of(solve(PROBLEM, [0, 1], digits=30))
    for kind, name in (("npz", "q_decimal"), ("json", "q"), ("csv", "q_1")):
        response = post(server, "/v1/trajectories", exact, accept=TYPES[kind])
        text = response.text if kind == "csv" else str(columns(kind, response.content)[name])
        assert str(expected.midpoints["q"][1, 0]) in text


@pytest.mark.parametrize(
    ("accept", "kind"),
    [
        ("text/csv", "csv"),
        ("application/json;q=0.5, application/x-npz;q=0.6", "npz"),
        ("*/*;q=0.1, application/vnd.apache.arrow.stream;q=0.2", "arrow"),
        ("application/json;q=0, application/*", "npz"),
        ("TEXT/*", "csv"),
        ("application/json;q=banana, text/csv;q=0.9", "json"),
        ("", "json"),
    ],
)
def test_the_best_of_what_a_client_accepts_is_served(
    server: Server, accept: str, kind: str
) -> None:
    answer = post(server, "/v1/trajectories", GOOD, accept=accept)
    assert answer.headers["content-type"] == TYPES[kind]


def test_what_is_on_offer_is_named_where_nothing_is_acceptable(server: Server) -> None:
    document = is_problem(
        post(server, "/v1/trajectories", GOOD, accept="text/html"), 406, "not-acceptable"
    )
    assert all(media_type in document["detail"] for media_type in TYPES.values())
    with pytest.raises(Refused, match="application/json"):
        negotiate_type(Headers({"accept": "text/csv"}), ["application/json"])


@pytest.mark.parametrize("coding", ["gzip", "identity"])
@pytest.mark.parametrize(
    "body",
    [{**GOOD, "times": {"start": 0, "stop": 2, "count": 100}}, LARGE],
    ids=["small", "large"],
)
def test_a_coding_changes_the_way_and_not_the_answer(
    server: Server, coding: str, body: dict[str, Any]
) -> None:
    kept, plain = (
        post(server, "/v1/trajectories", body, **{"accept-encoding": name})
        for name in (coding, "identity")
    )
    assert kept.headers.get("content-encoding", "identity") == coding
    found, expected = kept.json(), plain.json()
    for document in (found, expected):
        del document["provenance"]["seconds"]
    assert found == expected
    assert "Accept-Encoding" in kept.headers["vary"]
    if coding != "identity":
        assert kept.num_bytes_downloaded < len(plain.content) / 1.5
