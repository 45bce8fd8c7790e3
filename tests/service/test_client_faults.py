"""The Python client before foreign or broken servers: a named exception for every answer, and no
file that is not a result.
"""

from __future__ import annotations

import asyncio
import inspect
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx2
import pytest

from hostile import GOOD
from veselova import AsyncClient, Client, ProblemResponse, ServiceError, Veselova, solve
from veselova.service.client.download import MEDIA_TYPES

PROBLEM = Veselova(GOOD["problem"]["A"], GOOD["problem"]["q"], GOOD["problem"]["q_dot"])
VARY = {"/A/0": [3, 4]}
JOB = {
    "id": "some",
    "state": "finished",
    "detail": "",
    "done": 2,
    "total": 2,
    "finished_at": "2026-11-26T12:00:00Z",
    "links": {},
    "request": {"problem": PROBLEM.as_request(), "vary": VARY},
}
JSON = {"content-type": "application/json"}
HTML = {"content-type": "text/html"}

#: Every method that asks a server, by name.
METHODS: dict[str, Callable[[Any], Any]] = {
    "trajectory": lambda client: client.trajectory(PROBLEM, [0, 1]),
    "compare": lambda client: client.compare(PROBLEM, [0, 1]),
    "solve_many": lambda client: client.solve_many([PROBLEM], [0, 1]),
    "torus": lambda client: client.torus(PROBLEM),
    "closed_form": lambda client: client.closed_form(PROBLEM),
    "curve": lambda client: client.curve([0, 1, 2]),
    "theta": lambda client: client.theta([0.1], [[1j]]),
    "download": lambda client: client.download(PROBLEM, [0, 1], io.BytesIO()),
    "sweep": lambda client: client.sweep(PROBLEM, VARY),
    "status": lambda client: client.job("some").status(),
    "wait": lambda client: client.job("some").wait(),
    "cancel": lambda client: client.job("some").cancel(),
    "remove": lambda client: client.job("some").remove(),
    "job.download": lambda client: client.job("some").download(io.BytesIO()),
    "dataset": lambda client: client.job("some").dataset(),
}


def answered(
    ask: Callable[[Any], Any], answer: Callable[[httpx2.Request], Any], asynchronous: bool
) -> Any:
    """Return what a method gives where a server answers so; each is asked once."""
    transport = httpx2.MockTransport(answer)
    if not asynchronous:
        with Client("http://server", attempts=1, transport=transport) as client:
            return ask(client)

    async def later() -> Any:
        async with AsyncClient("http://server", attempts=1, transport=transport) as client:
            found = ask(client)
            return await found if inspect.isawaitable(found) else found

    return asyncio.run(later())


def of_parts(job: Any, result: httpx2.Response) -> Callable[[httpx2.Request], httpx2.Response]:
    """Return a server of one job, whose table is the given answer."""
    return lambda request: (
        result if request.url.path.endswith("/result") else httpx2.Response(200, json=job)
    )


@pytest.mark.parametrize("asynchronous", [False, True])
@pytest.mark.parametrize(
    ("status", "headers", "body"),
    [
        (200, HTML, b"<html>sign in"),
        (200, JSON, b"<html>sign in"),
        (200, {}, b"{}"),
        (206, JSON, b"{}"),
        *((200, JSON, body) for body in (b"{}", b"[]", b"null", b"5", b"[" * 10_000)),
        (202, JSON, b'{"id": 5}'),
        (202, JSON, json.dumps({**JOB, "id": "\ud800"}).encode()),
        (200, {**JSON, "content-encoding": "gzip"}, b"no gzip"),
        (503, {**JSON, "content-encoding": ",".join(["gzip"] * 9)}, b"{}"),
    ],
)
def test_an_answer_that_is_no_result_is_a_service_error(
    asynchronous: bool, status: int, headers: dict[str, str], body: bytes
) -> None:
    def answer(_: httpx2.Request) -> httpx2.Response:
        return httpx2.Response(status, headers=headers, stream=httpx2.ByteStream(body))

    for ask in METHODS.values():
        with pytest.raises(ServiceError, match=r"http://server\S* answered"):
            answered(ask, answer, asynchronous)


@pytest.mark.parametrize("charset", ["hex", "zip", "undefined", "idna", "rot13", "utf-16", "none"])
def test_a_refusal_in_any_charset_is_a_problem_response(charset: str) -> None:
    headers = {"content-type": f"text/html; charset={charset}"}
    with pytest.raises(ProblemResponse, match="busy") as raised:
        answered(
            METHODS["torus"],
            lambda _: httpx2.Response(500, headers=headers, content=b"busy \x80"),
            False,
        )
    assert raised.value.status == 500


@pytest.mark.parametrize("pause", [b"\xb2", "٣".encode(), b"-1", b"nan", b"9" * 400])
def test_any_retry_after_is_read(pause: bytes) -> None:
    headers = [(b"retry-after", pause)]
    with pytest.raises(ProblemResponse):
        answered(METHODS["torus"], lambda _: httpx2.Response(429, headers=headers), False)


@pytest.mark.parametrize("rows", [[7], [-1e300], ["x"], 5])
def test_an_ensemble_of_other_rows_is_a_service_error(rows: Any) -> None:
    document = {
        "outcome": ["solved"],
        "times": [0, 1],
        "rows": rows,
        "series": {},
        "error": [[0, 0]],
        "detail": [""],
        "together": [True],
        "provenance": solve(PROBLEM, [0, 1]).provenance.as_dict(),
    }
    with pytest.raises(ServiceError, match="something else than a result"):
        answered(METHODS["solve_many"], lambda _: httpx2.Response(200, json=document), False)


@pytest.mark.parametrize("asynchronous", [False, True])
@pytest.mark.parametrize("field", [name for name in JOB if name != "request"])
def test_the_document_of_a_job_has_its_fields(field: str, asynchronous: bool) -> None:
    for document in ({**JOB, field: []}, {name: JOB[name] for name in JOB if name != field}):
        for name in ("status", "wait", "cancel", "job.download", "dataset"):
            with pytest.raises(ServiceError, match="something else than a result"):
                answered(
                    METHODS[name],
                    lambda _, document=document: httpx2.Response(200, json=document),
                    asynchronous,
                )


TABLE = {"content-type": MEDIA_TYPES["parquet"]}


@pytest.mark.parametrize("asynchronous", [False, True])
@pytest.mark.parametrize(
    ("job", "status", "headers"),
    [(JOB, 200, TABLE), (JOB, 200, HTML), ({**JOB, "request": None}, 200, TABLE)],
)
def test_a_table_that_is_none_makes_no_dataset(
    asynchronous: bool, job: Any, status: int, headers: dict[str, str]
) -> None:
    table = httpx2.Response(status, headers=headers, content=b"<html>sign in")
    with pytest.raises(ServiceError, match="something else than a result"):
        answered(METHODS["dataset"], of_parts(job, table), asynchronous)


@pytest.mark.parametrize("asynchronous", [False, True])
@pytest.mark.parametrize(
    ("status", "headers", "body"),
    [
        (200, HTML, b"<html>sign in"),
        (200, {"content-type": MEDIA_TYPES["csv"]}, b"t"),
        (204, {}, b""),
        (206, TABLE | {"veselova-provenance": "{}"}, b"PAR1"),
        (200, TABLE | {"content-encoding": "gzip", "veselova-provenance": "{}"}, b"no gzip"),
    ],
)
def test_what_is_no_result_leaves_a_file_as_it_was(
    tmp_path: Path, asynchronous: bool, status: int, headers: dict[str, str], body: bytes
) -> None:
    path = tmp_path / "good.parquet"
    path.write_text("good")

    def answer(request: httpx2.Request) -> httpx2.Response:
        if request.url.path == "/v1/jobs/some":
            return httpx2.Response(200, json=JOB)
        return httpx2.Response(status, headers=headers, stream=httpx2.ByteStream(body))

    for ask in (
        lambda client: client.download(PROBLEM, [0, 1], path, "parquet"),
        lambda client: client.job("some").download(path),
    ):
        with pytest.raises(ServiceError, match="http://server"):
            answered(ask, answer, asynchronous)
        assert path.read_text() == "good"
        assert [entry.name for entry in tmp_path.iterdir()] == [path.name]


def test_a_download_without_provenance_leaves_no_file(tmp_path: Path) -> None:
    path = tmp_path / "new.parquet"
    with pytest.raises(ServiceError, match="something else than a result"):
        answered(
            lambda client: client.download(PROBLEM, [0, 1], path, "parquet"),
            lambda _: httpx2.Response(200, headers=TABLE, content=b"PAR1"),
            False,
        )
    assert not path.exists()
