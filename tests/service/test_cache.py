"""The cache and the worker's files, where the disk does not do as it is told."""

from __future__ import annotations

import asyncio
import os
import pickle
import threading
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hostile import GOOD
from veselova.mechanics.results.trajectory import Trajectory
from veselova.service.answers.cache import Cache
from veselova.service.answers.cache_entry import DamagedEntry, Entry, read_entry
from veselova.service.answers.rendering import Representation, render_kept, render_solution
from veselova.service.answers.spool import Spool, SpooledResponse
from veselova.service.api.problem_details import Refused
from veselova.service.api.request_models import TrajectoryRequest, read_request
from veselova.service.workers.tasks import solve_request

IN_MEMORY = Representation("json", "identity")

REQUEST = read_request(TrajectoryRequest, GOOD)


@pytest.fixture(scope="module")
def motion() -> Trajectory:
    return solve_request(REQUEST)


def put(cache: Cache, name: str, motion: Trajectory) -> int:
    """Keep an entry as a worker and its server do, and return its bytes."""
    entry = cache.entry(name)
    assert entry
    size = entry.write(REQUEST.model_dump(), motion)
    if size and cache.is_full(size):
        cache.make_room()
    return size


def test_the_entry_used_longest_ago_goes_first(tmp_path: Path, motion: Trajectory) -> None:
    size = put(Cache(tmp_path / "measured", 10**6), "a", motion)
    cache = Cache(tmp_path / "cache", 3 * size - 1)
    for name in "ab":
        assert put(cache, name, motion) == size
    # a moment ago: clocks of files go by some milliseconds
    for path in (tmp_path / "cache").iterdir():
        os.utime(path, ns=(path.stat().st_atime_ns, path.stat().st_mtime_ns - 10**9))
    assert cache.find("a")
    assert put(cache, "c", motion)
    found = {name: cache.find(name) for name in "abc"}
    assert found["b"] is None
    assert found["a"] is not None
    assert np.array_equal(read_entry(str(found["a"]))[1].frame, motion.frame)
    small = Cache(tmp_path / "small", size - 1)
    assert put(small, "d", motion) == 0
    assert not list((tmp_path / "small").iterdir())


def test_many_writers_keep_the_folder_within_its_size(tmp_path: Path, motion: Trajectory) -> None:
    size = put(Cache(tmp_path / "measured", 10**6), "a", motion)
    failures: list[Exception] = []

    def write(number: int) -> None:
        cache = Cache(tmp_path / "cache", 12 * size)
        try:
            for i in range(40):
                assert put(cache, f"{number}-{i}", motion) == size
                if found := cache.find(f"{number}-{i}"):
                    with suppress(FileNotFoundError):  # another writer needed the room in between
                        read_entry(str(found))
        except Exception as error:
            failures.append(error)

    threads = [threading.Thread(target=write, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failures
    assert put(Cache(tmp_path / "cache", 12 * size), "last", motion)
    assert sum(path.stat().st_size for path in (tmp_path / "cache").iterdir()) <= 12 * size


def test_why_nothing_is_kept_is_said_once_until_something_is_again(
    tmp_path: Path, motion: Trajectory, caplog: Any
) -> None:
    cache = Cache(tmp_path / "cache", 10**6)
    for _ in range(2):
        cache.report("No space left on device")
    assert caplog.text.count("No space left on device") == 1
    assert put(cache, "a", motion)
    cache.report("No space left on device")
    assert caplog.text.count("No space left on device") == 2


@pytest.fixture
def full_disk(tmp_path: Path) -> str:
    """A name whose file takes nothing: a link to the device that is always full."""
    (tmp_path / "full").symlink_to("/dev/full")
    return str(tmp_path / "full")


def test_an_answer_outlives_a_disk_too_full_to_keep_it(tmp_path: Path, full_disk: str) -> None:
    answer = tmp_path / "answer"
    delivery = render_solution(
        pickle.dumps(GOOD),
        Representation("json", "identity", str(answer)),
        Entry(str(tmp_path / "entry"), full_disk, 10**6),
    )
    assert delivery.not_stored == "No space left on device"
    assert delivery.stored == 0
    assert answer.read_bytes()
    assert list(tmp_path.iterdir()) == [answer]


def test_a_disk_too_full_for_the_answer_itself_is_a_refusal(full_disk: str) -> None:
    with pytest.raises(Refused) as raised:
        render_solution(pickle.dumps(GOOD), Representation("csv", "identity", full_disk), None)
    assert raised.value.code == "storage-full"
    assert not Path(full_disk).is_symlink()
    assert Path("/dev/full").exists()


@pytest.mark.parametrize("form", ["json", "npz", "csv"])
@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"certified": True},
        {"digits": 30, "certified": True},
        {"problem": {**GOOD["problem"], "A": [3 * 10**30, 2 * 10**30, 10**30]}},
    ],
)
def test_what_was_kept_is_restored_with_the_seconds_of_its_computation(
    tmp_path: Path, changes: dict[str, Any], form: str
) -> None:
    entry, wanted = (
        Entry(str(tmp_path / "kept"), str(tmp_path / "part"), 10**6),
        Representation(form, "identity"),
    )
    made = render_solution(pickle.dumps({**GOOD, **changes}), wanted, entry)
    assert made.stored == (tmp_path / "kept").stat().st_size
    for again in (
        render_kept(entry.path, wanted),
        render_solution(pickle.dumps({**GOOD, **changes}), wanted, entry),
    ):
        assert (again.body, again.provenance, again.cached) == (made.body, made.provenance, True)
        assert again.stored == 0
    with pytest.raises(FileNotFoundError):
        render_kept(str(tmp_path / "none"), IN_MEMORY)


@pytest.mark.parametrize(
    "content", [b"", b"1234", b"{}\n" + bytes(4), b"something else altogether"]
)
def test_what_is_no_entry_is_said_to_be_damaged(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "other").write_bytes(content)
    with pytest.raises(DamagedEntry):
        render_kept(str(tmp_path / "other"), IN_MEMORY)
    entry = Entry(str(tmp_path / "other"), str(tmp_path / "part"), 10**6)
    made = render_solution(pickle.dumps(GOOD), IN_MEMORY, entry)
    assert (made.cached, made.damaged) == (False, True)
    assert made.stored
    assert render_kept(str(tmp_path / "other"), IN_MEMORY).body == made.body


def test_what_follows_from_the_rest_is_the_same_when_it_is_restored(tmp_path: Path) -> None:
    """Spheroconic coordinates are kept where the engine found them; where it did not, they follow
    from the frame.
    """
    for method in ("theta", "angles"):
        request = {**GOOD, "method": method}
        entry = Entry(str(tmp_path / method), str(tmp_path / "part"), 10**6)
        render_solution(pickle.dumps({**request, "outputs": ["q"]}), IN_MEMORY, entry)
        _, kept = read_entry(entry.path)
        expected = solve_request(read_request(TrajectoryRequest, request))
        for name in expected.problem.outputs:
            assert np.array_equal(kept.series(name), expected.series(name)), name


def test_an_answer_too_large_for_the_cache_leaves_no_file(tmp_path: Path) -> None:
    entry = Entry(str(tmp_path / "none"), str(tmp_path / "part"), 200)
    assert render_solution(pickle.dumps(GOOD), IN_MEMORY, entry).stored == 0
    assert not list(tmp_path.iterdir())


def test_the_spool_ends_with_its_server_and_what_a_killed_one_left_goes_too(
    tmp_path: Path, monkeypatch: Any
) -> None:
    first, orphan = Spool(tmp_path, 100, 100), tmp_path / "veselova-spool-orphan"
    first.open()
    place = first.place("", 10)
    assert place
    Path(place.path).write_text("on its way")
    orphan.mkdir()
    monkeypatch.setattr("veselova.service.answers.spool._NEW_S", -1.0)
    second = Spool(tmp_path, 100, 100)
    second.open()
    assert Path(place.path).exists()
    assert not orphan.exists()
    first.close()
    second.close()
    assert not list(tmp_path.iterdir())


@pytest.fixture
def narrow(tmp_path: Path) -> Iterator[Spool]:
    """A spool of 1000 bytes, of which one caller has 400."""
    spool = Spool(tmp_path, 1000, 400)
    spool.open()
    yield spool
    spool.close()


def refused(spool: Spool, caller: str, promised: int) -> bool:
    try:
        spool.place(caller, promised)
    except Refused as error:
        return error.code == "storage-full"
    return False


def test_the_bytes_of_the_spool_are_bounded_and_each_callers_share_of_them(narrow: Spool) -> None:
    held = [narrow.place(caller, size) for caller, size in (("a", 300), ("b", 350), ("c", 200))]
    assert refused(narrow, "a", 101)  # its own
    assert refused(narrow, "d", 151)  # all
    assert not refused(narrow, "a", 100)  # and nobody has it any more
    assert not refused(narrow, "d", 150)
    assert not refused(narrow, "a", 100)
    held[0].let_go()  # type: ignore[union-attr]
    assert not refused(narrow, "a", 400)


def test_an_answer_that_may_be_larger_than_the_share_of_its_caller_is_given_alone(
    narrow: Spool,
) -> None:
    place = narrow.place("a", 10**9)
    assert place
    assert place.bytes == 400
    assert refused(narrow, "a", 1)
    assert not refused(narrow, "b", 400)


def test_an_answer_is_counted_with_its_own_bytes_until_it_is_read(narrow: Spool) -> None:
    place = narrow.place("a", 400)
    assert place
    Path(place.path).write_bytes(bytes(250))
    response = SpooledResponse(place, {})
    assert refused(narrow, "a", 151)
    assert not refused(narrow, "a", 150)
    del place

    async def read() -> list[int]:
        sent = []

        async def send(message: Any) -> None:
            assert refused(narrow, "a", 151)
            sent.append(len(message.get("body", b"")))

        async def receive() -> Any:
            await asyncio.Event().wait()

        await response({"type": "http"}, receive, send)
        return sent

    assert sum(asyncio.run(read())) == 250
    assert not refused(narrow, "a", 400)
