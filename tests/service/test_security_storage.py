"""What the service keeps: its first start, damage, whose it is, how much there may be, for how
long, who else may touch it.
"""

from __future__ import annotations

import asyncio
import json
import os
import signal
import socket
import sqlite3
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import AsyncIterator, Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager, closing, suppress
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import anyio
import httpx2
import pytest
import sqlalchemy as sa
from pydantic import SecretStr
from starlette.requests import Request
from test_access import keys
from test_http import JSON, is_problem
from test_sweeps import request as sweep_request

from conftest import PATIENCE, Server, running_server, wait_until
from hostile import GOOD
from postgresql import new_database, postgresql_server, settings_in
from veselova.mechanics.core.errors import InvalidInput
from veselova.service.access import database, patient_connection
from veselova.service.access.database import (
    api_keys,
    connect,
    idempotency_keys,
    jobs,
    schema_differences,
    writing,
)
from veselova.service.access.keys import Keys, open_keys
from veselova.service.access.middleware import Access
from veselova.service.access.sqlite_wal import wal_is_damaged
from veselova.service.api import private_folder, settings
from veselova.service.api.problem_details import Refused
from veselova.service.api.settings import Settings
from veselova.service.cli.key_expiry import expiry
from veselova.service.http.job_routes import _JobRoutes
from veselova.service.http.job_service import JobService
from veselova.service.http.readiness import Readiness
from veselova.service.observability.metrics import Metrics
from veselova.service.sweeps import idempotency, job_limits, job_store
from veselova.service.sweeps.job_limits import JOB_BYTES, promised_bytes
from veselova.service.sweeps.job_store import Jobs, job_id_of
from veselova.service.sweeps.runner import Sweeps
from veselova.service.workers.pool import Workers

NOW = datetime.now(UTC)


@pytest.fixture(scope="module")
def postgresql() -> Iterator[str]:
    with postgresql_server() as address:
        yield address


@pytest.fixture(params=["sqlite", "postgresql"])
def store(request: pytest.FixtureRequest, tmp_path: Path) -> Settings:
    """Settings with a folder and a database of their own."""
    return settings_in(tmp_path / "data", request)


def changed(store: Settings, **values: Any) -> Settings:
    return store.model_copy(update=values)


def together(call: Callable[[int], Any], count: int) -> list[Any]:
    """Return what a call gives or raises in so many threads that begin at once."""
    begin = threading.Barrier(count)

    def one(i: int) -> Any:
        begin.wait()
        try:
            return call(i)
        except Exception as error:
            return error

    with ThreadPoolExecutor(count) as pool:
        return list(pool.map(one, range(count)))


# The first start


def in_a_child(call: Callable[[], Any]) -> int:
    """Return the status of a process of its own that makes a call: 0 where it returns, 1 where it
    raises.
    """
    child = os.fork()
    if child == 0:
        with suppress(BaseException):
            call()
            os._exit(0)
        os._exit(1)
    return os.waitpid(child, 0)[1]


def scripted(body: str, folder: Path) -> list[str]:
    """Return the lines that a process without threads prints, which may therefore fork."""
    script = (
        f"import sys; sys.path[:0] = {sys.path!r}\nfrom test_security_storage import "
        f"*\nfolder = Path({str(folder)!r})\n{body}"
    )
    answer = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert answer.returncode == 0, answer.stderr
    return answer.stdout.splitlines()


def test_a_first_start_that_is_killed_anywhere_leaves_a_database_that_opens(tmp_path: Path) -> None:
    body = """
def start(data_dir, last):
    seen = []
    def count(*_):
        seen.append(1)
        if len(seen) == last:
            os.kill(os.getpid(), 9)
    sa.event.listen(sa.Engine, "before_cursor_execute", count)
    sa.event.listen(sa.Engine, "commit", count)
    connect(Settings(data_dir=data_dir))

for last in range(1, 200):
    data_dir = folder / str(last)
    killed = in_a_child(lambda: start(data_dir, last)) == 9
    engine = connect(Settings(data_dir=data_dir))
    assert schema_differences(engine) == []
    engine.dispose()
    print(killed)
    if not killed:
        break
"""
    outcomes = scripted(body, tmp_path)
    assert len(outcomes) > 20
    assert outcomes == ["True"] * (len(outcomes) - 1) + ["False"]


def test_a_first_start_on_a_full_disk_leaves_a_database_that_opens(tmp_path: Path) -> None:
    body = """
import resource
def start(data_dir, size):
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
    try:
        connect(Settings(data_dir=data_dir))
    except sa.exc.OperationalError:
        os._exit(3)

for size in range(0, 400_000, 8192):
    data_dir = folder / str(size)
    status = os.waitstatus_to_exitcode(in_a_child(lambda: start(data_dir, size)))
    engine = connect(Settings(data_dir=data_dir))
    assert schema_differences(engine) == []
    engine.dispose()
    print(status)
    if status == 0:
        break
"""
    outcomes = scripted(body, tmp_path)
    assert len(outcomes) > 3
    assert outcomes == ["3"] * (len(outcomes) - 1) + ["0"]


def test_first_starts_that_race_all_succeed(store: Settings, tmp_path: Path) -> None:
    body = f"""
from pydantic import SecretStr
address = {store.database_url.get_secret_value()!r}
settings = Settings(data_dir=folder, database_url=SecretStr(address))
begin = time.time() + 0.5
def start():
    time.sleep(max(begin - time.time(), 0))
    connect(settings)
children = []
for _ in range(6):
    child = os.fork()
    if child == 0:
        status = 1
        with suppress(BaseException):
            start()
            status = 0
        os._exit(status)
    children.append(child)
print(*[os.waitpid(child, 0)[1] for child in children])
"""
    assert scripted(body, store.data_dir) == ["0 0 0 0 0 0"]
    engine = connect(store)
    assert schema_differences(engine) == []
    engine.dispose()


#: The tables of version 0.1.0.
OLD_TABLES = (
    "CREATE TABLE jobs (id VARCHAR(32) NOT NULL PRIMARY KEY, request TEXT NOT NULL, state "
    "VARCHAR(16) NOT NULL, "
    "detail TEXT DEFAULT '' NOT NULL, total BIGINT NOT NULL, chunk_rows INTEGER NOT NULL, "
    "created_at TIMESTAMP WITH TIME ZONE NOT NULL, finished_at TIMESTAMP WITH TIME ZONE)",
    "CREATE INDEX ix_jobs_state ON jobs (state)",
    "CREATE TABLE chunks (job_id VARCHAR(32) NOT NULL, position INTEGER NOT NULL, rows "
    "INTEGER NOT NULL, "
    "sha256 VARCHAR(64) NOT NULL, PRIMARY KEY (job_id, position), FOREIGN KEY(job_id) "
    "REFERENCES jobs (id) ON DELETE CASCADE)",
    "CREATE TABLE idempotency_keys (key VARCHAR(255) NOT NULL, job_id VARCHAR(32) NOT NULL, "
    "PRIMARY KEY (key), "
    "FOREIGN KEY(job_id) REFERENCES jobs (id) ON DELETE CASCADE)",
    "CREATE TABLE api_keys (id VARCHAR(16) NOT NULL, name VARCHAR(100) NOT NULL, sha256 "
    "VARCHAR(64) NOT NULL, "
    "created_at TIMESTAMP WITH TIME ZONE NOT NULL, revoked_at TIMESTAMP WITH TIME ZONE, "
    "PRIMARY KEY (id), UNIQUE (sha256))",
)


def old_database(store: Settings, statements: tuple[str, ...]) -> None:
    stated = store.database_url.get_secret_value()
    store.data_dir.mkdir(mode=0o700)
    url = (
        stated.replace("postgresql:", "postgresql+psycopg:")
        or f"sqlite:///{store.data_dir / 'veselova.db'}"
    )
    engine = sa.create_engine(url)
    with engine.begin() as connection:
        for statement in statements:
            dated = (
                statement if stated else statement.replace("TIMESTAMP WITH TIME ZONE", "DATETIME")
            )
            connection.execute(sa.text(dated))
    engine.dispose()


def test_a_database_of_the_first_version_is_brought_up_to_date_with_what_it_holds(
    store: Settings,
) -> None:
    sweep = sweep_request()
    at = "2026-01-01 00:00:00.000000" + ("+00:00" if store.database_url.get_secret_value() else "")
    job = f"('{sweep.id}', '{sweep.canonical.decode()}', 'finished', '', 15, 15, '{at}', '{at}')"
    rows = (
        f"INSERT INTO jobs VALUES {job}".replace(":", r"\:"),
        f"INSERT INTO idempotency_keys VALUES ('mine', '{sweep.id}')",
        rf"INSERT INTO api_keys VALUES ('0123456789ab', 'Ada', 'hash', '{at}', NULL)".replace(
            ":", r"\:"
        ),
        "CREATE TABLE alembic_version (version_num VARCHAR(32) NOT NULL PRIMARY KEY)",
        "INSERT INTO alembic_version VALUES ('0001')",
    )
    old_database(store, (*OLD_TABLES, *rows))
    with closing(Jobs(store)) as opened:
        assert schema_differences(opened._engine) == []
        job = opened.get(sweep.id, "")
        assert (job.owner, job.bytes) == ("", len(sweep.canonical) + JOB_BYTES)
        with pytest.raises(InvalidInput, match="another request"):
            opened.submit(sweep_request(seed=9), "mine")
    with closing(open_keys(store)) as known:
        assert [(key.scope, key.owner, key.state) for key in known.list()] == [
            ("solve", "0123456789ab", "valid")
        ]


@pytest.mark.parametrize("made", range(1, len(OLD_TABLES) + 1))
def test_a_first_start_that_the_first_version_left_half_done_is_done_now(
    tmp_path: Path, made: int
) -> None:
    store = Settings(data_dir=tmp_path / "data")
    old_database(store, OLD_TABLES[:made])
    engine = connect(store)
    assert schema_differences(engine) == []
    engine.dispose()


def test_a_database_of_a_later_version_is_named(tmp_path: Path) -> None:
    engine = connect(Settings(data_dir=tmp_path))
    with writing(engine) as connection:
        connection.execute(sa.text("UPDATE alembic_version SET version_num = '9999'"))
    engine.dispose()
    with pytest.raises(Refused, match="later version") as raised:
        connect(Settings(data_dir=tmp_path))
    assert raised.value.code == "database-newer"


# Damage


@pytest.fixture(scope="module")
def killed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder whose server was killed with five keys in its log."""
    folder = tmp_path_factory.mktemp("killed")
    scripted(
        "known = open_keys(Settings(data_dir=folder))\nfor i in range(5): "
        "known.create(f'n{i}')\nos._exit(0)",
        folder,
    )
    return folder


def copied(killed: Path, folder: Path) -> tuple[Path, Path]:
    """Return the database and the log of a copy."""
    (folder / "data").mkdir(mode=0o700)
    for path in killed.iterdir():
        (folder / "data" / path.name).write_bytes(path.read_bytes())
    return folder / "data" / "veselova.db", folder / "data" / "veselova.db-wal"


@pytest.mark.parametrize("start", [0, 1, 8, 32 + 20, 32 + 24 + 100, 32 + 4120 + 5], ids=str)
@pytest.mark.parametrize("length", [1, 300, 5000])
def test_a_damaged_log_ends_in_a_named_error_and_an_instruction(
    killed: Path, tmp_path: Path, start: int, length: int
) -> None:
    """SQLite itself takes what comes before the damage, and forgets the rest without a word."""
    database, log = copied(killed, tmp_path)
    content = bytearray(log.read_bytes())
    content[start : start + length] = bytes(byte ^ 0x5A for byte in content[start : start + length])
    log.write_bytes(content)
    before = database.read_bytes(), log.read_bytes()
    with pytest.raises(Refused) as raised:
        open_keys(Settings(data_dir=tmp_path / "data"))
    assert raised.value.code == "database-damaged"
    assert "veselova.db-wal does not hold what was written" in raised.value.detail
    assert "move veselova.db, veselova.db-wal and veselova.db-shm" in raised.value.detail
    assert (database.read_bytes(), log.read_bytes()) == before


@pytest.mark.parametrize("content", [b"garbage" * 100, bytes(100) + b"x" * 5000])
def test_what_is_no_log_is_named_on_the_command_line(
    killed: Path, tmp_path: Path, content: bytes
) -> None:
    copied(killed, tmp_path)[1].write_bytes(content)
    answer = keys(tmp_path, "list")
    assert answer.returncode == 2
    assert "is damaged: its log veselova.db-wal does not hold what was written" in answer.stderr
    assert answer.stderr.count("\n") == 1


def test_a_log_that_ends_in_the_midst_of_a_transaction_is_not_damaged(
    killed: Path, tmp_path: Path
) -> None:
    log = copied(killed, tmp_path)[1]
    content = log.read_bytes()
    assert not wal_is_damaged(log)
    for left in (len(content) - 1, len(content) - 5000, len(content) // 2, 40, 32, 3, 0):
        log.write_bytes(content[:left])
        assert not wal_is_damaged(log)
    # what some file systems leave of a file that was not yet on the disk
    log.write_bytes(bytes(len(content)))
    assert not wal_is_damaged(log)
    log.write_bytes(content)
    with closing(open_keys(Settings(data_dir=tmp_path / "data"))) as known:
        assert len(known.list()) == 5


def test_the_tables_of_a_first_start_outlive_the_loss_of_the_log(
    killed: Path, tmp_path: Path
) -> None:
    database, log = copied(killed, tmp_path)
    log.unlink()
    with closing(sqlite3.connect(database)) as connection:
        assert connection.execute("SELECT version_num FROM alembic_version").fetchall()


@pytest.mark.parametrize("place", ["start", "schema", "end"])
def test_a_damaged_database_is_named_and_the_server_answers_the_rest(
    tmp_path: Path, place: str
) -> None:
    with closing(open_keys(Settings(data_dir=tmp_path / "data"))) as known:
        for i in range(200):
            known.create(f"a name of some length {i}")
    path = tmp_path / "data" / "veselova.db"
    content = bytearray(path.read_bytes())
    start = {"start": 0, "schema": 100, "end": len(content) - 4096}[place]
    content[start : start + 3000] = b"\x5a" * 3000
    path.write_bytes(content)
    with pytest.raises(Refused, match=f"The database {path} is damaged: .* Stop every veselova"):
        open_keys(Settings(data_dir=tmp_path / "data"))
    if place == "end":
        with running_server(tmp_path, awaited="/healthz") as server:
            is_problem(server.get("/readyz"), 503, "not-ready")
            document = is_problem(server.get("/v1/jobs"), 503, "storage-unavailable")
            assert "database-damaged" in document["detail"]
            assert str(path) not in document["detail"]
            assert (
                server.ask("POST", "/v1/tori", json={"problem": GOOD["problem"]}).status_code == 200
            )
            log = server.log.read_text()
        assert "is damaged" in log
        assert "Traceback" not in log


# Whose it is


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("shared")


@pytest.fixture(scope="module")
def holders(shared: Path) -> dict[str, dict[str, str]]:
    """Keys by what they are."""
    with closing(open_keys(Settings(data_dir=shared / "data"))) as known:
        made = {name: known.create(name) for name in ("ada", "emmy")}
        made["reader"] = known.create("reader", "read", same_as=made["ada"][0].id)
        made["admin"] = known.create("admin", "admin")
        made["over"] = known.create("over", "solve", datetime.now(UTC) + timedelta(seconds=0.01))
    return {
        name: {"authorization": f"Bearer {text}", "id": key.id}
        for name, (key, text) in made.items()
    }


@pytest.fixture(scope="module")
def guarded(shared: Path, holders: dict[str, Any]) -> Iterator[Server]:
    with running_server(shared, "--require-keys", workers="2", sweep_workers="1") as own:
        yield own


@pytest.fixture
def ask(guarded: Server, holders: dict[str, dict[str, str]]) -> Callable[..., httpx2.Response]:
    """Asks the guarded server with somebody's key."""

    def asked(
        who: str, method: str, path: str, body: Any = None, **headers: str
    ) -> httpx2.Response:
        shown = {"authorization": holders[who]["authorization"], **headers}
        content = {} if body is None else {"content": json.dumps(body)}
        return guarded.ask(method, path, headers={**JSON, **shown}, **content)

    return asked


def body_of(seed: int = 0, **changes: Any) -> dict[str, Any]:
    vary = {"/A/0": [2, 3], "/q_dot": {"normal": [0, 1]}}
    return {
        "problem": {**GOOD["problem"], "normalize": True},
        "vary": vary,
        "samples": 2,
        "seed": seed,
        **changes,
    }


def test_a_job_is_absent_for_every_key_but_that_of_its_owner(
    ask: Callable[..., httpx2.Response],
) -> None:
    made = ask("ada", "POST", "/v1/sweeps", body_of())
    assert made.status_code == 202
    link = made.headers["location"]
    job_id = link.rsplit("/", 1)[1]
    wait_until(lambda: ask("ada", "GET", link).json()["state"] == "finished")
    for path in ("", "/events", "/result", "/trajectories"):
        refused = is_problem(ask("emmy", "GET", f"{link}{path}"), 404, "no-such-job")
        absent = is_problem(
            ask("emmy", "GET", f"/v1/jobs/{job_id[::-1]}{path}"), 404, "no-such-job"
        )
        assert refused["detail"].replace(job_id, "") == absent["detail"].replace(job_id[::-1], "")
    for query in ("", "?remove=true"):
        is_problem(ask("emmy", "DELETE", f"{link}{query}"), 404, "no-such-job")
    assert ask("emmy", "GET", "/v1/jobs").json()["jobs"] == []
    assert [job["id"] for job in ask("ada", "GET", "/v1/jobs").json()["jobs"]] == [job_id]
    assert ask("ada", "GET", f"{link}/result").status_code == 200
    # The same request of another is another job.
    other = ask("emmy", "POST", "/v1/sweeps", body_of())
    assert other.headers["location"] != link
    assert ask("ada", "DELETE", f"{link}?remove=true").status_code == 204
    assert ask("emmy", "GET", other.headers["location"]).status_code == 200


def test_a_key_of_the_same_owner_sees_the_same(
    ask: Callable[..., httpx2.Response], holders: dict[str, Any]
) -> None:
    link = ask("ada", "POST", "/v1/sweeps", body_of(1)).headers["location"]
    document = ask("reader", "GET", link).json()
    assert document["owner"] == holders["ada"]["id"]
    is_problem(ask("reader", "DELETE", link), 403, "insufficient-scope")


def test_idempotency_keys_belong_to_an_owner(ask: Callable[..., httpx2.Response]) -> None:
    first, second = (
        ask(who, "POST", "/v1/sweeps", body_of(seed), **{"idempotency-key": "mine"})
        for who, seed in (("ada", 2), ("emmy", 3))
    )
    assert (first.status_code, second.status_code) == (202, 202)
    is_problem(
        ask("emmy", "POST", "/v1/sweeps", body_of(2), **{"idempotency-key": "mine"}),
        422,
        "invalid-input",
    )


@pytest.mark.parametrize(
    ("who", "method", "path", "needed"),
    [
        ("reader", "POST", "/v1/trajectories", "solve"),
        ("reader", "POST", "/v1/sweeps", "solve"),
        ("reader", "DELETE", "/v1/jobs/" + "0" * 32, "solve"),
        ("reader", "GET", "/metrics", "admin"),
        ("ada", "GET", "/metrics", "admin"),
        ("ada", "GET", "/v1/jobs?all=true", None),
    ],
)
def test_a_scope_allows_what_it_says(
    ask: Callable[..., httpx2.Response], who: str, method: str, path: str, needed: str | None
) -> None:
    refused = ask(who, method, path, GOOD if method == "POST" else None)
    is_problem(refused, 403, "insufficient-scope")
    if needed:
        assert (
            f'error="insufficient_scope", scope="{needed}"' in refused.headers["www-authenticate"]
        )
    allowed = ask("admin", method, path, GOOD if method == "POST" else None)
    assert allowed.status_code in (200, 404, 422)


@pytest.mark.parametrize("path", ["/metrics%0A", "/metrics%0a", "/v1/jobs%0A", "/metrics%7F"])
def test_a_path_with_a_control_character_is_no_other_path(
    ask: Callable[..., httpx2.Response], path: str
) -> None:
    for who in ("reader", "ada", "admin"):
        is_problem(ask(who, "GET", path), 404, "no-such-resource")


def test_a_reader_reads_and_an_admin_sees_all(ask: Callable[..., httpx2.Response]) -> None:
    assert ask("reader", "GET", "/v1/systems").status_code == 200
    link = ask("emmy", "POST", "/v1/sweeps", body_of(4)).headers["location"]
    assert ask("admin", "GET", "/v1/jobs").json()["jobs"] == []
    listed = ask("admin", "GET", "/v1/jobs?all=true").json()["jobs"]
    assert link in [job["links"]["self"] for job in listed]
    assert ask("admin", "DELETE", link).status_code == 200


def test_an_expired_key_is_refused_and_listed_so(
    ask: Callable[..., httpx2.Response], shared: Path
) -> None:
    refused = ask("over", "GET", "/v1/systems")
    assert "has expired" in is_problem(refused, 401, "unauthorized")["detail"]
    assert 'error="invalid_token"' in refused.headers["www-authenticate"]
    lines = {line.split()[-1]: line for line in keys(shared, "list").stdout.splitlines()}
    assert " solve " in lines["ada"]
    assert " read " in lines["reader"]
    assert "expired" in lines["over"]


def test_keys_are_made_with_scope_and_expiry(tmp_path: Path) -> None:
    made = keys(tmp_path, "create", "Ada", "--scope", "read", "--expires", "90d", "--json")
    key = json.loads(made.stdout)
    life = datetime.fromisoformat(key["expires_at"]) - datetime.fromisoformat(key["created_at"])
    assert abs(life - timedelta(days=90)) < timedelta(minutes=5)
    assert (key["scope"], key["owner"], key["state"]) == ("read", key["id"], "valid")
    assert json.loads(keys(tmp_path, "create", "Emmy", "--json").stdout)["scope"] == "solve"
    for arguments in (("--scope", "all"), ("--expires", "soon"), ("--same-owner-as", "none")):
        refused = keys(tmp_path, "create", "Ada", *arguments)
        assert refused.returncode == 2
        assert refused.stderr.startswith(f"veselova: {arguments[0]}: required ")


@pytest.mark.parametrize(
    ("text", "life"),
    [
        ("90d", timedelta(days=90)),
        ("12h", timedelta(hours=12)),
        ("4w", timedelta(weeks=4)),
        (None, None),
    ],
)
def test_an_expiry_is_a_time_to_come(text: str | None, life: timedelta | None) -> None:
    assert expiry(text, NOW) == (None if life is None else NOW + life)
    assert expiry("2126-01-31", NOW) == datetime(2126, 1, 31, tzinfo=UTC)


@pytest.mark.parametrize(
    "text", ["", "90", "d", "0d", "-1d", "1.5d", "999999w", "2020-01-01", "2030-02-31", "tomorrow"]
)
def test_what_is_no_time_to_come_is_refused(text: str) -> None:
    with pytest.raises(InvalidInput, match="--expires"):
        expiry(text, NOW)


# At once


def test_of_two_sweeps_under_one_key_exactly_one_wins(store: Settings) -> None:
    with closing(Jobs(store)) as opened:
        for number in range(4):
            sweeps = [sweep_request(seed=10 * number + i) for i in range(8)]
            found = together(
                lambda i, sweeps=sweeps, key=f"key {number}": opened.submit(sweeps[i], key), 8
            )
            lost = [error for error in found if isinstance(error, Exception)]
            assert len(lost) == 7
            assert {type(error) for error in lost} == {InvalidInput}
        assert opened.counts() == {"queued": 4}


def test_the_same_sweep_under_one_key_is_one_job(store: Settings) -> None:
    with closing(Jobs(store)) as opened:
        found = together(lambda _: opened.submit(sweep_request(), "mine", "ada").id, 8)
        assert set(found) == {job_id_of(sweep_request(), "ada")}
        assert opened.counts() == {"queued": 1}


def test_the_oldest_keys_of_an_owner_go_where_they_are_too_many(
    store: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(idempotency, "_MOST", 10)
    monkeypatch.setattr(idempotency, "_KEPT", 5)
    with closing(Jobs(store)) as own:
        first, other = sweep_request(), sweep_request(seed=8)
        own.submit(first, "theirs", "another")
        for k in range(16):
            own.submit(first, f"key {k:02}", "owner")
            with pytest.raises(InvalidInput, match="Idempotency-Key"):
                own.submit(other, f"key {k:02}", "owner")
        own.submit(other, "key 00", "owner")  # forgotten
        with writing(own._engine) as connection:
            found = connection.execute(sa.select(idempotency_keys.c.owner))
            owners = {row.owner for row in found}
            count = connection.execute(sa.select(sa.func.count()).select_from(idempotency_keys))
            assert owners == {"another", "owner"}
            assert count.scalar_one() <= 12


def test_a_refused_sweep_leaves_its_key_free(
    store: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(job_limits, "MOST_PROBLEMS", 20)
    with closing(Jobs(store)) as opened:
        with pytest.raises(InvalidInput, match="at most 20 problems"):
            opened.submit(sweep_request(samples=50), "mine")
        assert opened.submit(sweep_request(), "mine").state == "queued"


# How much there may be


def test_bytes_are_counted_when_they_are_promised(store: Settings) -> None:
    size = max(promised_bytes(sweep_request(seed=seed)) for seed in range(8))
    with closing(Jobs(changed(store, max_stored_bytes=int(3.9 * size)))) as opened:
        found = together(lambda i: opened.submit(sweep_request(seed=i)), 8)
        refused = [error.code for error in found if isinstance(error, Refused)]
        assert refused == ["storage-full"] * 5
        job = next(job for job in found if not isinstance(job, Exception))
        opened.advance(job.id, "cancelled")  # what was promised and not used is free again
        assert opened.get(job.id).bytes == len(job.request) + JOB_BYTES
        assert opened.submit(sweep_request(seed=20)).state == "queued"
        with pytest.raises(Refused, match="take the room"):
            # a job that goes on is promised its room again
            opened.submit(sweep_request(seed=int(found.index(job))))


def test_an_owner_has_a_quota_and_so_many_jobs(
    store: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    size = promised_bytes(sweep_request(seed=5))
    with closing(Jobs(changed(store, max_stored_bytes=10 * size))) as opened:
        for seed in (1, 2):
            opened.submit(sweep_request(seed=seed), None, "ada")
        with pytest.raises(Refused, match="The jobs of this key take") as raised:
            opened.submit(sweep_request(seed=3), None, "ada")
        assert raised.value.code == "storage-full"
        assert opened.submit(sweep_request(seed=3), None, "emmy").owner == "emmy"
        for seed in range(3, 8):
            opened.submit(sweep_request(seed=seed))  # who shows no key has the room of all
    monkeypatch.setattr(job_limits, "MOST_JOBS_OF_OWNER", 2)
    with (
        closing(Jobs(store)) as opened,
        pytest.raises(Refused, match="2 jobs of this key"),
    ):
        opened.submit(sweep_request(seed=3), None, "ada")


# For how long


def test_old_jobs_and_idempotency_keys_go_with_their_room(store: Settings) -> None:
    with closing(Jobs(changed(store, retain_jobs_days=30))) as opened:
        for seed, key in ((1, "old"), (2, "new"), (3, "goes on")):
            job = opened.submit(sweep_request(seed=seed), key)
            opened.store(job.id, 0, 15, b"a table")
            if seed != 3:
                opened.advance(job.id, "finished")
        path = store.data_dir / "veselova.db"
        with writing(opened._engine) as connection:
            which = jobs.c.id == sweep_request(seed=1).id
            connection.execute(
                sa.update(jobs)
                .where(which)
                .values(finished_at=NOW - timedelta(days=31), request="x" * 5_000_000)
            )
        assert opened.remove_old(NOW) == 1
        assert {job.id for job in opened.newest()} == {
            sweep_request(seed=seed).id for seed in (2, 3)
        }
        assert not (opened.folder / sweep_request(seed=1).id).exists()
        assert opened.chunk_path(sweep_request(seed=3).id, 0).exists()
        if path.exists():
            assert path.stat().st_size < 1_000_000
        with pytest.raises(InvalidInput):
            opened.submit(sweep_request(seed=8), "new")
        assert opened.remove_old(NOW + timedelta(days=8)) == 0
        assert opened.submit(sweep_request(seed=8), "new").state == "queued"
    with closing(Jobs(changed(store, retain_jobs_days=0))) as opened:
        assert opened.remove_old(NOW + timedelta(days=10_000)) == 0


# Who else may touch it


def serve(folder: Path) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "VESELOVA_DATA_DIR": str(folder)}
    command = [sys.executable, "-m", "veselova", "serve", "--port", "0"]
    return subprocess.run(
        command, env=environment, capture_output=True, text=True, timeout=PATIENCE
    )


@pytest.mark.parametrize("kind", ["others write", "group writes", "not ours"])
def test_a_folder_that_others_may_write_or_own_is_refused(kind: str, tmp_path: Path) -> None:
    folder = tmp_path / "data"
    folder.mkdir()
    if kind == "not ours":
        if os.getuid() != 0:
            pytest.skip("only root can give a folder away")
        os.chown(folder, 12345, -1)
    else:
        folder.chmod(0o707 if kind == "others write" else 0o770)
    required = "VESELOVA_DATA_DIR: required a folder of state that this account owns"
    with pytest.raises(InvalidInput, match=required) as refused:
        Jobs(Settings(data_dir=folder))
    assert ("account 12345" if kind == "not ours" else "chmod go-w") in str(refused.value)
    if kind == "others write":
        for answer in (serve(folder), keys(tmp_path, "list")):
            assert answer.returncode == 2
            assert answer.stderr == f"veselova: {refused.value}\n"
    assert list(folder.iterdir()) == []


@pytest.fixture
def homeless(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of state of an account without a home, below a folder that everybody may write."""

    def none(path: Path) -> Path:
        if str(path).startswith("~"):
            raise RuntimeError
        return path

    (tmp_path / "tmp").mkdir()
    (tmp_path / "tmp").chmod(0o1777)
    monkeypatch.delenv("XDG_STATE_HOME", raising=False)
    monkeypatch.setattr(Path, "expanduser", none)
    monkeypatch.setattr(tempfile, "gettempdir", lambda: str(tmp_path / "tmp"))
    return settings._state_folder()


def test_the_folder_of_an_account_without_a_home_is_private(homeless: Path) -> None:
    assert homeless.name == f"veselova-{os.getuid()}"
    connect(Settings(data_dir=homeless)).dispose()
    assert homeless.stat().st_mode & 0o777 == 0o700
    homeless.chmod(0o755)
    connect(Settings(data_dir=homeless)).dispose()
    assert homeless.stat().st_mode & 0o777 == 0o700


@pytest.mark.parametrize("kind", ["link", "another's"])
def test_what_another_made_in_its_place_is_refused(
    homeless: Path, tmp_path: Path, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    if kind == "link":
        (tmp_path / "elsewhere").mkdir(mode=0o700)
        homeless.symlink_to(tmp_path / "elsewhere")
    else:
        homeless.mkdir(mode=0o700)
        monkeypatch.setattr(private_folder.os, "geteuid", lambda: os.getuid() + 1)
    with pytest.raises(InvalidInput, match="VESELOVA_DATA_DIR"):
        connect(Settings(data_dir=homeless))


def test_what_is_kept_is_readable_by_this_account_alone(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir(mode=0o755)
    (tmp_path / "data" / "veselova.db").touch(mode=0o644)  # as version 0.1.0 left it
    before = os.umask(0)
    try:
        with closing(Jobs(Settings(data_dir=tmp_path / "data"))) as opened:
            job = opened.submit(sweep_request())
            opened.store(job.id, 0, 15, b"a table")
            modes = {
                path.name: path.stat().st_mode & 0o777 for path in (tmp_path / "data").rglob("*")
            }
    finally:
        os.umask(before)
    assert {modes[f"veselova.db{end}"] for end in ("", "-wal", "-shm")} == {0o600}
    assert modes["000000.parquet"] == 0o600
    assert {modes[name] for name in ("jobs", job.id, "chunks")} == {0o700}


# Faults of data are no outages


@pytest.mark.parametrize(
    ("error", "raised"),
    [
        (sa.exc.DataError, InvalidInput),
        (sa.exc.IntegrityError, sa.exc.IntegrityError),
        (sa.exc.ProgrammingError, sa.exc.ProgrammingError),
        (sa.exc.OperationalError, Refused),
        (sa.exc.InterfaceError, Refused),
    ],
)
def test_only_an_outage_is_answered_with_an_outage(
    tmp_path: Path,
    error: type[sa.exc.DBAPIError],
    raised: type[Exception],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def failing(*_: Any) -> None:
        raise error("SELECT 1", {}, Exception("the reason"))

    async def ask(call: Callable[[JobService], Any]) -> None:
        service = JobService(Settings(data_dir=tmp_path))
        async with service.running():
            await call(service)

    monkeypatch.setattr(Jobs, "advance", failing)
    calls: tuple[Callable[[JobService], Any], ...] = (
        lambda service: service.ask(failing),
        lambda service: service.cancel("0" * 32),
    )
    for call in calls:
        with pytest.raises(raised) as found:
            asyncio.run(ask(call))
        assert type(found.value) is raised


def test_what_a_database_cannot_hold_is_no_outage(store: Settings) -> None:
    with closing(Jobs(store)) as opened:
        for job_id in ("\0" * 32, "\ud800", "a" * 10_000, "", "'"):
            with pytest.raises(Refused, match="There is no job"):
                opened.get(job_id)
        job = opened.submit(sweep_request())
        assert opened.advance(job.id, "failed", "a NUL \0 and half \ud800 of a pair")
        assert opened.get(job.id).detail == "a NUL  and half ? of a pair"
    with closing(open_keys(store)) as known:
        with pytest.raises(InvalidInput, match="ID: required the id of a key"):
            known.revoke("\0\ud800")
        with writing(known._database) as connection:
            api_keys.drop(connection)
        expected = sa.exc.ProgrammingError if store.database_url.get_secret_value() else Refused
        with pytest.raises(expected):
            known.list()


def test_ids_that_no_job_has_are_absent(
    guarded: Server, ask: Callable[..., httpx2.Response]
) -> None:
    for job_id in ("%ED%A0%80", "x" * 500, "%27"):
        is_problem(ask("ada", "GET", f"/v1/jobs/{job_id}"), 404, "no-such-job")
    is_problem(ask("ada", "GET", "/v1/jobs/%00"), 404, "no-such-resource")


def test_a_database_that_is_silent_is_not_waited_for_without_end(
    postgresql: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    with closing(socket.create_server(("127.0.0.1", 0))) as silent:
        monkeypatch.setitem(database._PATIENCE, "connect_timeout", 2)
        address = f"postgresql://someone@127.0.0.1:{silent.getsockname()[1]}/x"
        with pytest.raises(sa.exc.OperationalError):
            connect(Settings(data_dir=tmp_path, database_url=SecretStr(address)))
    address = new_database(postgresql, "silent")
    engine = connect(Settings(data_dir=tmp_path, database_url=SecretStr(address)))
    with engine.connect() as connection:
        shown = connection.execute(sa.text("SHOW statement_timeout")).scalar_one()
        assert shown == f"{database._STATEMENT_S}s"
    engine.dispose()


def test_a_database_that_is_halted_is_given_up_and_taken_up_again(
    postgresql: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Its kernel goes on taking what is sent; a server could not even end."""
    monkeypatch.setattr(patient_connection, "_ANSWER_S", 0.3)
    address = new_database(postgresql, "halted")
    with closing(Jobs(Settings(data_dir=tmp_path, database_url=SecretStr(address)))) as own:
        job = own.submit(sweep_request())
        with own._engine.connect() as connection:
            pid = sa.text("SELECT pg_backend_pid()")
            halted = connection.execute(pid).scalar_one()
            os.kill(halted, signal.SIGSTOP)
            try:
                with pytest.raises(sa.exc.OperationalError, match="does not answer"):
                    connection.execute(pid)
            finally:
                os.kill(halted, signal.SIGCONT)
            connection.rollback()
            halted = connection.execute(pid).scalar_one()
        os.kill(halted, signal.SIGSTOP)
        try:
            assert own.get(job.id).state == "queued"  # by another connection
        finally:
            os.kill(halted, signal.SIGCONT)


@pytest.mark.parametrize("who", ["request", "job", "key"])
def test_a_storage_that_hangs_leaves_threads_to_others(tmp_path: Path, who: str) -> None:
    held = threading.Event()

    class HangingKeys(Keys):
        def holder(self, text: str) -> None:
            held.wait(PATIENCE)

    async def nobody(*_: Any) -> None:
        """Take what is sent, and go."""

    async def ask() -> None:
        service = JobService(Settings(data_dir=tmp_path))
        access = Access(nobody, HangingKeys(sa.create_engine("sqlite://")), lambda _: None)
        scope = {"type": "http", "method": "GET", "path": "/v1/jobs", "state": {}}
        scope["headers"] = [(b"authorization", b"Bearer x")]
        async with service.running(), anyio.create_task_group() as tasks:
            sweeps = await service.sweeps()
            for _ in range(60):
                if who == "request":
                    tasks.start_soon(service.ask, lambda _: held.wait(PATIENCE))
                elif who == "job":
                    tasks.start_soon(sweeps._call, held.wait, PATIENCE)
                else:
                    tasks.start_soon(access, scope, nobody, nobody)
            await anyio.sleep(0.1)
            with anyio.fail_after(PATIENCE / 2):
                await anyio.to_thread.run_sync(time.sleep, 0)
            held.set()

    asyncio.run(ask())


def test_those_who_ask_while_a_store_does_not_open_share_the_next_try(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tries = 0

    def silent(_: Settings) -> Jobs:
        nonlocal tries
        tries += 1
        time.sleep(0.05)
        raise sa.exc.OperationalError("SELECT 1", {}, Exception("no answer"))

    monkeypatch.setattr(job_store, "Jobs", silent)

    async def ask() -> list[Any]:
        service = JobService(Settings(data_dir=tmp_path))
        first = asyncio.ensure_future(service.sweeps())
        await asyncio.sleep(0.02)
        others = (service.sweeps() for _ in range(20))
        return await asyncio.gather(first, *others, return_exceptions=True)

    found = asyncio.run(ask())
    assert tries == 2
    assert all(isinstance(error, Refused) and error.retry_after == 30 for error in found)


def test_those_who_ask_at_once_whether_a_server_is_ready_share_one_look(tmp_path: Path) -> None:
    looks = 0

    class Slow(JobService):
        async def require(self) -> None:
            nonlocal looks
            looks += 1
            await anyio.sleep(0.05)
            if looks > 1:
                raise Refused("storage-unavailable", "")

    async def ask() -> list[list[str]]:
        settings = Settings(data_dir=tmp_path)
        readiness = Readiness(Workers(settings, Metrics()), Slow(settings), None)
        await readiness.missing()
        return list(await asyncio.gather(*(readiness.missing() for _ in range(100))))

    answers = asyncio.run(ask())
    assert looks == 2
    # what was found before they asked is no answer
    assert all("Jobs cannot be stored or read at present." in answer for answer in answers)


@asynccontextmanager
async def a_waiting_job(data_dir: Path) -> AsyncIterator[tuple[Sweeps, Any, _JobRoutes]]:
    """Yield the sweeps of a service, a job that was submitted and never begun, and its routes."""
    service = JobService(Settings(data_dir=data_dir))
    async with service.running():
        sweeps = await service.sweeps()
        routes = _JobRoutes(None, service)  # type: ignore[arg-type]
        yield sweeps, sweeps.jobs.submit(sweep_request()), routes


def test_events_of_a_job_tell_nothing_of_others_and_end_with_it(tmp_path: Path) -> None:
    async def watch() -> None:
        async with a_waiting_job(tmp_path) as (sweeps, job, routes):
            request = Request({"type": "http", "headers": []})
            events = routes.events(job.id, request)
            assert (await anext(events)).event == "queued"
            following = asyncio.ensure_future(anext(events, None))
            for _ in range(20):
                await sweeps._tell()  # some job has moved on
                await asyncio.sleep(0.01)
            assert not following.done()
            sweeps.jobs.advance(job.id, "cancelled")
            sweeps.jobs.remove(job.id)
            await sweeps._tell()
            assert await following is None

    asyncio.run(watch())


def test_those_who_follow_a_job_share_its_looks_and_end_with_the_server(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Four hundred streams took three seconds of the event loop for each chunk."""
    looks = 0
    status = Jobs.status

    def counted(*arguments: Any) -> Any:
        nonlocal looks
        looks += 1
        return status(*arguments)

    monkeypatch.setattr(Jobs, "status", counted)

    async def watch() -> None:
        async with a_waiting_job(tmp_path) as (sweeps, job, routes):
            requests = [
                Request({"type": "http", "headers": [], "state": dict[str, Any]()})
                for _ in range(50)
            ]
            streams = [routes.events(job.id, request) for request in requests]
            first = await asyncio.gather(*map(anext, streams))
            assert {event.event for event in first} == {"queued"}
            assert looks <= 2
            for request in requests[1:]:
                request.scope["state"]["ending"] = True
            sweeps.jobs.advance(job.id, "cancelled")
            following = [asyncio.ensure_future(anext(stream, None)) for stream in streams]
            await asyncio.sleep(0.01)
            await sweeps._tell()
            found = await asyncio.gather(*following)
            assert found[1:] == 49 * [None]
            assert found[0].event == "cancelled"
            assert json.loads(found[0].raw_data)["id"] == job.id
            assert looks <= 4

    asyncio.run(watch())


def test_a_job_that_was_removed_before_it_began_is_no_failure(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    settings = Settings(data_dir=tmp_path)

    async def run() -> None:
        with closing(Jobs(settings)) as jobs:
            sweeps = Sweeps(settings, jobs, processes=False)
            sweeps.begin("0" * 32)
            await sweeps.wait_ended("0" * 32)
            await sweeps.close()

    asyncio.run(run())
    assert not [record for record in caplog.records if record.levelname == "ERROR"]
