"""What the service keeps: its first start, damage, whose it is, how much there may be, for how
long, who else may touch it.
"""

from __future__ import annotations

import asyncio
import json
import os
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import httpx2
import pytest
import sqlalchemy as sa
from pydantic import SecretStr
from starlette.requests import Request
from test_access import keys
from test_http import JSON, is_problem
from test_job_store import differences
from test_sweeps import request as sweep_request

from conftest import PATIENCE, Server, running_server, wait_until
from hostile import GOOD
from postgresql import new_database, postgresql_server, settings_in
from veselova.mechanics.core.errors import InvalidInput
from veselova.service.access import database
from veselova.service.access.database import (
    connect,
    jobs,
    writing,
)
from veselova.service.access.database import keys as api_keys
from veselova.service.access.keys import open_keys
from veselova.service.api import private_folder, settings
from veselova.service.api.problem_details import Refused
from veselova.service.api.settings import Settings
from veselova.service.cli.server_commands import expiry
from veselova.service.http import job_service
from veselova.service.http.job_routes import events as job_events
from veselova.service.sweeps import job_store
from veselova.service.sweeps.job_store import Jobs, estimated_bytes, job_id_of
from veselova.service.sweeps.runner import Sweeps

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


def test_first_starts_that_race_all_succeed(store: Settings) -> None:
    stated = {
        "VESELOVA_DATA_DIR": str(store.data_dir),
        "VESELOVA_DATABASE_URL": store.database_url.get_secret_value(),
    }
    script = (
        "import sys, alembic.command\n"
        "from veselova.service.access.database import Settings, connect\n"
        "sys.stdin.read()\n"
        "connect(Settings())"
    )
    command = [sys.executable, "-c", script]
    starts = [
        subprocess.Popen(command, env={**os.environ, **stated}, stdin=subprocess.PIPE)
        for _ in range(6)
    ]
    for start in starts:
        start.stdin.close()
    assert [start.wait(PATIENCE) for start in starts] == [0] * 6
    engine = connect(store)
    assert differences(engine) == []
    engine.dispose()


def test_a_first_start_that_fails_leaves_a_database_that_opens(
    store: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patched:
        patched.setattr("alembic.command.stamp", None)
        with pytest.raises(TypeError):
            connect(store)
    engine = connect(store)
    assert differences(engine) == []
    engine.dispose()


@pytest.mark.parametrize("revision", ["0003", "9999"])
def test_a_database_of_another_version_is_refused_by_its_revision(
    tmp_path: Path, revision: str
) -> None:
    engine = connect(Settings(data_dir=tmp_path))
    with writing(engine) as connection:
        connection.execute(sa.text(f"UPDATE alembic_version SET version_num = '{revision}'"))
    engine.dispose()
    with pytest.raises(
        Refused, match=f"The database has revision {revision}, .* or 0.14 once"
    ) as raised:
        connect(Settings(data_dir=tmp_path))
    assert raised.value.code == "database-newer"


def test_a_damaged_database_is_named_and_the_server_answers_the_rest(tmp_path: Path) -> None:
    path = tmp_path / "data" / "veselova.db"
    path.parent.mkdir(mode=0o700)
    path.write_bytes(b"\x5a" * 5000)
    with pytest.raises(Refused, match=f"The database {path} is damaged: .* Move it") as raised:
        open_keys(Settings(data_dir=tmp_path / "data"))
    assert raised.value.code == "database-damaged"
    with running_server(tmp_path, awaited="/healthz") as server:
        is_problem(server.get("/readyz"), 503, "not-ready")
        document = is_problem(server.get("/v1/jobs"), 503, "storage-unavailable")
        assert "database-damaged" in document["detail"]
        assert server.ask("POST", "/v1/tori", json={"problem": GOOD["problem"]}).status_code == 200
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


def test_a_refused_sweep_leaves_its_key_free(
    store: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(job_store, "MOST_PROBLEMS", 20)
    with closing(Jobs(store)) as opened:
        with pytest.raises(InvalidInput, match="at most 20 problems"):
            opened.submit(sweep_request(samples=50), "mine")
        assert opened.submit(sweep_request(), "mine").state == "queued"


# How much there may be


def test_bytes_are_counted_when_a_job_is_accepted(store: Settings) -> None:
    size = max(estimated_bytes(sweep_request(seed=seed)) for seed in range(8))
    with closing(Jobs(changed(store, max_stored_bytes=int(3.9 * size)))) as opened:
        found = together(lambda i: opened.submit(sweep_request(seed=i)), 8)
        refused = [error.code for error in found if isinstance(error, Refused)]
        assert refused == ["storage-full"] * 5
        job = next(job for job in found if not isinstance(job, Exception))
        opened.advance(job.id, "cancelled")  # what was not used is free again
        assert opened.submit(sweep_request(seed=20)).state == "queued"
        with pytest.raises(Refused, match="take the room"):
            # a job that goes on needs its room again
            opened.submit(sweep_request(seed=int(found.index(job))))


def test_an_owner_has_a_quota(store: Settings) -> None:
    size = estimated_bytes(sweep_request(seed=5))
    with closing(Jobs(changed(store, max_stored_bytes=10 * size))) as opened:
        for seed in (1, 2):
            opened.submit(sweep_request(seed=seed), None, "ada")
        with pytest.raises(Refused, match="The results of jobs of this key") as raised:
            opened.submit(sweep_request(seed=3), None, "ada")
        assert raised.value.code == "storage-full"
        assert opened.submit(sweep_request(seed=3), None, "emmy").owner == "emmy"
        for seed in range(3, 8):
            opened.submit(sweep_request(seed=seed))  # who shows no key has the room of all


# For how long


def test_old_jobs_go_with_their_idempotency_keys(store: Settings) -> None:
    with closing(Jobs(changed(store, retain_jobs_days=30))) as opened:
        for seed, key in ((1, "old"), (2, "new"), (3, "goes on")):
            job = opened.submit(sweep_request(seed=seed), key)
            opened.store(job, 0, 15, b"a table")
            if seed != 3:
                opened.advance(job.id, "finished")
        with writing(opened._engine) as connection:
            which = jobs.c.id == sweep_request(seed=1).id
            old = sa.update(jobs).where(which).values(finished_at=NOW - timedelta(days=31))
            connection.execute(old)
        opened.remove_old()
        assert {job.id for job in opened.newest()} == {
            sweep_request(seed=seed).id for seed in (2, 3)
        }
        assert not (opened.folder / sweep_request(seed=1).id).exists()
        assert opened.chunk_path(sweep_request(seed=3).id, 0, 15).exists()
        with pytest.raises(InvalidInput):
            opened.submit(sweep_request(seed=8), "new")
        assert opened.submit(sweep_request(seed=8), "old").state == "queued"
    with closing(Jobs(changed(store, retain_jobs_days=0))) as opened:
        with writing(opened._engine) as connection:
            connection.execute(sa.update(jobs).values(finished_at=NOW - timedelta(days=10_000)))
        opened.remove_old()
        assert len(opened.newest()) == 3


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
    assert "account 12345" in str(refused.value) or kind != "not ours"
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


def test_what_another_made_in_its_place_is_refused(
    homeless: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    homeless.mkdir(mode=0o700)
    monkeypatch.setattr(private_folder.os, "geteuid", lambda: os.getuid() + 1)
    with pytest.raises(InvalidInput, match="VESELOVA_DATA_DIR"):
        connect(Settings(data_dir=homeless))


def test_what_is_kept_is_readable_by_this_account_alone(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir(mode=0o755)
    before = os.umask(0)
    try:
        with closing(Jobs(Settings(data_dir=tmp_path / "data"))) as opened:
            job = opened.submit(sweep_request())
            opened.store(job, 0, 15, b"a table")
            modes = {
                path.name: path.stat().st_mode & 0o777 for path in (tmp_path / "data").rglob("*")
            }
    finally:
        os.umask(before)
    assert {modes[f"veselova.db{end}"] for end in ("", "-wal", "-shm")} == {0o600}
    assert modes["000000000-000000015.parquet"] == 0o600
    assert {modes[name] for name in ("jobs", job.id, "chunks")} == {0o700}


# What no table holds


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
        with writing(known._engine) as connection:
            api_keys.drop(connection)
        with pytest.raises(Refused, match="The keys cannot be read at present"):
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
        monkeypatch.setitem(database._POSTGRESQL, "connect_timeout", 2)
        address = f"postgresql://someone@127.0.0.1:{silent.getsockname()[1]}/x"
        with pytest.raises(sa.exc.OperationalError):
            connect(Settings(data_dir=tmp_path, database_url=SecretStr(address)))
    address = new_database(postgresql, "silent")
    engine = connect(Settings(data_dir=tmp_path, database_url=SecretStr(address)))
    with engine.connect() as connection:
        assert connection.exec_driver_sql("SHOW statement_timeout").scalar_one() == "20s"
    engine.dispose()


def test_a_store_that_does_not_open_at_first_is_opened_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(job_service, "_PAUSE_S", 0.02)
    (tmp_path / "data").write_text("no folder")

    async def ask() -> None:
        service = job_service.JobService(Settings(data_dir=tmp_path / "data"))
        async with service.running():
            with pytest.raises(Refused, match="at present") as refused:
                await service.ask(lambda jobs: jobs.newest())
            assert (refused.value.code, refused.value.retry_after) == ("storage-unavailable", 5)
            (tmp_path / "data").unlink()
            while service.counts() != {} or service._sweeps is None:
                await asyncio.sleep(0.01)
            assert await service.ask(lambda jobs: jobs.newest()) == []

    asyncio.run(ask())


def test_events_of_a_job_tell_nothing_of_others_and_end_with_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("veselova.service.http.job_routes._POLL_S", 0.01)
    settings = Settings(data_dir=tmp_path)

    async def watch() -> None:
        service = job_service.JobService(settings)
        with closing(Jobs(settings)) as others:
            job = others.submit(sweep_request())
            others.claim(job.id)
            async with service.running():
                events = job_events(job.id, Request({"type": "http", "headers": []}), service)
                assert (await anext(events)).event == "queued"
                following = asyncio.ensure_future(anext(events, None))
                others.advance(others.submit(sweep_request(seed=1)).id, "cancelled")
                await asyncio.sleep(0.2)
                assert not following.done()
                with database.writing(others._engine) as connection:
                    connection.execute(sa.delete(database.jobs))
                assert await following is None

    asyncio.run(watch())


def test_a_job_that_was_removed_before_it_began_is_no_failure(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    settings = Settings(data_dir=tmp_path)

    with (
        closing(Jobs(settings)) as jobs,
        closing(Sweeps(settings, jobs, processes=False)) as sweeps,
    ):
        sweeps.run("0" * 32, lambda done, total: None)
    assert not [record for record in caplog.records if record.levelname == "ERROR"]
