"""What comes on a connection: requests in any pieces and order, heads without end, upgrades, broken
HTTP.
"""

from __future__ import annotations

import json
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from http.client import HTTPResponse
from typing import Any
from urllib.parse import urlsplit

import pytest

from conftest import PATIENCE, Server
from veselova.service.api.examples import BODY4_PROBLEM

HOST = b"Host: localhost\r\n"
HEALTH = b"GET /healthz HTTP/1.1\r\n" + HOST + b"\r\n"
UPGRADE = (
    b"Connection: Upgrade, HTTP2-Settings\r\nUpgrade: h2c\r\nHTTP2-Settings: "
    b"AAEAAEAAAAIAAAABAAMAAABkAAQBAAAAAAUAAEAA\r\n"
)


@contextmanager
def connected(server: Server) -> Iterator[socket.socket]:
    """A connection to a server."""
    address = urlsplit(server.url)
    with socket.create_connection((address.hostname, address.port), timeout=PATIENCE) as connection:
        yield connection


def received(connection: socket.socket, count: int) -> list[tuple[int, Any, str | None]]:
    """Return (status, body, Connection) of so many answers that come, or of those
    before the end.
    """
    answers = []
    stream = connection.makefile("rb")
    for _ in range(count):
        response = HTTPResponse(_Stream(stream))  # type: ignore[arg-type]
        try:
            response.begin()
        except ConnectionError:
            break
        answers.append((response.status, response.read(), response.getheader("connection")))
    return answers


class _Stream:
    """What HTTPResponse reads from: the stream of a connection that goes on after it."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream

    def makefile(self, _: str) -> Any:
        return self

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def close(self) -> None:
        """Leave the connection open."""


def posted(path: bytes, document: Any, fields: bytes = b"") -> bytes:
    """Return a whole POST of a JSON document."""
    body = json.dumps(document).encode()
    head = b"POST " + path + b" HTTP/1.1\r\n" + HOST + fields
    return head + b"Content-Type: application/json\r\nContent-Length: %d\r\n\r\n" % len(body) + body


def test_a_target_may_state_scheme_and_host(server: Server) -> None:
    name = server.url.encode()
    with connected(server) as connection:
        for target, host in (
            (name + b"/v1/systems?x=%0A", b"ignored.example"),
            (b"HTTP://localhost", b"localhost"),
            (b"http://evil.example/v1/systems", b"localhost"),
            (b"ftp://localhost/v1/systems", b"localhost"),
        ):
            connection.sendall(b"GET %b HTTP/1.1\r\nHost: %b\r\n\r\n" % (target, host))
        answers = received(connection, 4)
    assert [status for status, _, _ in answers] == [200, 200, 421, 404]
    assert "systems" in json.loads(answers[0][1])


def test_a_request_may_come_byte_by_byte(server: Server) -> None:
    with connected(server) as connection:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        for k in range(len(HEALTH)):
            connection.sendall(HEALTH[k : k + 1])
        ((status, body, _),) = received(connection, 1)
    assert (status, json.loads(body)["status"]) == (200, "ok")


def test_requests_that_do_not_wait_are_answered_in_order(server: Server) -> None:
    with connected(server) as connection:
        torus = posted(b"/v1/tori", {"problem": BODY4_PROBLEM})
        connection.sendall(torus + HEALTH + posted(b"/v1/tori", {}) + HEALTH)
        found = received(connection, 4)
    assert [status for status, _, _ in found] == [200, 200, 422, 200]
    assert "branch_points" in json.loads(found[0][1])
    assert json.loads(found[1][1])["status"] == "ok"


def test_many_requests_that_do_not_wait_are_all_answered(server: Server) -> None:
    with connected(server) as connection:
        connection.sendall(posted(b"/v1/tori", {"problem": BODY4_PROBLEM}) + 300 * HEALTH)
        found = received(connection, 301)
    assert [status for status, _, _ in found] == 301 * [200]


@pytest.mark.parametrize("body", ["", '{"problem": 3}'])
def test_a_request_to_upgrade_is_answered_as_if_it_did_not_ask(server: Server, body: str) -> None:
    """Java's own client asks for HTTP/2 in each of its first requests, whatever their bodies."""
    with connected(server) as connection:
        connection.sendall(HEALTH)
        received(connection, 1)
        if body:
            connection.sendall(posted(b"/v1/tori", json.loads(body), UPGRADE) + HEALTH)
        else:
            connection.sendall(b"GET /v1/systems HTTP/1.1\r\n" + HOST + UPGRADE + b"\r\n" + HEALTH)
        found = received(connection, 2)
    assert [status for status, _, _ in found] == [422 if body else 200, 200]
    if body:
        assert json.loads(found[0][1])["errors"][0]["pointer"] == "/problem"


def test_a_whole_body_comes_with_a_request_to_upgrade(server: Server) -> None:
    document = {"problem": {**BODY4_PROBLEM}, "budget_s": 60}
    request = posted(b"/v1/tori", document, UPGRADE)
    with connected(server) as connection:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        for first in range(0, len(request), 60):
            connection.sendall(request[first : first + 60])
        ((status, answer, _),) = received(connection, 1)
    assert status == 200
    assert "branch_points" in json.loads(answer)


def test_requests_to_upgrade_write_no_lines_of_their_own(server: Server) -> None:
    with connected(server) as connection:
        connection.sendall(3 * (HEALTH[:-2] + UPGRADE + b"\r\n"))
        assert len(received(connection, 3)) == 3
    lines = server.log.read_text().lower()
    assert "upgrade" not in lines
    assert "websocket" not in lines


CHUNKED = (
    b"POST /v1/tori HTTP/1.1\r\n"
    + HOST
    + b"Content-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\n"
)


@pytest.mark.parametrize("extension", [b"", b";" + 10_000 * b"a"], ids=["none", "long"])
def test_a_body_of_tiny_chunks_is_not_read_to_its_end(server: Server, extension: bytes) -> None:
    """Each chunk costs as much as a hundred bytes: a million of them took ten seconds."""
    piece = b"1" + extension + b"\r\n \r\n"
    with connected(server) as connection:
        connection.sendall(CHUNKED + 200_000 // len(piece) * piece)
        ((status, body, name),) = received(connection, 2)
    assert (status, json.loads(body)["type"], name) == (
        413,
        "urn:veselova:problem:body-too-large",
        "close",
    )


@pytest.mark.parametrize("size", [1, 200])
def test_a_body_may_come_in_many_chunks(server: Server, size: int) -> None:
    body = json.dumps({"problem": BODY4_PROBLEM}).encode() + (1000 + 900_000 * (size > 1)) * b" "
    chunks = [body[first : first + size] for first in range(0, len(body), size)]
    with connected(server) as connection:
        connection.sendall(CHUNKED)
        connection.sendall(b"".join(b"%x\r\n%b\r\n" % (len(part), part) for part in chunks))
        connection.sendall(b"0\r\n\r\n")
        ((status, answer, _),) = received(connection, 1)
    assert status == 200
    assert "branch_points" in json.loads(answer)


@pytest.mark.parametrize("before", [b"", HEALTH])
def test_an_invented_method_gets_its_problem_document_on_any_connection(
    server: Server, before: bytes
) -> None:
    with connected(server) as connection:
        if before:
            connection.sendall(before)
            received(connection, 1)
        connection.sendall(b"BREW /v1/tori HTTP/1.1\r\n" + HOST + b"\r\n")
        connection.sendall(HEALTH)
        (status, body, _), (after, _, _) = received(connection, 2)
    assert (status, json.loads(body)["type"], after) == (
        501,
        "urn:veselova:problem:unknown-method",
        200,
    )


BROKEN = {
    "space before a colon": b"GET /healthz HTTP/1.1\r\nHost : x\r\n\r\n",
    "two lengths": b"POST /v1/tori HTTP/1.1\r\n"
    + HOST
    + b"Content-Length: 3\r\nContent-Length: 4\r\n\r\nabcd",
    "noise": bytes(range(256)),
    "no chunk": b"POST /v1/tori HTTP/1.1\r\n"
    + HOST
    + b"Content-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\n2\r\n{}\r\nxyz\r\n",
}


@pytest.mark.parametrize("request_", BROKEN.values(), ids=BROKEN)
def test_what_is_no_http_gets_a_problem_document_and_the_end(
    server: Server, request_: bytes
) -> None:
    with connected(server) as connection:
        connection.sendall(request_)
        ((status, body, name),) = received(connection, 2)
    assert (status, json.loads(body)["type"], name) == (
        400,
        "urn:veselova:problem:malformed-http",
        "close",
    )
    assert server.get("/healthz").status_code == 200


ENDLESS = {
    "fields": (b"GET /healthz HTTP/1.1\r\n" + HOST, b"X-Many: 1\r\n"),
    "a field": (b"GET /healthz HTTP/1.1\r\n" + HOST + b"X-Long: ", b"a"),
    "an address": (b"GET /", b"a"),
    "empty lines": (b"", b"\r\n"),
    "a trailer": (
        b"POST /v1/tori HTTP/1.1\r\n"
        + HOST
        + b"Content-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\n2\r\n{}\r\n0\r\n",
        b"X-Many: 1\r\n",
    ),
    "an extension": (
        b"POST /v1/tori HTTP/1.1\r\n" + HOST + b"Transfer-Encoding: chunked\r\n\r\n2;",
        b"a",
    ),
    "fields to upgrade": (b"POST /v1/tori HTTP/1.1\r\n" + HOST + UPGRADE, b"X-Many: 1\r\n"),
}


@pytest.mark.parametrize(("begun", "repeated"), ENDLESS.values(), ids=ENDLESS)
def test_what_does_not_end_is_not_read(server: Server, begun: bytes, repeated: bytes) -> None:
    sent, piece = 0, repeated * (10_000 // len(repeated))
    with connected(server) as connection:
        connection.sendall(begun)
        with suppress(ConnectionError):
            while sent < 50_000_000:
                connection.sendall(piece)
                sent += len(piece)
    assert sent < 50_000_000
