"""Trajectories over HTTP in every format and coding, and what is kept of them."""

from __future__ import annotations

import io
import json
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx2
import numpy as np
import pytest
import zstandard
from pyarrow import ipc, parquet
from test_http import is_problem, post

from conftest import PATIENCE, Server, running_server, slow, wait_until
from hostile import GOOD
from veselova import Trajectory, Veselova, solve
from veselova.service.api.content_negotiation import negotiate_coding, negotiate_type
from veselova.service.api.media_types import FORMATS
from veselova.service.api.problem_details import Refused

PROBLEM = Veselova(GOOD["problem"]["A"], GOOD["problem"]["q"], GOOD["problem"]["q_dot"])
TYPES = {name: entry.media_type for name, entry in FORMATS.items()}

#: More numbers than fit into memory answers: these go through the spool.
LARGE = {**GOOD, "times": {"start": 0, "stop": 20, "count": 20_000}, "engine": "numeric"}


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server with a cache that no other test fills."""
    with running_server(tmp_path_factory.mktemp("answers"), workers="1") as running:
        yield running


def get(address: str, **headers: str) -> httpx2.Response:
    return httpx2.get(address, headers=headers, timeout=PATIENCE)


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


@pytest.mark.parametrize("body", [{**GOOD, "engine": "numeric"}, LARGE], ids=["small", "large"])
@pytest.mark.parametrize("kind", list(FORMATS))
def test_every_format_has_series_error_integrals_and_provenance(
    own: Server, kind: str, body: dict[str, Any]
) -> None:
    response = post(own, "/v1/trajectories", {**body, "outputs": ["q", "tau1"]}, accept=TYPES[kind])
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


def test_digits_come_along_where_a_format_has_them(own: Server) -> None:
    exact = {**GOOD, "digits": 30, "outputs": ["q"]}
    expected = solve(PROBLEM, [0, 1], digits=30).decimals
    assert expected is not None
    for kind, name in (("npz", "q_decimal"), ("json", "q"), ("csv", "q_1")):
        response = post(own, "/v1/trajectories", exact, accept=TYPES[kind])
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
def test_the_best_of_what_a_client_accepts_is_served(own: Server, accept: str, kind: str) -> None:
    assert post(own, "/v1/trajectories", GOOD, accept=accept).headers["content-type"] == TYPES[kind]


def test_what_is_on_offer_is_named_where_nothing_is_acceptable(own: Server) -> None:
    document = is_problem(
        post(own, "/v1/trajectories", GOOD, accept="text/html"), 406, "not-acceptable"
    )
    assert all(media_type in document["detail"] for media_type in TYPES.values())
    with pytest.raises(Refused, match="application/json"):
        negotiate_type("text/csv", ["application/json"])


@pytest.mark.parametrize("coding", ["zstd", "gzip", "identity"])
@pytest.mark.parametrize(
    "body",
    [{**GOOD, "times": {"start": 0, "stop": 2, "count": 100}}, LARGE],
    ids=["small", "large"],
)
def test_a_coding_changes_the_way_and_not_the_answer(
    own: Server, coding: str, body: dict[str, Any]
) -> None:
    kept, plain = (
        post(own, "/v1/trajectories", body, **{"accept-encoding": name})
        for name in (coding, "identity")
    )
    assert kept.headers.get("content-encoding", "identity") == coding
    content = (
        zstandard.ZstdDecompressor().decompressobj().decompress(kept.content)
        if coding == "zstd"
        else kept.content
    )
    assert content == plain.content
    assert "Accept-Encoding" in kept.headers["vary"]
    if coding != "identity":
        assert int(kept.headers["content-length"]) < len(plain.content) / 1.5


def test_what_is_compressed_already_is_not_compressed_again(own: Server) -> None:
    response = post(
        own, "/v1/trajectories", LARGE, accept=TYPES["npz"], **{"accept-encoding": "zstd"}
    )
    assert "content-encoding" not in response.headers


@pytest.mark.parametrize(
    ("header", "coding"),
    [
        (None, "identity"),
        ("", "identity"),
        ("br", "identity"),
        ("gzip, deflate, br, zstd", "zstd"),
        ("zstd;q=0.5, gzip", "gzip"),
        ("*", "zstd"),
        ("*;q=0", "identity"),
        ("gzip;q=0.5, identity", "identity"),
        ("GZIP", "gzip"),
    ],
)
def test_the_coding_is_the_one_that_a_client_prefers(header: str | None, coding: str) -> None:
    assert negotiate_coding(header) == coding


def test_a_request_spelt_out_has_the_tag_of_the_short_one(own: Server) -> None:
    def tag(body: dict[str, Any], kind: str = "json") -> str:
        response = post(own, "/v1/trajectories", body, accept=TYPES[kind])
        assert response.status_code == 200
        return response.headers["etag"]

    spelt = {
        "engine": "analytic",
        "digits": 15,
        "certified": False,
        "method": None,
        "budget_s": 50,
        "outputs": list(PROBLEM.outputs),
    }
    floats = {
        "problem": {**GOOD["problem"], "A": [3.0, 2.0, 1.0], "normalize": False},
        "times": [0.0, 1.0],
    }
    assert tag(GOOD) == tag({**GOOD, **spelt}) == tag(floats)
    others = [
        tag({**GOOD, **change})
        for change in ({"times": [0, 2]}, {"outputs": ["q"]}, {"engine": "numeric"})
    ]
    assert len({tag(GOOD), tag(GOOD, "csv"), *others}) == 5


def test_a_trajectory_is_kept_at_its_own_address_in_every_format(own: Server) -> None:
    body = {**GOOD, "times": [0, 3, 4], "outputs": ["frame", "omega"]}
    made = post(own, "/v1/trajectories", body)
    address = f"{own.url}{made.headers['content-location']}"
    assert "cache-control" not in made.headers
    assert "cache-status" not in made.headers
    expected = solve(PROBLEM, [0, 3, 4])
    for kind, media_type in TYPES.items():
        kept = get(address, accept=media_type)
        assert kept.status_code == 200
        assert kept.headers["cache-control"] == "private, max-age=31536000, immutable"
        assert kept.headers["cache-status"] == "veselova; hit"
        assert kept.headers["veselova-provenance"] == made.headers["veselova-provenance"]
        found = columns(kind, kept.content)
        assert np.array_equal(
            found["frame" if kind in ("json", "npz") else "frame_1_1"].__getitem__(-1),
            _last(expected, kind),
        )
        unchanged = get(address, **{"accept": media_type, "if-none-match": kept.headers["etag"]})
        assert (unchanged.status_code, unchanged.content) == (304, b"")
        assert unchanged.headers["etag"] == kept.headers["etag"]
        head = httpx2.head(address, headers={"accept": media_type}, timeout=PATIENCE)
        assert (head.status_code, head.content, head.headers["etag"]) == (
            200,
            b"",
            kept.headers["etag"],
        )
    assert get(address).json() == made.json()
    again = post(own, "/v1/trajectories", body)
    assert again.headers["cache-status"] == "veselova; hit"
    assert again.content == made.content


def _last(expected: Trajectory, kind: str) -> Any:
    return expected.frame[-1] if kind in ("json", "npz") else expected.frame[-1, 0, 0]


def test_a_post_of_what_the_client_has_is_answered_with_412(own: Server) -> None:
    """RFC 9110, 13.1.2: 304 answers GET and HEAD alone."""
    tag = post(own, "/v1/trajectories", GOOD).headers["etag"]
    document = is_problem(
        post(own, "/v1/trajectories", GOOD, **{"if-none-match": f'"x", {tag}'}),
        412,
        "precondition-failed",
    )
    assert tag in document["detail"]
    assert post(own, "/v1/trajectories", GOOD, **{"if-none-match": '"x"'}).status_code == 200


@pytest.mark.parametrize("name", ["0" * 64, "0", "..%2f..%2fetc%2fpasswd", "A" * 64])
def test_what_is_not_kept_is_a_404_problem(own: Server, name: str) -> None:
    response = get(f"{own.url}/v1/trajectories/{name}")
    is_problem(response, 404, "not-found" if "%2f" in name else "no-such-answer")


def kept_files(folder: Path) -> list[Path]:
    return sorted((folder / "data" / "cache").glob("*.kept"))


@pytest.mark.parametrize("damage", ["flipped", slow("truncated"), slow("emptied")])
def test_a_damaged_entry_is_removed_and_computed_again(tmp_path: Path, damage: str) -> None:
    with running_server(tmp_path, workers="1") as own:
        made = post(own, "/v1/trajectories", GOOD)
        (path,) = kept_files(tmp_path)
        content = bytearray(path.read_bytes())
        content[len(content) // 3] ^= 0xFF
        path.write_bytes(
            {"flipped": bytes(content), "truncated": bytes(content[:-100]), "emptied": b""}[damage]
        )
        is_problem(get(f"{own.url}{made.headers['content-location']}"), 404, "no-such-answer")
        assert not kept_files(tmp_path)
        assert "is damaged and was removed" in own.log.read_text()
        again = post(own, "/v1/trajectories", GOOD)
        assert "cache-status" not in again.headers
        assert again.json()["series"] == made.json()["series"]
        wait_until(lambda: kept_files(tmp_path) == [path])


def test_an_answer_can_be_had_again_at_once_and_is_on_the_disk_when_the_server_has_ended(
    tmp_path: Path,
) -> None:
    with (
        running_server(tmp_path, workers="1") as own,
        httpx2.Client(base_url=own.url, timeout=PATIENCE) as client,
    ):
        for k in range(1, 20):
            made = client.post("/v1/trajectories", json={**GOOD, "times": [0, k]})
            again = client.get(made.headers["content-location"])
            assert again.headers["cache-status"] == "veselova; hit"
            assert again.content == made.content
        last = client.post("/v1/trajectories", json={**GOOD, "times": [0, 20]})
        own.process.send_signal(signal.SIGTERM)
        client.close()
        assert own.process.wait(20) == 0
    assert len(kept_files(tmp_path)) == 20
    with running_server(tmp_path, workers="1") as other:
        assert get(f"{other.url}{last.headers['content-location']}").content == last.content


@pytest.mark.slow
def test_servers_share_what_they_keep(tmp_path: Path) -> None:
    shared = str(tmp_path / "data")
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
    with running_server(tmp_path / "one", workers="1", data_dir=shared) as one:
        made = post(one, "/v1/trajectories", GOOD)
        with running_server(tmp_path / "two", workers="1", data_dir=shared) as two:
            assert get(f"{two.url}{made.headers['content-location']}").content == made.content


@pytest.mark.parametrize(
    "obstacle", ["a file in its place", slow("a folder that is too small"), slow("no size at all")]
)
def test_without_a_cache_answers_are_the_same(tmp_path: Path, obstacle: str) -> None:
    (tmp_path / "data").mkdir()
    if obstacle == "a file in its place":
        (tmp_path / "data" / "cache").write_text("")
    size = {"a folder that is too small": "100", "no size at all": "0"}.get(obstacle, "1000000")
    with running_server(tmp_path, workers="1", cache_bytes=size) as own:
        for _ in range(2):
            response = post(own, "/v1/trajectories", GOOD)
            assert response.json()["series"]["q"] == solve(PROBLEM, [0, 1]).q.tolist()
            assert "content-location" not in response.headers
            assert response.headers["etag"]
        lines = own.log.read_text().count("answers are not cached")
        assert lines == (obstacle == "a file in its place")


def test_a_spool_that_cannot_be_made_is_replaced_by_the_temporary_folder(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "spool").write_text("")
    with running_server(tmp_path, workers="1") as own:
        assert post(own, "/v1/trajectories", LARGE, accept=TYPES["npz"]).status_code == 200
        assert "cannot hold large answers" in own.log.read_text()
