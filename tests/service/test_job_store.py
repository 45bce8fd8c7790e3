"""The store of jobs and keys, on SQLite and on PostgreSQL alike."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest
from test_sweeps import request as sweep_request

from veselova.mechanics.core.errors import InvalidInput
from veselova.service.access.keys import open_keys
from veselova.service.api.problem_details import Refused
from veselova.service.api.settings import Settings
from veselova.service.cli.local_sweep import run_sweep
from veselova.service.sweeps import job_store
from veselova.service.sweeps.job_store import JobEnded, Jobs


@pytest.fixture
def opened() -> Iterator[Callable[[Settings], Jobs]]:
    """Opens stores, and closes them at the end of the test."""
    with ExitStack() as stack:
        yield lambda settings: stack.enter_context(closing(Jobs(settings)))


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


def test_a_sweep_that_many_ask_for_at_once_is_one_job(
    store: Settings, opened: Callable[[Settings], Jobs]
) -> None:
    jobs = opened(store)
    for seed in range(5):
        sweep = sweep_request(seed=seed)
        submitted = together(lambda _, sweep=sweep: jobs.submit(sweep), 8)
        assert {job.id for job in submitted} == {sweep.id}
    assert jobs.counts() == {"queued": 5}


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


def test_limits_are_named_before_a_job_is_made(
    store: Settings, opened: Callable[[Settings], Jobs], monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr("veselova.service.api.sweep_request.MOST_PROBLEMS", 10)
        with pytest.raises(InvalidInput, match="at most 10 problems; given 15"):
            sweep_request()
    assert sweep_request(engine="numeric", times=[1]).chunk_rows < 15
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


def test_a_job_goes_through_its_states_and_keeps_its_dates(
    store: Settings, opened: Callable[[Settings], Jobs]
) -> None:
    jobs = opened(store)
    job = jobs.submit(sweep_request())
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
    jobs.remove(job.id)
    assert jobs.newest() == []
    assert jobs.submit(sweep_request(seed=8)).id == sweep_request(seed=8).id


def test_a_key_is_known_until_it_is_revoked(store: Settings) -> None:
    keys = open_keys(store)
    key, text = keys.create("Sophie")
    assert keys.holder(text) == key
    assert keys.holder(text[:-1] + ("a" if text[-1] != "a" else "b")) is None
    assert keys.revoke(key.id).revoked_at >= key.created_at
    assert keys.holder(text) is None
    assert [known.id for known in keys.list()] == [key.id]
    keys.close()


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
