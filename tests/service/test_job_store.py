"""The store of jobs and keys, on SQLite and on PostgreSQL alike."""

from __future__ import annotations

import errno
import shutil
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, closing
from datetime import timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
import sqlalchemy as sa
import zarr
from alembic.autogenerate import compare_metadata
from alembic.runtime.migration import MigrationContext
from pyarrow import parquet
from test_sweeps import request as sweep_request

from conftest import PATIENCE
from postgresql import postgresql_server, settings_in
from veselova.mechanics.core.errors import InvalidInput
from veselova.service.access.database import connect, metadata, named_outages, writing
from veselova.service.access.database import jobs as job_table
from veselova.service.access.keys import open_keys
from veselova.service.api.problem_details import Refused
from veselova.service.api.settings import Settings
from veselova.service.cli.local_sweep import run_sweep
from veselova.service.sweeps import chunk, executors, job_store, result_files, runner
from veselova.service.sweeps.job_store import JobEnded, Jobs
from veselova.service.sweeps.runner import Sweeps


@pytest.fixture(scope="module")
def postgresql() -> Iterator[str]:
    with postgresql_server() as address:
        yield address


@pytest.fixture(params=["sqlite", "postgresql"])
def store(request: pytest.FixtureRequest, tmp_path: Path) -> Settings:
    """Settings with a folder and a database of their own."""
    return settings_in(tmp_path, request)


@pytest.fixture
def opened() -> Iterator[Callable[[Settings], Jobs]]:
    """Opens stores, and closes them at the end of the test."""
    with ExitStack() as stack:
        yield lambda settings: stack.enter_context(closing(Jobs(settings)))


def together(call: Callable[[int], Any], count: int) -> list[Any]:
    """Return what a call gives in so many threads that begin at once."""
    begin = threading.Barrier(count)

    def one(i: int) -> Any:
        begin.wait()
        return call(i)

    with ThreadPoolExecutor(count) as pool:
        return list(pool.map(one, range(count)))


def test_a_sweep_that_many_ask_for_at_once_is_one_job(
    store: Settings, opened: Callable[[Settings], Jobs]
) -> None:
    jobs = opened(store)
    for seed in range(5):
        sweep = sweep_request(seed=seed)
        submitted = together(lambda _, sweep=sweep, key=f"key {seed}": jobs.submit(sweep, key), 8)
        assert {job.id for job in submitted} == {sweep.id}
    assert jobs.counts() == {"queued": 5}


def test_trajectories_stand_in_their_rows_whatever_chunk_comes_first(
    store: Settings, opened: Callable[[Settings], Jobs]
) -> None:
    jobs = opened(store)
    sweep = sweep_request(samples=300, times=[0, 1], outputs=["tau1"], trajectories=True)
    job = jobs.submit(sweep)
    for start, stop in reversed(jobs.missing(job)):
        rows = [{"row": row, "outcome": "solved"} for row in range(start, stop)]
        kept = [{"tau1": np.full(2, float(start))} for _ in rows]
        jobs.store(job, start, stop, chunk._parquet(rows, kept))
    result_files.finish(jobs, job)
    packed = zarr.storage.ZipStore(jobs.packed_path(job.id), mode="r")
    found = zarr.open_group(packed, mode="r")["tau1"][:]
    first = [row // job.chunk_rows * job.chunk_rows for row in range(900)]
    assert found[:, 0].tolist() == first
    assert parquet.read_table(jobs.result_path(job.id))["row"].to_pylist() == list(range(900))


def test_of_a_chunk_that_was_begun_one_by_one_the_rest_is_missing(
    store: Settings, opened: Callable[[Settings], Jobs]
) -> None:
    jobs = opened(store)
    job = jobs.submit(sweep_request())
    assert jobs.missing(job) == [(0, 15)]
    for row in (0, 3):
        jobs.store(job, row, row + 1, b"a table")
    assert jobs.missing(job) == [(row, row + 1) for row in range(15) if row not in (0, 3)]
    jobs.store(job, 0, 15, b"a table")
    assert jobs.missing(job) == []
    assert list(jobs.chunks(job.id)) == [(0, 15)]
    assert jobs.status(job.id).done == 15


def test_a_listing_reads_no_request(store: Settings, opened: Callable[[Settings], Jobs]) -> None:
    jobs, statements = opened(store), list[str]()
    job = jobs.submit(sweep_request())
    sa.event.listen(
        jobs._engine, "before_cursor_execute", lambda *arguments: statements.append(arguments[2])
    )
    assert [status.id for status in jobs.newest()] == [job.id]
    assert jobs.status(job.id).total == 15
    assert len(statements) == 2
    assert not [text for text in statements if "request" in text]


def test_only_an_ended_job_is_removed(store: Settings, opened: Callable[[Settings], Jobs]) -> None:
    jobs = opened(store)
    job = jobs.submit(sweep_request())
    jobs.store(job, 0, 15, b"a table")
    with pytest.raises(Refused, match="goes on"):
        jobs.remove(job.id)
    assert jobs.chunk_path(job.id, 0, 15).exists()
    jobs.advance(job.id, "cancelled")
    jobs.remove(job.id)
    assert not jobs.chunk_path(job.id, 0, 15).exists()


def test_a_job_is_removed_once_and_unknown_to_others_who_remove_it(
    store: Settings, opened: Callable[[Settings], Jobs]
) -> None:
    jobs = opened(store)

    def remove(job_id: str) -> str:
        try:
            jobs.remove(job_id)
        except Refused as error:
            return error.code
        return "removed"

    for seed in range(10):
        job = jobs.submit(sweep_request(seed=seed))
        jobs.store(job, 0, 15, b"a table")
        jobs.advance(job.id, "cancelled")
        found = together(lambda _, job_id=job.id: remove(job_id), 4)
        assert sorted(found) == [*3 * ["no-such-job"], "removed"]
    assert not [path for path in jobs.folder.iterdir() if path.is_dir()]


def test_limits_are_named_before_a_job_is_made(
    store: Settings, opened: Callable[[Settings], Jobs], monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(job_store, "MOST_PROBLEMS", 10)
        with pytest.raises(InvalidInput, match="at most 10 problems; given 15"):
            opened(store).submit(sweep_request())
    with pytest.raises(InvalidInput, match="bytes of results"):
        opened(store.model_copy(update={"max_stored_bytes": 1000})).submit(sweep_request())


def test_a_sweep_runs_on_either_database_to_the_same_result(
    store: Settings, tmp_path: Path
) -> None:
    sweep = sweep_request(samples=3, times=[0, 1], outputs=["q"])
    job, jobs = run_sweep(sweep, store, lambda done, total: None)
    assert (job.state, job.done, job.total) == ("finished", 9, 9)
    _, other = run_sweep(sweep, Settings(data_dir=tmp_path / "other"), lambda done, total: None)
    assert jobs.result_path(job.id).read_bytes() == other.result_path(job.id).read_bytes()


def differences(engine: sa.Engine) -> list[Any]:
    """Return what the tables in the database have that those of the code have not, and the other
    way round.
    """
    with engine.connect() as connection:
        return list(compare_metadata(MigrationContext.configure(connection), metadata))


def test_servers_that_start_together_make_the_tables_of_the_code_once(store: Settings) -> None:
    for engine in together(lambda _: connect(store), 4):
        assert differences(engine) == []
        engine.dispose()


def test_a_database_that_is_up_to_date_is_opened_without_migrations(
    store: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    connect(store).dispose()
    monkeypatch.setattr("alembic.command.stamp", None)
    connect(store).dispose()


def test_a_job_goes_through_its_states_and_keeps_its_dates(
    store: Settings, opened: Callable[[Settings], Jobs]
) -> None:
    jobs = opened(store)
    job = jobs.submit(sweep_request(), "a key")
    assert (job.state, job.done, job.finished_at) == ("queued", 0, None)
    assert job.created_at.utcoffset() is not None
    assert jobs.unfinished() == [job.id]
    assert jobs.advance(job.id, "running")
    jobs.store(job, 0, 15, b"a table")
    jobs.store(job, 0, 15, b"the same once more")
    assert (jobs.status(job.id).state, jobs.status(job.id).done) == ("running", 15)
    assert jobs.missing(jobs.get(job.id)) == []
    assert jobs.advance(job.id, "finished")
    assert not jobs.advance(job.id, "running")
    assert jobs.get(job.id).finished_at >= job.created_at
    with pytest.raises(JobEnded, match="finished"):
        jobs.store(job, 0, 15, b"too late")
    with pytest.raises(InvalidInput, match="a key of its own for every request"):
        jobs.submit(sweep_request(seed=8), "a key")
    jobs.remove(job.id)
    assert jobs.newest() == []
    jobs.submit(sweep_request(seed=8), "a key")  # which went with its job


def test_a_key_is_known_until_it_is_revoked(store: Settings) -> None:
    keys = open_keys(store)
    key, text = keys.create("Sophie")
    assert keys.holder(text) == key
    assert keys.holder(text[:-1] + ("a" if text[-1] != "a" else "b")) is None
    assert keys.revoke(key.id).revoked_at >= key.created_at
    assert keys.holder(text) is None
    assert [known.id for known in keys.list()] == [key.id]
    keys.close()


@pytest.mark.parametrize("end", ["cancelled", "removed"])
def test_a_job_that_another_server_ends_while_a_chunk_is_stored_is_given_up(
    store: Settings,
    opened: Callable[[Settings], Jobs],
    monkeypatch: pytest.MonkeyPatch,
    end: str,
) -> None:
    jobs = opened(store)
    job = jobs.submit(sweep_request())
    write = job_store.write_whole

    def late(path: Path, content: bytes) -> None:
        jobs.advance(job.id, "cancelled")
        if end == "removed":
            jobs.remove(job.id)
        write(path, content)

    monkeypatch.setattr(job_store, "write_whole", late)
    with pytest.raises(JobEnded, match=end):
        jobs.store(job, 0, 15, b"table")
    assert [path.name for path in jobs.folder.iterdir()] == [job.id] * (end == "cancelled")


def test_a_job_belongs_to_who_claimed_it_until_it_is_released_or_the_lease_ends(
    store: Settings, opened: Callable[[Settings], Jobs], monkeypatch: pytest.MonkeyPatch
) -> None:
    jobs, others = opened(store), opened(store)
    job = jobs.submit(sweep_request())
    found = together(lambda i: (jobs, others)[i % 2].claim(job.id), 8)
    assert found in ([True, False] * 4, [False, True] * 4)
    own, other = (jobs, others) if found[0] else (others, jobs)
    assert (own.unfinished(), other.unfinished()) == ([job.id], [])
    with pytest.raises(JobEnded, match="queued"):
        other.store(job, 0, 15, b"table")
    own.release(job.id)
    monkeypatch.setattr(job_store, "_LEASE", timedelta(seconds=-1))
    assert other.claim(job.id)  # and dies
    assert own.claim(job.id)
    own.advance(job.id, "finished")
    assert not own.claim(job.id)


def test_a_job_that_another_process_holds_is_not_removed(
    store: Settings, opened: Callable[[Settings], Jobs]
) -> None:
    jobs, others = opened(store), opened(store)
    job = jobs.submit(sweep_request())
    assert others.claim(job.id)
    jobs.advance(job.id, "cancelled")  # which the other has not heard yet
    with pytest.raises(Refused, match="still being stopped"):
        jobs.remove(job.id)
    assert jobs.get(job.id).state == "cancelled"
    others.release(job.id)
    jobs.remove(job.id)
    assert not list(jobs.folder.iterdir())


def test_a_job_that_is_asked_for_again_while_its_files_are_removed_keeps_its_own(
    store: Settings, opened: Callable[[Settings], Jobs], monkeypatch: pytest.MonkeyPatch
) -> None:
    jobs, others = opened(store), opened(store)
    job = jobs.submit(sweep_request())
    jobs.store(job, 0, 15, b"first")
    jobs.advance(job.id, "cancelled")
    remove = shutil.rmtree

    def again() -> None:
        others.store(others.submit(sweep_request()), 0, 15, b"again")

    def late(path: Path, ignore_errors: bool) -> None:
        asking.start()
        asking.join(0.3)  # it waits for the removal
        remove(path, ignore_errors)

    asking = threading.Thread(target=again)
    monkeypatch.setattr(shutil, "rmtree", late)
    jobs.remove(job.id)
    asking.join()
    assert jobs.chunk_path(job.id, 0, 15).read_bytes() == b"again"
    assert jobs.get(job.id).state == "queued"


def test_a_full_database_is_a_named_error(tmp_path: Path) -> None:
    with closing(Jobs(Settings(data_dir=tmp_path))) as jobs:
        sa.event.listen(
            jobs._engine,
            "checkout",
            lambda connection, *_: connection.execute("PRAGMA max_page_count = 1"),
        )

        def fill() -> None:
            with named_outages("storage-unavailable", "Jobs cannot be stored"):
                for seed in range(100):
                    jobs.submit(sweep_request(seed=seed))

        with pytest.raises(Refused, match="at present: database or disk is full") as raised:
            fill()
        assert raised.value.code == "storage-full"


def test_a_sweep_waits_for_room_on_the_disk_and_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write, waits = job_store.write_whole, list[str]()
    settings = Settings(data_dir=tmp_path)
    monkeypatch.setattr(runner, "_FIRST_PAUSE_S", 0.05)

    def full(path: Path, content: bytes) -> None:
        if len(waits) < 3:
            raise OSError(errno.ENOSPC, "No space left on device", str(path))
        write(path, content)

    monkeypatch.setattr(job_store, "write_whole", full)
    with (
        closing(Jobs(settings)) as jobs,
        closing(Sweeps(settings, jobs, processes=False)) as sweeps,
    ):
        job = jobs.submit(sweep_request())
        sweeps.begin(job.id)
        while not jobs.status(job.id).ended:
            if (progress := sweeps.progress(job.id)) and progress.waits_for:
                waits.append(progress.waits_for)
            time.sleep(0.02)
        assert jobs.get(job.id).state == "finished"
    assert set(waits) == {"its storage (No space left on device)"}


@pytest.mark.parametrize("end", ["cancelled", "removed"])
def test_a_job_that_another_server_ends_is_stopped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, end: str
) -> None:
    monkeypatch.setattr(executors._ThisProcess, "submit", lambda *_: Future())
    monkeypatch.setattr(runner, "_WATCH_S", 0.02)
    settings = Settings(data_dir=tmp_path)
    with (
        closing(Jobs(settings)) as jobs,
        closing(Jobs(settings)) as others,
        closing(Sweeps(settings, jobs, processes=False)) as sweeps,
    ):
        job = others.submit(sweep_request())
        while others.get(job.id).state != "running":
            time.sleep(0.01)
        others.advance(job.id, "cancelled")
        if end == "removed":
            with writing(others._engine) as connection:
                connection.execute(sa.delete(job_table))
        deadline = time.monotonic() + PATIENCE
        while sweeps.progress(job.id) is not None:
            assert time.monotonic() < deadline
            time.sleep(0.01)
    assert "ERROR" not in {record.levelname for record in caplog.records}


def test_a_job_that_waits_for_its_turn_is_cancelled_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(executors._ThisProcess, "submit", lambda *_: Future())
    monkeypatch.setattr(runner, "_MOST_RUNNING", 1)
    settings = Settings(data_dir=tmp_path)
    with (
        closing(Jobs(settings)) as jobs,
        closing(Sweeps(settings, jobs, processes=False)) as sweeps,
    ):
        first, second = (jobs.submit(sweep_request(seed=seed)).id for seed in (1, 2))
        sweeps.begin(first)
        sweeps.begin(second)
        while jobs.status(first).state != "running":
            time.sleep(0.01)
        sweeps.cancel(second)
        assert jobs.status(second).state == "cancelled"
        jobs.remove(second)
        sweeps.cancel(first)
        assert jobs.status(first).state == "cancelled"


def test_a_reader_of_a_wide_table_has_few_rows_in_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(result_files, "_GROUP_NUMBERS", 100)
    columns = {f"c{k}": np.arange(13.0) for k in range(10)}
    paths = [tmp_path / f"{k}.parquet" for k in range(2)]
    for path in paths:
        parquet.write_table(pa.table(columns), path)
    table = tmp_path / "table.parquet"
    result_files._concatenate(paths, table)
    written = parquet.read_metadata(table)
    assert [written.row_group(k).num_rows for k in range(2)] == [13, 13]
    pieces = list(result_files.table_stream(table, "csv"))
    assert [piece.count(b"\n") for piece in pieces] == [11, 10, 6, 0]
