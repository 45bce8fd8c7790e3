"""Who may ask: API keys, origins and security headers, through real
requests.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import subprocess
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import httpx2
import pytest
from test_http import is_problem

from conftest import Server, command_line, interpreter, running_server
from hostile import PROBLEM
from veselova import Client, InvalidInput, ProblemResponse
from veselova.service.access.keys import open_keys
from veselova.service.api.settings import Settings


def keys(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return command_line("keys", *arguments, VESELOVA_DATA_DIR=str(folder / "data"))


def new_key(folder: Path, name: str) -> dict[str, str]:
    with closing(open_keys(Settings(data_dir=folder / "data"))) as known:
        made, text = known.create(name)
    return {"id": made.id, "key": text}


def get(
    server: Server, path: str = "/v1/systems", key: str | None = None, **headers: str
) -> httpx2.Response:
    shown = {} if key is None else {"authorization": f"Bearer {key}"}
    return server.get(path, headers={**shown, **headers})


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("guarded")


@pytest.fixture(scope="module")
def key(folder: Path) -> str:
    answer = keys(folder, "create", "Sophie", "--json")
    assert answer.returncode == 0, answer.stderr
    return str(json.loads(answer.stdout)["key"])


@pytest.fixture(scope="module")
def guarded(folder: Path, key: str) -> Iterator[Server]:
    """A server that requires keys."""
    with running_server(
        folder, "--require-keys", cors_origins="https://a.example, https://b.example"
    ) as own:
        yield own


def test_a_key_is_shown_once_and_stored_as_a_hash(tmp_path: Path) -> None:
    created = keys(tmp_path, "create", "Sophie Kowalevski")
    text = created.stdout.strip()
    assert re.fullmatch(r"vsl_[0-9a-f]{12}_[\w-]{43}", text)
    assert "Keep it now" in created.stderr
    listed = keys(tmp_path, "list").stdout
    assert text.split("_")[1] in listed
    assert "Sophie Kowalevski" in listed
    secret = text[17:]
    assert secret not in listed + keys(tmp_path, "list", "--json").stdout
    stored = b"".join(file.read_bytes() for file in (tmp_path / "data").iterdir())
    assert secret.encode() not in stored
    assert hashlib.sha256(text.encode()).hexdigest().encode() in stored


def test_a_request_with_a_key_is_answered_and_one_without_is_refused(
    guarded: Server, key: str
) -> None:
    assert get(guarded, key=key).status_code == 200
    assert get(guarded, authorization=f"bearer  {key}").status_code == 200
    for path in ("/v1/systems", "/metrics", "/no-such-path"):
        response = get(guarded, path)
        is_problem(response, 401, "unauthorized")
        assert response.headers["www-authenticate"] == 'Bearer realm="veselova"'
        assert response.headers["cache-control"] == "no-store"
    assert is_problem(httpx2.post(f"{guarded.url}/v1/tori", json={}), 401, "unauthorized")


@pytest.mark.parametrize(
    "shown",
    [
        "Basic dXNlcjpwYXNz",
        "{key}",
        "Bearer {short}",
        "Bearer vsl_000000000000_" + "A" * 43,
        "Bearer " + "x" * 5000,
    ],
)
def test_what_is_no_key_of_the_server_is_refused(guarded: Server, key: str, shown: str) -> None:
    other = key[:17] + "A" * 43
    headers = {
        "authorization": shown.format(key=key, short=key[:-1], other=other).encode("latin-1")
    }
    response = guarded.get("/v1/systems", headers=headers)
    document = is_problem(response, 401, "unauthorized")
    assert response.headers["www-authenticate"] == 'Bearer realm="veselova", error="invalid_token"'
    assert key[17:] not in document["detail"]


def test_a_revoked_key_is_refused_from_the_next_request_on(guarded: Server, folder: Path) -> None:
    made = new_key(folder, "Carl")
    assert get(guarded, key=made["key"]).status_code == 200
    assert made["id"] in keys(folder, "revoke", made["id"]).stdout
    is_problem(get(guarded, key=made["key"]), 401, "unauthorized")
    listed = json.loads(keys(folder, "list", "--json").stdout)
    assert next(row for row in listed if row["id"] == made["id"])["revoked_at"]


def test_probes_and_the_contract_need_no_key(guarded: Server) -> None:
    for path in ("/healthz", "/readyz", "/openapi.json"):
        assert get(guarded, path).status_code == 200
    document = get(guarded, "/openapi.json").json()
    assert document["components"]["securitySchemes"] == {
        "key": {"type": "http", "scheme": "bearer"}
    }
    assert "401" in document["paths"]["/v1/tori"]["post"]["responses"]


def test_the_client_shows_its_key(
    guarded: Server, key: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("VESELOVA_API_KEY", raising=False)
    with Client(guarded.url, api_key=key) as client:
        assert client.torus(PROBLEM).n == 3
    with Client(guarded.url) as client, pytest.raises(ProblemResponse) as raised:
        client.torus(PROBLEM)
    assert raised.value.status == 401
    monkeypatch.setenv("VESELOVA_API_KEY", key)
    with Client(guarded.url) as client:
        assert client.torus(PROBLEM).n == 3
    with Client(guarded.url, api_key="") as client, pytest.raises(ProblemResponse):
        client.torus(PROBLEM)
    with pytest.raises(InvalidInput, match="api_key") as refused:
        Client(guarded.url, api_key=f"{key}\n")
    assert key not in str(refused.value)


def test_beyond_loopback_keys_are_required(tmp_path: Path) -> None:
    with running_server(tmp_path, "--host", "0.0.0.0", awaited="/healthz") as own:
        response = get(own)
        is_problem(response, 401, "unauthorized")
        log = own.log.read_text()
        assert "there is none yet" in log
        (line,) = [line for line in log.splitlines() if "--behind-proxy" in line]
        assert "compose.yaml" in line
        assert get(own, key=new_key(tmp_path, "Ada")["key"]).status_code == 200


@pytest.mark.slow
def test_whoever_wants_no_keys_beyond_loopback_says_so(tmp_path: Path) -> None:
    with running_server(tmp_path, "--host", "0.0.0.0", "--insecure") as own:
        assert get(own).status_code == 200
        assert "clients need no key" in own.log.read_text()


@pytest.mark.parametrize("believed", [True, False])
def test_a_proxy_that_is_named_tells_the_address(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, believed: bool
) -> None:
    monkeypatch.setenv("FORWARDED_ALLOW_IPS", "*")  # uvicorn's own variable says nothing here
    options = ["--forwarded-allow-ips", "127.0.0.1"] if believed else []
    with running_server(tmp_path, *options, awaited="/healthz", log_format="json") as own:
        get(own, **{"x-forwarded-for": "192.0.2.2"})
    address = "192.0.2.2" if believed else "127.0.0.1"
    assert f'"client": "{address}"' in own.log.read_text()


def test_pages_of_other_origins_are_not_invited(server: Server) -> None:
    response = get(server, origin="https://a.example")
    assert response.status_code == 200
    assert not [name for name in response.headers if name.startswith("access-control")]
    asked = {"origin": "https://a.example", "access-control-request-method": "POST"}
    is_problem(server.ask("OPTIONS", "/v1/tori", headers=asked), 405, "method-not-allowed")


def test_pages_of_stated_origins_are(guarded: Server, key: str) -> None:
    asked = {
        "origin": "https://b.example",
        "access-control-request-method": "POST",
        "access-control-request-headers": "authorization, content-type",
    }
    allowed = guarded.ask("OPTIONS", "/v1/tori", headers=asked)
    assert allowed.status_code == 200
    assert allowed.headers["access-control-allow-origin"] == "https://b.example"
    assert "access-control-allow-credentials" not in allowed.headers
    refused = guarded.ask("OPTIONS", "/v1/tori", headers={**asked, "origin": "https://c.example"})
    assert refused.status_code == 400
    assert "access-control-allow-origin" not in refused.headers
    for shown in (None, key):  # a page may read why it was refused, too
        answer = get(guarded, key=shown, origin="https://a.example")
        assert answer.headers["access-control-allow-origin"] == "https://a.example"
        assert "X-Request-ID" in answer.headers["access-control-expose-headers"]


@pytest.mark.parametrize(
    ("path", "status"),
    [("/healthz", 200), ("/v1/systems", 200), ("/v2", 404), ("/v1/tori", 405), ("/metrics", 200)],
)
def test_every_answer_tells_browsers_to_stay_away(server: Server, path: str, status: int) -> None:
    response = get(server, path)
    assert response.status_code == status
    assert response.headers["x-content-type-options"] == "nosniff"
    assert response.headers["x-frame-options"] == "DENY"
    assert response.headers["referrer-policy"] == "no-referrer"
    assert "default-src 'none'" in response.headers["content-security-policy"]
    assert "frame-ancestors 'none'" in response.headers["content-security-policy"]
    assert "server" not in response.headers
    assert (response.headers.get("cache-control") == "no-store") == (status >= 400)


#: Starts servers in one process, and prints with what status and words each ends before it listens.
STARTS = """
import contextlib, io, json, os, sys, uvicorn
from veselova.service.cli.main import main
uvicorn.run = lambda *_, **__: sys.exit("it listens")
for variables, arguments in json.load(sys.stdin):
    before, told = dict(os.environ), io.StringIO()
    os.environ.update(variables)
    sys.argv = ["veselova", "serve", "--port", "0", *arguments]
    with contextlib.redirect_stderr(told):
        try:
            main()
        except SystemExit as ended:
            print(json.dumps([ended.code, told.getvalue()]))
    os.environ.clear()
    os.environ.update(before)
"""


def ends_of_starts(
    folder: Path, rows: list[tuple[dict[str, str], list[str]]]
) -> list[tuple[int, str]]:
    """Return status and standard error of servers that are started with variables, by the names of
    settings, and arguments.
    """
    stated = [
        ({f"VESELOVA_{name.upper()}": value for name, value in variables.items()}, arguments)
        for variables, arguments in rows
    ]
    environment = {**os.environ, "VESELOVA_DATA_DIR": str(folder)}
    answer = interpreter("-c", STARTS, env=environment, input=json.dumps(stated))
    assert answer.returncode == 0, answer.stderr
    found = [json.loads(line) for line in answer.stdout.splitlines()]
    assert len(found) == len(rows)
    return found


SAYING_NOTHING = [
    ("cors_origins", "a.example"),
    ("cors_origins", "https://a.example/path"),
    ("keys", "perhaps"),
    ("log_format", "xml"),
    ("log_level", "loud"),
    ("database_url", "mysql://host/name"),
    ("database_url", "sqlite:///"),
    ("database_url", "sqlite:///:memory:"),
    ("database_url", "mysql://me:secret@host/name"),
    ("dask_scheduler", "tcp://192.0.2.1:8786"),
    ("dask_scheduler", "nowhere"),
    ("dask_scheduler", "tls://"),
    ("worker_memory_mb", "99999999999999"),
]


def test_a_setting_that_says_nothing_is_refused_at_the_start(tmp_path: Path) -> None:
    rows = [
        ({name: value}, ["--require-keys"] if name == "database_url" else [])
        for name, value in SAYING_NOTHING
    ]
    for (name, value), (status, told) in zip(
        SAYING_NOTHING, ends_of_starts(tmp_path, rows), strict=True
    ):
        assert status == 2, (name, value, told)
        assert told.startswith(f"veselova: VESELOVA_{name.upper()}: required "), (value, told)
        assert told.count("\n") == 1, (name, value, told)
        assert "secret" not in told


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        (("create", ""), 2, "NAME: required 1 to 100 printable characters"),
        (("create", "two\nlines"), 2, "NAME: required"),
        (("revoke", "000000000000"), 2, "ID: required the id of a key"),
        (("list", "--json"), 0, ""),
    ],
)
def test_mistakes_with_keys_are_one_sentence(
    arguments: tuple[str, ...], status: int, words: str, tmp_path: Path
) -> None:
    answer = keys(tmp_path, *arguments)
    assert answer.returncode == status
    assert words in answer.stderr
    assert answer.stderr.count("\n") <= 1


def test_what_clients_may_know_of_the_settings_are_numbers(guarded: Server, key: str) -> None:
    limits: dict[str, Any] = get(guarded, key=key).json()["limits"]
    assert limits["max_dimension"] == 64
    assert all(isinstance(value, (int, float)) for value in limits.values())
