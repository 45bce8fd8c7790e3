"""What a stranger may do to a server: one test, at least, for each thing that it must withstand."""

from __future__ import annotations

import json
import os
import signal
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx2
import pytest
from starlette.testclient import TestClient
from test_http import is_problem, post

from conftest import PATIENCE, Server, running_server, wait_until
from hostile import ENDLESS, GOOD
from veselova.service.api.settings import Settings
from veselova.service.http.app import create_app


def test_halves_of_surrogate_pairs_are_refused(server: Server) -> None:
    is_problem(post(server, "/v1/tori", b'{"\\ud800":1}'), 422, "invalid-input")
    for path in ("/v1/trajectories", "/v1/tori", "/v1/sweeps"):
        for field in ("\ud800", "x\udfff"):
            is_problem(
                post(server, path, {**GOOD, field: field, "method": field, "engine": field}),
                422,
                "invalid-input",
            )


@contextmanager
def connected(server: Server) -> Iterator[socket.socket]:
    """A connection to a server."""
    address = urlsplit(server.url)
    with socket.create_connection((address.hostname, address.port), timeout=PATIENCE) as connection:
        yield connection


HEAD = b"POST /v1/tori HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"


OURS = ["localhost", "LOCALHOST:1", "127.0.0.1", "[::1]:80", "a.localhost"]
OTHERS = ["evil.example", "evil.example:8000", "127.0.0.1.evil.example", "localhost.evil.example"]
OTHERS += ["localhost:evil.example", "[::1].evil.example", "10.0.0.1"]


@pytest.mark.parametrize("host", [*OURS, *OTHERS])
def test_a_server_on_loopback_answers_under_names_of_loopback_alone(
    server: Server, host: str
) -> None:
    for path in ("/healthz", "/v1/systems", "/openapi.json", "/no-such-path"):
        answer = server.get(path, headers={"Host": host})
        assert (answer.status_code == 400) == (host in OTHERS)


@pytest.mark.parametrize(
    ("loopback", "settings", "status"),
    [
        (True, Settings(), 400),
        (True, Settings(allowed_hosts="a.example, evil.example"), 200),
        (True, Settings(allowed_hosts="*"), 200),
        (False, Settings(keys="off"), 400),  # a container whose port is mapped to loopback
        (False, Settings(keys="required"), 401),
    ],
)
def test_further_hosts_are_a_setting(
    loopback: bool, settings: Settings, status: int, tmp_path: Path
) -> None:
    app = create_app(settings.model_copy(update={"data_dir": tmp_path}), loopback=loopback)
    client = TestClient(app, base_url="http://evil.example:8000")
    assert client.get("/v1/systems").status_code == status


def test_a_host_has_no_port_in_the_settings() -> None:
    with pytest.raises(ValueError, match="allowed_hosts"):
        Settings(allowed_hosts="a.example:80")


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


def test_a_client_that_leaves_in_the_middle_of_a_body_is_no_failure(tmp_path: Path) -> None:
    with running_server(tmp_path, awaited="/healthz", log_format="json") as own:
        for path in (b"/v1/tori", b"/v1/sweeps"):
            with connected(own) as leaving:
                leaving.sendall(HEAD.replace(b"/v1/tori", path) + b"Content-Length: 1000\r\n\r\n{")
                time.sleep(0.2)
            wait_until(lambda path=path: logged(own, "client-gone")["route"] == path.decode())
            assert logged(own, "client-gone")["status"] == 499


@pytest.mark.daily(4)
@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGHUP])
def test_a_server_that_ends_finishes_what_is_under_way(
    tmp_path: Path, sent: signal.Signals
) -> None:
    """It and its workers hear of an interrupt, or of the end of a terminal, at once."""
    with running_server(tmp_path, workers="1") as own:
        answers: list[httpx2.Response] = []
        thread = threading.Thread(
            target=lambda: answers.append(post(own, "/v1/trajectories", GOOD))
        )
        (worker,) = own.workers()
        os.kill(worker, signal.SIGSTOP)
        thread.start()
        wait_until(lambda: own.at_work()[0] == 1)
        os.killpg(own.process.pid, sent)
        time.sleep(0.2)
        os.kill(worker, signal.SIGCONT)
        thread.join(PATIENCE)
        assert own.process.wait(PATIENCE) == 0
        assert "Traceback" not in own.log.read_text()
    assert answers[0].status_code == 200


@pytest.mark.daily(3)
def test_a_worker_whose_server_is_killed_ends_within_its_budget(tmp_path: Path) -> None:
    with running_server(tmp_path, workers="1") as own:

        def ask() -> None:
            with suppress(httpx2.TransportError):
                post(own, "/v1/trajectories", {**ENDLESS, "budget_s": 2})

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
