"""Problem and job documents name no address, port, path, role or database: the log does."""

from __future__ import annotations

import errno
import re
import sqlite3
from pathlib import Path
from typing import Any

import psycopg
import pytest
import sqlalchemy as sa

from conftest import Server, free_port, running_server
from hostile import GOOD
from veselova.service.access.database import public_reason

SWEEP = {"problem": GOOD["problem"], "vary": {"/A/0": [3.5]}}

#: What a text for everybody has not: addresses, ports, paths, sources, databases and roles.
PRIVATE = re.compile(
    r"127\.0\.0\.1|localhost|::1|port \d|:\d{4,5}\b|postgres|sqlite:|psycopg|tcp:|tls:"
    r"|role|secret|/tmp/|/home/|/usr/|/var/|site-packages|\.py\b|\.db\b",
    re.IGNORECASE,
)


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (
            OSError(errno.ENOSPC, "No space left on device", "/srv/state/jobs"),
            "No space left on device",
        ),
        (OSError("Timed out trying to connect to tls://10.0.0.5:8786"), "it does not answer"),
        (ConnectionRefusedError(errno.ECONNREFUSED, "10.0.0.5:8786"), "Connection refused"),
        (
            sa.exc.OperationalError(
                "SELECT 1",
                {},
                psycopg.OperationalError(
                    'connection to server at "10.0.0.5", port 5432 failed: FATAL: role "ann"'
                ),
            ),
            "it does not answer",
        ),
        (
            sa.exc.OperationalError("SELECT 1", {}, sqlite3.OperationalError("database is locked")),
            "database is locked",
        ),
    ],
)
def test_what_the_storage_says_has_no_addresses(error: Exception, reason: str) -> None:
    assert public_reason(error) == reason


def refusals(server: Server, *answers: tuple[str, str, Any]) -> list[str]:
    """Return the texts of refusals, whose status and kind are looked at."""
    texts = []
    for method, path, body in answers:
        response = server.ask(method, path, json=body)
        assert response.status_code >= 400, (path, response.text)
        assert response.headers["content-type"] == "application/problem+json"
        texts.append(response.text)
    return texts


STORAGE = (
    ("GET", "/v1/jobs", None),
    ("GET", f"/v1/jobs/{'0' * 32}", None),
    ("GET", f"/v1/jobs/{'0' * 32}/result", None),
    ("GET", f"/v1/jobs/{'0' * 32}/events", None),
    ("DELETE", f"/v1/jobs/{'0' * 32}", None),
    ("POST", "/v1/sweeps", SWEEP),
)


def test_a_database_that_does_not_answer_is_not_described(tmp_path: Path) -> None:
    port = free_port()
    url = f"postgresql://ann:secret@127.0.0.1:{port}/motions"
    with running_server(tmp_path, awaited="/healthz", database_url=url) as own:
        texts = refusals(own, *STORAGE, ("GET", "/readyz", None))
        assert all("storage-unavailable" in text for text in texts[:-1]), texts
        for text in texts:
            assert not PRIVATE.search(text), text
            assert str(port) not in text
            assert "motions" not in text
        log = own.log.read_text()
    assert str(port) in log  # for whoever runs the server
    assert "secret" not in log


def test_a_folder_that_is_none_is_not_described(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    with running_server(tmp_path, awaited="/healthz", data_dir=str(tmp_path / "file")) as own:
        for text in refusals(own, *STORAGE, ("GET", "/readyz", None)):
            assert not PRIVATE.search(text), text
            assert str(tmp_path) not in text


def test_a_damaged_database_is_not_described(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir(mode=0o700)
    (tmp_path / "data" / "veselova.db").write_bytes(b"\x5a" * 5000)
    (tmp_path / "data" / "veselova.db").chmod(0o600)
    with running_server(tmp_path, awaited="/healthz") as own:
        for text in refusals(own, *STORAGE, ("GET", "/readyz", None)):
            assert not PRIVATE.search(text), text
            assert str(tmp_path) not in text
        assert str(tmp_path) in own.log.read_text()


def test_refusals_of_every_kind_name_nothing_of_the_server(server: Server) -> None:
    body = {**GOOD, "problem": {**GOOD["problem"], "A": ["x"]}}
    answers = (
        ("GET", "/v1/nothing", None),
        ("PUT", "/v1/tori", {}),
        ("POST", "/v1/trajectories", body),
        (
            "POST",
            "/v1/trajectories",
            {**GOOD, "times": [0, 1e6], "budget_s": 0.01, "engine": "numeric"},
        ),
        ("POST", "/v1/trajectories", [1]),
        ("POST", "/v1/sweeps", {**SWEEP, "vary": {"/B": [1]}}),
        ("GET", f"/v1/trajectories/{'0' * 64}", None),
        ("GET", f"/v1/jobs/{'0' * 32}", None),
        ("GET", "/v1/nothing", None),
    )
    for text in refusals(server, *answers):
        assert not PRIVATE.search(text), text
