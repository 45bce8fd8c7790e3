"""What the service keeps: its first start, damage, whose it is, how much there may be, for how
long, who else may touch it.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from contextlib import closing
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import httpx2
import pytest
import sqlalchemy as sa
from alembic.autogenerate import compare_metadata
from alembic.runtime.migration import MigrationContext
from test_access import keys
from test_http import JSON, is_problem
from test_job_store import together
from test_sweeps import request as sweep_request

from conftest import Server, running_server, wait_until
from hostile import GOOD
from veselova.mechanics.core.errors import InvalidInput
from veselova.service.access.database import connect, jobs, metadata, writing
from veselova.service.access.keys import open_keys
from veselova.service.api.problem_details import Refused
from veselova.service.api.settings import Settings
from veselova.service.sweeps.job_store import Jobs, estimated_bytes

NOW = datetime.now(UTC)


def changed(store: Settings, **values: Any) -> Settings:
    return store.model_copy(update=values)


def test_a_first_start_that_fails_leaves_a_database_that_opens(
    store: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patched:
        patched.setattr("alembic.command.stamp", None)
        with pytest.raises(TypeError):
            connect(store)
    engine = connect(store)
    with engine.connect() as connection:
        assert compare_metadata(MigrationContext.configure(connection), metadata) == []
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


def damage_database(folder: Path) -> Path:
    """Return a file that is no database, where a folder has its own."""
    folder.mkdir(mode=0o700)
    path = folder / "veselova.db"
    path.write_bytes(b"\x5a" * 5000)
    path.chmod(0o600)
    return path


def test_a_damaged_database_is_named(tmp_path: Path) -> None:
    path = damage_database(tmp_path / "data")
    with pytest.raises(Refused, match=f"The database {path} is damaged: .* Move it") as raised:
        open_keys(Settings(data_dir=tmp_path / "data"))
    assert raised.value.code == "database-damaged"


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
        challenge = refused.headers["www-authenticate"]
        assert f'error="insufficient_scope", scope="{needed}"' in challenge
    allowed = ask("admin", method, path, GOOD if method == "POST" else None)
    assert allowed.status_code in (200, 404, 422)


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
    made = keys(
        tmp_path,
        "create",
        "Ada",
        "--scope",
        "read",
        "--expires",
        f"{NOW + timedelta(days=90):%Y-%m-%d}",
        "--json",
    )
    key = json.loads(made.stdout)
    life = datetime.fromisoformat(key["expires_at"]) - datetime.fromisoformat(key["created_at"])
    assert abs(life - timedelta(days=90)) < timedelta(days=1)
    assert (key["scope"], key["owner"], key["state"]) == ("read", key["id"], "valid")
    assert json.loads(keys(tmp_path, "create", "Emmy", "--json").stdout)["scope"] == "solve"
    for arguments in (("--scope", "all"), ("--expires", "2020-01-31"), ("--same-owner-as", "none")):
        refused = keys(tmp_path, "create", "Ada", *arguments)
        assert refused.returncode == 2
        assert refused.stderr.startswith(f"veselova: {arguments[0]}: required ")


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
            opened.submit(sweep_request(seed=seed), "ada")
        with pytest.raises(InvalidInput, match="which the jobs of this key share; given"):
            opened.submit(sweep_request(samples=20), "sophie")
        with pytest.raises(Refused, match="Results of the jobs of this key") as raised:
            opened.submit(sweep_request(seed=3), "ada")
        assert raised.value.code == "storage-full"
        assert opened.submit(sweep_request(seed=3), "emmy").owner == "emmy"
        for seed in range(3, 8):
            opened.submit(sweep_request(seed=seed))  # who shows no key has the room of all


# For how long


def test_old_jobs_go(store: Settings) -> None:
    with closing(Jobs(changed(store, retain_jobs_days=30))) as opened:
        for seed in (1, 2, 3):
            job = opened.submit(sweep_request(seed=seed))
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
    with closing(Jobs(changed(store, retain_jobs_days=0))) as opened:
        with writing(opened._engine) as connection:
            connection.execute(sa.update(jobs).values(finished_at=NOW - timedelta(days=10_000)))
        opened.remove_old()
        assert len(opened.newest()) == 2


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
