"""What a stranger may do to a server: one test, at least, for each thing that it must withstand."""

from __future__ import annotations

import json
import os
import re
import resource
import signal
import socket
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx2
import pytest
from starlette.testclient import TestClient
from test_http import is_problem, post

from conftest import PATIENCE, Server, running_server, wait_until
from hostile import GOOD
from hostile_bodies import hostile_bodies, hostile_numbers, hostile_sweeps
from veselova.service.api.json_text import decode
from veselova.service.api.problem_details import Refused
from veselova.service.api.settings import Settings
from veselova.service.http.app import create_app
from veselova.service.http.connections import Connections
from veselova.service.http.hosts import allowed_hosts

#: The longest that a body may keep others waiting, in seconds.
LONGEST_WAIT = 0.1


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server of one worker that only these tests use."""
    with running_server(tmp_path_factory.mktemp("small"), workers="1") as running:
        yield running


def longest_wait(server: Server, path: str, body: bytes) -> tuple[float, httpx2.Response]:
    """Return the longest time that /healthz took while a body was answered, and the answer."""
    waits: list[float] = []
    begun, over = threading.Event(), threading.Event()

    def watch() -> None:
        with httpx2.Client(timeout=PATIENCE) as client:
            while not over.is_set():
                began = time.perf_counter()
                client.get(f"{server.url}/healthz")
                waits.append(time.perf_counter() - began)
                begun.set()
                time.sleep(0.01)

    watcher = threading.Thread(target=watch)
    watcher.start()
    try:
        assert begun.wait(PATIENCE)
        answer = post(server, path, body)
        time.sleep(0.05)
    finally:
        over.set()
        watcher.join()
    return max(waits), answer


BODIES = [
    *(("/v1/trajectories", *row) for row in hostile_bodies()),
    *(("/v1/sweeps", *row) for row in hostile_sweeps()),
    *hostile_numbers(),
]


@pytest.mark.parametrize(
    ("path", "body"), [(path, body) for path, _, body in BODIES], ids=[row[1] for row in BODIES]
)
def test_no_body_keeps_others_waiting(small: Server, path: str, body: bytes) -> None:
    # other processes may take the processors; the loop is held every time or never
    for _ in range(5):
        wait, answer = longest_wait(small, path, body)
        assert answer.status_code in (200, 202, 400, 422), answer.text[:300]
        if wait < LONGEST_WAIT:
            break
    assert wait < LONGEST_WAIT
    if answer.status_code == 202:
        small.ask("DELETE", f"/v1/jobs/{answer.json()['id']}", params={"remove": True})


def test_repeated_names_are_found_in_linear_time() -> None:
    def seconds(count: int) -> float:
        text = ("{" + ",".join(f'"{k // 2}":1' for k in range(count)) + "}").encode()
        began = time.process_time()
        with pytest.raises(ValueError, match="each field once"):
            decode(text)
        return time.process_time() - began

    # eight times as much: 8 where time is linear, up to 19 where dictionaries outgrow caches, 64
    # where it is quadratic
    seconds(1000)
    assert min(seconds(320_000) for _ in range(3)) < 24 * min(seconds(40_000) for _ in range(3))


def test_repeated_names_have_their_pointers(small: Server) -> None:
    text = json.dumps(GOOD)
    inner = text.replace(
        '"A": [3, 2, 1]', '"A": [3, 2, 1], "A": [{"b": 1, "b": 2}], "q": [1, 0, 0]'
    )
    document = is_problem(post(small, "/v1/trajectories", inner), 422, "invalid-input")
    assert [fault["pointer"] for fault in document["errors"]] == [
        "/problem/A",
        "/problem/q",
        "/problem/A/0/b",
    ]


def test_halves_of_surrogate_pairs_are_spelled_out(small: Server) -> None:
    document = is_problem(
        post(small, "/v1/tori", b'{"\\ud800":1,"\\ud800":2}'), 422, "invalid-input"
    )
    assert document["errors"][0]["pointer"] == "/\\ud800"
    for path in ("/v1/trajectories", "/v1/tori", "/v1/sweeps"):
        for field in ("\ud800", "x\udfff"):
            is_problem(
                post(small, path, {**GOOD, field: field, "method": field, "engine": field}),
                422,
                "invalid-input",
            )


@pytest.mark.parametrize("numeral", ["1e400", "-1e400", "1.5E+999", "NaN", "Infinity", "-Infinity"])
@pytest.mark.parametrize("field", ["A", "times", "budget_s"])
def test_numbers_beyond_the_range_are_shown_as_they_were_given(
    small: Server, numeral: str, field: str
) -> None:
    changed: dict[str, Any] = {**GOOD, "problem": {**GOOD["problem"]}}
    if field == "budget_s":
        changed[field] = "HERE"
    else:
        (changed["problem"] if field == "A" else changed)[field] = [3, 2, "HERE"]
    body = json.dumps(changed).replace('"HERE"', numeral)
    document = is_problem(post(small, "/v1/trajectories", body), 422, "invalid-input")
    assert any(fault["detail"].endswith(f"given {numeral}.") for fault in document["errors"])


@contextmanager
def connected(server: Server) -> Iterator[socket.socket]:
    """A connection to a server."""
    address = urlsplit(server.url)
    with socket.create_connection((address.hostname, address.port), timeout=PATIENCE) as connection:
        yield connection


def everything(connection: socket.socket) -> tuple[int, str, dict[str, Any]]:
    """Return status, Connection and document of the last answer on a connection, which ends after
    it.
    """
    received = b""
    with suppress(ConnectionError):
        while piece := connection.recv(65536):
            received += piece
    head, _, body = received.partition(b"\r\n\r\n")
    name = re.search(rb"(?i)\r\nconnection: (\S+)", head)
    return int(head.split()[1]), name[1].decode() if name else "", json.loads(body)


HEAD = b"POST /v1/tori HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
LIMITS = {
    "head_timeout_s": "1",
    "body_timeout_s": "7",
    "body_bytes_per_s": "1000",
    "send_timeout_s": "1",
    "max_connections": "40",
    "max_connections_per_address": "20",
    "log_format": "json",
}


@pytest.fixture(scope="module")
def strict(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server of short limits."""
    with running_server(tmp_path_factory.mktemp("strict"), **LIMITS) as running:
        yield running


def test_a_head_must_come_in_time(strict: Server) -> None:
    with connected(strict) as silent, connected(strict) as slow:
        slow.sendall(b"GET /healthz HTTP/1.1\r\nHost: loc")
        assert everything(slow)[:2] == (408, "close")
        assert silent.recv(1) == b""


def test_a_head_that_comes_byte_by_byte_must_come_in_time(strict: Server) -> None:
    with connected(strict) as slow, suppress(ConnectionError):
        began = time.monotonic()
        while time.monotonic() - began < PATIENCE:
            slow.sendall(b"X")
            time.sleep(0.1)
    assert time.monotonic() - began < PATIENCE / 2


def seconds_until_refused(server: Server, pause: float, piece: bytes) -> float:
    """Return after how long a body was refused of which a piece is sent after each pause."""
    with connected(server) as slow:
        slow.sendall(HEAD + b"Content-Length: 900000\r\n\r\n{")
        slow.settimeout(pause)
        answer = b""
        began = time.monotonic()
        while not answer and time.monotonic() - began < PATIENCE:
            with suppress(TimeoutError):
                answer = slow.recv(65536)
            if not answer:
                slow.sendall(piece)
        took = time.monotonic() - began
        while received := slow.recv(65536):  # the head may come before the document
            answer += received
    assert answer.startswith(b"HTTP/1.1 408 ")
    assert b"request-timeout" in answer
    return took


def test_a_body_must_come_fast_enough_and_end_in_time(strict: Server) -> None:
    """One that stops, and one that is slow, are refused before one that is fast and has no end."""
    bodies = [(100.0, b" "), (0.2, b" "), (0.1, b" " * 8000)]
    with ThreadPoolExecutor(len(bodies)) as pool:
        stops, slow, fast = pool.map(lambda one: seconds_until_refused(strict, *one), bodies)
    assert max(stops, slow) < fast < PATIENCE / 2


def test_an_answer_that_is_not_read_ends_its_connection(strict: Server) -> None:
    body = json.dumps(
        {**GOOD, "engine": "numeric", "times": {"start": 0, "stop": 10, "count": 40_000}}
    ).encode()
    before = open_sockets(strict)
    with connected(strict) as deaf:
        deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        head = HEAD.replace(b"/v1/tori", b"/v1/trajectories")
        deaf.sendall(head + b"Content-Length: %d\r\n\r\n" % len(body) + body)
        wait_until(lambda: open_sockets(strict) > before)
        wait_until(lambda: open_sockets(strict) <= before)


def open_sockets(server: Server) -> int:
    """Return how many connections a server has open to clients."""
    port = f":{urlsplit(server.url).port:04X}"
    lines = Path(f"/proc/{server.process.pid}/net/tcp").read_text().splitlines()[1:]
    return sum(line.split()[1].endswith(port) and line.split()[3] in ("01", "08") for line in lines)


def test_one_address_has_so_many_connections_and_no_more(strict: Server) -> None:
    with ExitStack() as stack:
        held = [stack.enter_context(connected(strict)) for _ in range(20)]
        with connected(strict) as further:
            status, name, document = everything(further)
        assert (status, name, document["type"]) == (
            503,
            "close",
            "urn:veselova:problem:too-many-connections",
        )
        held[0].sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
        assert everything(held[0])[0] == 200
    wait_until(lambda: strict.get("/healthz").status_code == 200)


def test_connections_are_limited_in_all() -> None:
    connections = Connections(Settings(max_connections=5, max_connections_per_address=2))
    for address in ("10.0.0.1", "10.0.0.1", "10.0.0.2", "2001:db8::1", "2001:db8::2"):
        connections.enter(address)
    for address in ("10.0.0.1", "10.0.0.3", "2001:db8::3"):
        with pytest.raises(Refused):
            connections.enter(address)
    connections.leave("10.0.0.1")
    with pytest.raises(Refused, match="address"):
        connections.enter("2001:db8:0:0:1::")
    connections.enter("10.0.0.1")


def test_descriptors_that_run_out_are_logged_once(tmp_path: Path) -> None:
    with running_server(
        tmp_path, max_connections_per_address="0", head_timeout_s="2", log_format="json"
    ) as own:
        resource.prlimit(own.process.pid, resource.RLIMIT_NOFILE, (30, 30))
        with ExitStack() as stack:
            for _ in range(60):
                stack.enter_context(connected(own))
            time.sleep(3)
        wait_until(lambda: own.get("/healthz").status_code == 200)
        lines = own.log.read_text().splitlines()
    assert sum("Too many open files" in line for line in lines) == 1
    assert len(lines) < 100
    assert not [line for line in lines if "Traceback" in line]


def test_length_and_chunks_together_end_the_connection(strict: Server) -> None:
    with connected(strict) as both:
        both.sendall(
            HEAD
            + b"Content-Length: 2\r\nTransfer-Encoding: chunked\r\n\r\n2\r\n{}\r\n0\r\n\r\nGET "
            b"/healthz HTTP/1.1\r\n\r\n"
        )
        status, name, document = everything(both)
    assert (status, name, document["type"]) == (400, "close", "urn:veselova:problem:malformed-http")


@pytest.mark.parametrize("field", [b"Content-Length: 5000000", b"Transfer-Encoding: chunked"])
def test_a_body_too_large_ends_the_connection_and_its_refusal_is_read(
    strict: Server, field: bytes
) -> None:
    with connected(strict) as large, suppress(ConnectionError):
        large.sendall(HEAD + field + b"\r\n\r\n")
        with suppress(ConnectionError):
            for _ in range(300):
                large.sendall((b"1388\r\n" if b"chunked" in field else b"") + b" " * 5000 + b"\r\n")
        status, name, document = everything(large)
        assert (status, name, document["type"]) == (
            413,
            "close",
            "urn:veselova:problem:body-too-large",
        )


def test_events_of_a_job_are_sent_for_longer_than_other_answers(strict: Server) -> None:
    sweep = {
        "problem": GOOD["problem"],
        "vary": {"/A/0": {"start": 3, "stop": 4, "count": 200_000}},
    }
    here = f"/v1/jobs/{post(strict, '/v1/sweeps', sweep).json()['id']}"
    began, seen = time.monotonic(), 0
    with httpx2.stream("GET", f"{strict.url}{here}/events", timeout=PATIENCE) as events:
        for _ in events.iter_lines():
            seen += 1
            if time.monotonic() - began > 3:
                break
    assert time.monotonic() - began > 3
    assert seen > 3
    strict.ask("DELETE", here, params={"remove": True})


@pytest.mark.parametrize(
    "host",
    [
        "evil.example",
        "evil.example:8000",
        "127.0.0.1.evil.example",
        "localhost.evil.example",
        "localhost:evil.example",
        "[::1].evil.example",
        "10.0.0.1",
    ],
)
def test_a_server_on_loopback_answers_under_no_name_of_others(small: Server, host: str) -> None:
    for path in ("/healthz", "/v1/systems", "/openapi.json", "/no-such-path"):
        document = is_problem(small.get(path, headers={"Host": host}), 421, "unknown-host")
        assert "evil" not in document["detail"]


@pytest.mark.parametrize(
    "host", ["localhost", "LOCALHOST:1", "127.0.0.1", "[::1]:80", "a.localhost", "127.9.9.9"]
)
def test_a_server_on_loopback_answers_under_every_name_of_loopback(
    small: Server, host: str
) -> None:
    assert small.get("/healthz", headers={"Host": host}).status_code == 200


def test_a_server_without_keys_answers_to_its_own_addresses_alone() -> None:
    with TestClient(create_app(Settings(keys="off")), base_url="http://127.0.0.1:8000") as client:
        assert client.get("/v1/systems").status_code == 200
        document = client.get("/v1/jobs", headers={"Host": "evil.example"})
        is_problem(document, 421, "unknown-host")


def test_further_hosts_are_a_setting() -> None:
    for stated, loopback, keyed, hosts in (
        ("auto", False, True, None),
        ("auto", True, False, set()),
        ("auto", True, True, set()),
        ("auto", False, False, set()),  # as of a container whose port is mapped to loopback
        ("*", True, False, None),
        ("A.example, [::2]", False, True, {"a.example", "::2"}),
    ):
        assert allowed_hosts(Settings(allowed_hosts=stated), loopback, keyed) == hosts
    with pytest.raises(ValueError, match="without ports"):
        Settings(allowed_hosts="a.example:80")


@pytest.mark.parametrize(
    "path", ["/healthz/", "/v1/tori/", "/v1/jobs/", "//evil.example/v1/systems", "/docs/"]
)
def test_nothing_is_redirected(small: Server, path: str) -> None:
    answer = small.get(path)
    assert answer.status_code in (404, 405)
    assert "location" not in answer.headers


def test_readiness_names_no_address_port_or_role(tmp_path: Path) -> None:
    address = "postgresql://secretrole:secret@127.0.0.1:1/nothing"
    with running_server(tmp_path, awaited="/healthz", database_url=address) as own:
        document = is_problem(own.get("/readyz"), 503, "not-ready")
        assert "Jobs cannot be stored" in document["detail"]
        assert not re.search(r"secret|127\.0|port|nothing|role", json.dumps(document))


def logged(server: Server, outcome: str) -> dict[str, Any]:
    """Return the line of the last request with an outcome, once it is there; nothing has failed
    with a traceback by then.
    """

    def lines() -> list[dict[str, Any]]:
        found = [
            json.loads(line) for line in server.log.read_text().splitlines() if line.startswith("{")
        ]
        return [line for line in found if line.get("outcome") == outcome]

    wait_until(lines)
    assert "Traceback" not in server.log.read_text()
    return lines()[-1]


@pytest.mark.parametrize("path", ["/v1/tori", "/v1/sweeps"])
def test_a_client_that_leaves_in_the_middle_of_a_body_is_no_failure(
    strict: Server, path: str
) -> None:
    with connected(strict) as leaving:
        leaving.sendall(HEAD.replace(b"/v1/tori", path.encode()) + b"Content-Length: 1000\r\n\r\n{")
        time.sleep(0.2)
    wait_until(lambda: logged(strict, "client-gone")["route"] == path)
    assert logged(strict, "client-gone")["status"] == 499


def test_broken_chunks_are_malformed(strict: Server) -> None:
    with connected(strict) as broken:
        broken.sendall(HEAD + b"Transfer-Encoding: chunked\r\n\r\n2\r\n{}\r\nxyz\r\n")
        assert everything(broken)[:2] == (400, "close")
    assert logged(strict, "malformed-http")["status"] == 400


@pytest.mark.parametrize("sent", [signal.SIGTERM, signal.SIGHUP])
def test_a_server_that_ends_answers_what_it_has_not_read(
    tmp_path: Path, sent: signal.Signals
) -> None:
    """It, and whoever works for it, hear of the end of a terminal, or of a service, at once."""
    with running_server(tmp_path, workers="1", shutdown_grace_s=str(int(PATIENCE))) as own:
        answers: list[httpx2.Response] = []
        thread = threading.Thread(
            target=lambda: answers.append(post(own, "/v1/trajectories", GOOD))
        )
        (worker,) = own.workers()
        os.kill(worker, signal.SIGSTOP)
        with connected(own) as upload:
            upload.sendall(HEAD + b"Content-Length: 1000\r\n\r\n{")
            thread.start()
            wait_until(lambda: own.at_work()[0] == 1)
            os.killpg(own.process.pid, sent)
            status, name, document = everything(upload)
        os.kill(worker, signal.SIGCONT)
        thread.join(PATIENCE)
        assert own.process.wait(PATIENCE) == 0
        assert "Traceback" not in own.log.read_text()
    assert (status, name, document["type"]) == (503, "close", "urn:veselova:problem:shutting-down")
    assert answers[0].status_code == 200  # what was under way is finished
    assert answers[0].headers["connection"] == "close"


def test_a_worker_whose_server_is_killed_ends_within_its_budget(tmp_path: Path) -> None:
    with running_server(tmp_path, workers="1") as own:
        endless = {**GOOD, "times": [0, 1e7], "engine": "numeric", "budget_s": 2}

        def ask() -> None:
            with suppress(httpx2.TransportError):
                post(own, "/v1/trajectories", endless)

        asking = threading.Thread(target=ask)
        asking.start()
        wait_until(lambda: own.at_work() == (1, 0))
        workers = own.workers()
        own.process.kill()
        own.process.wait()
        wait_until(lambda: not any(alive(worker) for worker in workers))
        asking.join(PATIENCE)


def alive(process: int) -> bool:
    """Return whether a process runs: one that nobody has waited for is none."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False
