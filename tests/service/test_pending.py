"""Entries of the cache between their answers and the disk."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import anyio

from conftest import PATIENCE
from veselova.service.answers.cache import Cache
from veselova.service.answers.write_behind import WriteBehind


class SlowCache(Cache):
    """A cache whose disk stands still until it is let go."""

    def __init__(self, folder: Path, size: int = 10**6) -> None:
        super().__init__(folder, size)
        self.goes = threading.Event()
        self.goes.set()

    def write(self, contents: Mapping[str, bytes]) -> dict[str, int]:
        assert self.goes.wait(PATIENCE)
        return super().write(contents)


def content_of(cache: Cache, name: str) -> bytes | None:
    path = cache.find(name)
    return None if path is None else Path(path).read_bytes()


async def written(pending: WriteBehind, name: str) -> None:
    """Wait until an entry is on its way no more."""
    with anyio.fail_after(PATIENCE):
        while pending.find(name) is not None:
            await anyio.sleep(0.01)


def test_an_entry_is_there_while_it_is_being_written_and_after(tmp_path: Path) -> None:
    async def run() -> None:
        cache = SlowCache(tmp_path / "cache")
        pending = WriteBehind(cache)
        async with pending.writing():
            assert await pending.keep("first", b"1")
            assert pending.find("first") is None, (
                "the first is written before its answer leaves: nobody knows whether that works"
            )
            assert content_of(cache, "first") == b"1"
            cache.goes.clear()
            for name in ("a", "b", "a"):
                assert await pending.keep(name, name.encode())
            assert (pending.find("a"), pending.find("b"), pending.find("c")) == (b"a", b"b", None)
            assert cache.find("a") is None
            cache.goes.set()
            await written(pending, "b")
            assert (content_of(cache, "a"), content_of(cache, "b")) == (b"a", b"b")

    anyio.run(run)


def test_an_entry_is_written_before_its_answer_where_too_many_are_on_their_way(
    tmp_path: Path,
) -> None:
    async def run() -> None:
        cache = SlowCache(tmp_path / "cache")
        pending = WriteBehind(cache, most=10)
        async with pending.writing(), anyio.create_task_group() as tasks:
            assert await pending.keep("first", b"1")
            cache.goes.clear()
            assert await pending.keep("a", bytes(10))
            done = anyio.Event()

            async def keep_another() -> None:
                assert await pending.keep("b", b"b")
                assert content_of(cache, "b") == b"b"
                done.set()

            tasks.start_soon(keep_another)
            await anyio.sleep(0.1)
            assert not done.is_set()
            assert pending.find("b") is None
            cache.goes.set()
            await done.wait()
            await written(pending, "a")
            cache.goes.clear()
            assert await pending.keep("c", bytes(10))  # there is room again
            assert pending.find("c")
            cache.goes.set()

    anyio.run(run)


def test_an_entry_that_cannot_be_written_stays_and_those_after_it_are_not_promised(
    tmp_path: Path, caplog: Any
) -> None:
    async def run() -> None:
        folder = tmp_path / "cache"
        cache = SlowCache(folder)
        pending = WriteBehind(cache)
        async with pending.writing():
            assert await pending.keep("first", b"1")
            (folder / "first.kept").unlink()
            folder.rmdir()
            folder.write_text("a file in its place")
            assert await pending.keep("promised", b"2")
            with anyio.fail_after(PATIENCE):
                while "answers are not cached" not in caplog.text:
                    await anyio.sleep(0.01)
            for _ in range(2):
                assert not await pending.keep("refused", b"3")
            assert caplog.text.count("answers are not cached") == 1
            assert (pending.find("promised"), pending.find("refused")) == (b"2", None)
            folder.unlink()
            assert await pending.keep("refused", b"3")
            await written(pending, "promised")
            assert (content_of(cache, "promised"), content_of(cache, "refused")) == (b"2", b"3")

    anyio.run(run)


def test_what_is_on_its_way_is_written_at_the_end(tmp_path: Path) -> None:
    async def run() -> None:
        cache = SlowCache(tmp_path / "cache")
        pending = WriteBehind(cache)
        async with pending.writing():
            assert await pending.keep("first", b"1")
            cache.goes.clear()
            for k in range(50):
                assert await pending.keep(str(k), bytes(k))
            threading.Timer(0.1, cache.goes.set).start()
        assert all(content_of(cache, str(k)) == bytes(k) for k in range(50))
        assert len(list((tmp_path / "cache").iterdir())) == 51

    anyio.run(run)


def test_the_cache_keeps_to_its_size_when_entries_are_written_together(tmp_path: Path) -> None:
    async def run() -> None:
        cache = SlowCache(tmp_path / "cache", size=1000)
        pending = WriteBehind(cache)
        async with pending.writing():
            for k in range(40):
                assert await pending.keep(str(k), bytes(100))
                await anyio.sleep(0.001)
        assert await pending.keep("last", bytes(100))
        assert cache.find("last")
        assert sum(path.stat().st_size for path in (tmp_path / "cache").iterdir()) <= 1000

    anyio.run(run)
