"""The Python client before foreign or broken servers, and its arguments: a named exception for
everything, and no file that is not a result.
"""

from __future__ import annotations

import asyncio
import inspect
import io
import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import httpx2
import numpy as np
import pytest

from hostile import GOOD, PROBLEM
from veselova import AsyncClient, Client, InvalidInput, ProblemResponse, ServiceError
from veselova.service.api.media_types import MEDIA_TYPES

VARY = {"/A/0": [3, 4]}
MANY = {name: [GOOD["problem"][name]] for name in ("A", "q", "q_dot")}
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

#: Every method that asks a server, those of its jobs with a point, and what it is asked.
ASKED: dict[str, dict[str, Any]] = {
    "trajectory": {"problem": PROBLEM, "times": [0, 1]},
    "compare": {"problem": PROBLEM, "times": [0, 1]},
    "solve_many": {"problems": MANY, "times": [0, 1]},
    "torus": {"problem": PROBLEM},
    "closed_form": {"problem": PROBLEM},
    "curve": {"branch_points": [0, 1, 2]},
    "theta": {"z": [0.1], "tau": [[1j]]},
    "geodesics": {"ellipsoid": "Mars", "P": [0, 0], "Q": [1, 1]},
    "download": {"problem": PROBLEM, "times": [0, 1], "target": "motion.npz"},
    "sweep": {"problem": PROBLEM, "vary": VARY},
    **{f"job.{name}": {} for name in ("status", "wait", "cancel", "remove", "dataset")},
    "job.download": {"target": "table.parquet"},
}


def ask(client: Any, method: str, **changes: Any) -> Any:
    """Return what a method of a client, or of a job, gives."""
    owner = client.job("some") if method.startswith("job.") else client
    return getattr(owner, method.removeprefix("job."))(**ASKED.get(method, {}) | changes)


@pytest.fixture(autouse=True)
def in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def answered(
    ask: Callable[[Any], Any],
    answer: Callable[[httpx2.Request], Any],
    asynchronous: bool,
    attempts: int = 1,
) -> Any:
    """Return what a method gives where a server answers so."""
    transport = httpx2.MockTransport(answer)
    if not asynchronous:
        with Client("http://server", attempts=attempts, transport=transport) as client:
            return ask(client)

    async def later() -> Any:
        async with AsyncClient("http://server", attempts=attempts, transport=transport) as client:
            found = ask(client)
            return await found if inspect.isawaitable(found) else found

    return asyncio.run(later())


@pytest.mark.parametrize("asynchronous", [False, True])
@pytest.mark.parametrize(
    ("status", "headers", "body"),
    [
        (200, HTML, b"<html>sign in"),
        (200, JSON, b"<html>sign in"),
        *((200, JSON, body) for body in (b"null", b"5", b"[1]", b"[" * 10_000)),
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

    for method in ASKED:
        with pytest.raises(ServiceError, match=r"http://server\S* (answered|failed)"):
            answered(partial(ask, method=method), answer, asynchronous)


TABLE = {"content-type": MEDIA_TYPES["parquet"]}


@pytest.mark.parametrize("asynchronous", [False, True])
@pytest.mark.parametrize(
    ("status", "headers", "body"),
    [
        (200, HTML, b"<html>sign in"),
        (200, {"content-type": MEDIA_TYPES["csv"]}, b"t"),
        (204, {}, b""),
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

    for method, changes in (("download", {"format": "parquet"}), ("job.download", {})):
        download = partial(ask, method=method, target=path, **changes)
        with pytest.raises(ServiceError, match="http://server"):
            answered(download, answer, asynchronous)
        assert path.read_text() == "good"
        assert [entry.name for entry in tmp_path.iterdir()] == [path.name]


def test_a_download_without_provenance_leaves_no_file(tmp_path: Path) -> None:
    path = tmp_path / "new.parquet"
    with pytest.raises(ServiceError, match="something else than a result"):
        answered(
            partial(ask, method="download", target=path, format="parquet"),
            lambda _: httpx2.Response(200, headers=TABLE, content=b"PAR1"),
            False,
        )
    assert not path.exists()


def unsent(_: httpx2.Request) -> httpx2.Response:
    pytest.fail("a request was sent")


@pytest.mark.parametrize(
    ("field", "values"),
    [
        ("base_url", ["http://[::1", "http://h:x", "http://h\n", "h", "ftp://h", 5, None]),
        ("attempts", [float("nan"), float("inf"), 0, 10**30, "x", None, 1.5]),
        ("api_key", [5, b"key", "two words"]),
    ],
)
def test_a_client_without_use_is_refused(field: str, values: list[Any]) -> None:
    for value in values:
        for kind in (Client, AsyncClient):
            with pytest.raises(InvalidInput, match=rf"^{field}: "):
                kind(**{field: value})


HUGE = 10**400


@pytest.mark.parametrize("asynchronous", [False, True])
@pytest.mark.parametrize(
    ("method", "field", "values"),
    [
        *(
            (method, "budget_s", ["10", None, HUGE, True, 0, -1, float("nan"), float("inf")])
            for method in ("torus", "trajectory", "download", "solve_many", "curve", "theta")
        ),
        ("trajectory", "engine", ["\ud800", object()]),
        ("trajectory", "digits", [10**30]),
        ("closed_form", "accuracy", [float("nan"), -1]),
        ("download", "format", [[], None, "cvs"]),
        ("download", "outputs", [[object()], ["\ud800"]]),
        ("download", "target", ["no/x", ".", io.StringIO(), 5, b"x"]),
        ("job.download", "target", ["no/x", io.BytesIO()]),
        ("job", "job_id", ["", "..", "../systems", "\ud800", "a\n", "a" * 70_000, 5, None]),
        ("sweep", "vary", [{5: [3]}, {None: [3]}, {b"/A/0": [3]}, {("/A/0",): [3]}]),
    ],
)
def test_arguments_are_refused_before_anything_is_sent(
    tmp_path: Path, method: str, field: str, values: list[Any], asynchronous: bool
) -> None:
    for value in values:
        with pytest.raises(InvalidInput, match=rf"^{field}\b"):
            answered(partial(ask, method=method, **{field: value}), unsent, asynchronous)
    assert not list(tmp_path.iterdir())


def test_arrays_serve_as_the_numbers_of_a_request() -> None:
    bodies: list[Any] = []

    def keep(request: httpx2.Request) -> httpx2.Response:
        bodies.append(json.loads(request.content))
        return httpx2.Response(404, json={})

    problem = {name: np.array(value) for name, value in GOOD["problem"].items() if name != "system"}
    for given in ({**problem, "system": GOOD["problem"]["system"]}, PROBLEM):
        with pytest.raises(ProblemResponse):
            answered(
                partial(
                    ask,
                    method="trajectory",
                    problem=given,
                    digits=np.int64(15),
                    budget_s=np.float64(2),
                ),
                keep,
                False,
            )
    assert bodies[0] == bodies[1]
    assert (bodies[0]["digits"], bodies[0]["budget_s"]) == (15, 2)


@pytest.mark.parametrize("asynchronous", [False, True])
def test_a_client_stays_closed(asynchronous: bool) -> None:
    clients: list[Any] = []
    with pytest.raises(ProblemResponse):
        answered(
            lambda client: clients.append(client) or client.torus(PROBLEM),
            lambda _: httpx2.Response(418),
            asynchronous,
        )
    with pytest.raises(ServiceError, match="closed"):
        asyncio.run(as_coroutine(lambda: clients[0].torus(PROBLEM)))


async def as_coroutine(use: Callable[[], Any]) -> Any:
    return await use()


def test_a_redirect_is_named() -> None:
    moved = httpx2.Response(308, headers={"location": "https://new/v1"})
    with pytest.raises(ProblemResponse, match="HTTP 308: a redirect to https://new/v1, which is"):
        answered(partial(ask, method="torus"), lambda _: moved, False)
