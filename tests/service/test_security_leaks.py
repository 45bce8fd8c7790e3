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
from test_http import post
from test_security_storage import damage_database

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


@pytest.mark.daily(4)
@pytest.mark.parametrize("broken", ["database", "folder", "file"])
def test_a_server_without_storage_answers_the_rest_and_does_not_describe_it(
    tmp_path: Path, broken: str
) -> None:
    """A database that does not answer, a folder that is none, a file that is damaged."""
    port, settings, reason = free_port(), {}, str(tmp_path)
    if broken == "database":
        settings["database_url"] = f"postgresql://ann:secret@127.0.0.1:{port}/motions"
        reason = str(port)
    elif broken == "folder":
        (tmp_path / "file").write_text("no folder")
        settings["data_dir"] = str(tmp_path / "file")
    else:
        damage_database(tmp_path / "data")
    with running_server(tmp_path, awaited="/healthz", **settings) as own:
        assert post(own, "/v1/tori", {"problem": GOOD["problem"]}).status_code == 200
        texts = refusals(own, *STORAGE, ("GET", "/readyz", None))
        assert all("storage-unavailable" in text for text in texts[:-1]), texts
        assert all("Jobs cannot be stored" in text for text in texts), texts
        assert ("database-damaged" in texts[0]) == (broken == "file")
        for text in texts:
            assert not PRIVATE.search(text), text
            assert not [name for name in (str(port), "motions", str(tmp_path)) if name in text]
        log = own.log.read_text()
    assert reason in log  # for whoever runs the server
    assert "secret" not in log
    assert "Traceback" not in log


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
