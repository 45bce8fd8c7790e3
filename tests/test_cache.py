"""The cache and the worker's files, where the disk does not do as it is told."""

from __future__ import annotations

import errno
import shutil
import threading
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from hostile import GOOD
from veselova.service.cache import Cache
from veselova.service.delivery import DamagedEntry, Wanted, restored, solved
from veselova.service.problem_details import Refused
from veselova.service.spool import Spool

IN_MEMORY = Wanted("json", "identity")


def put(cache: Cache, folder: Path, name: str, size: int = 400) -> bool:
    source = folder / "source"
    source.write_bytes(name.encode()[:1] * size)
    return cache.put(name, source)


def test_the_entry_used_longest_ago_goes_first(tmp_path: Path) -> None:
    cache = Cache(tmp_path / "cache", 1000)
    assert put(cache, tmp_path, "a")
    assert put(cache, tmp_path, "b")
    assert cache.find("a")
    assert put(cache, tmp_path, "c")
    found = {name: cache.find(name) for name in "abc"}
    assert found["b"] is None
    assert found["a"] is not None
    assert found["a"].read_bytes() == b"a" * 400
    assert not put(cache, tmp_path, "d", size=1001)
    assert cache.find("a")


def test_many_writers_keep_the_folder_within_its_size(tmp_path: Path) -> None:
    failures: list[Exception] = []

    def write(number: int) -> None:
        cache, folder = Cache(tmp_path / "cache", 5000), tmp_path / str(number)
        folder.mkdir()
        try:
            for i in range(40):
                assert put(cache, folder, f"{number}-{i}")
                if found := cache.find(f"{number}-{i}"):
                    with suppress(FileNotFoundError):  # another writer needed the room in between
                        assert len(found.read_bytes()) == 400
        except Exception as error:
            failures.append(error)

    threads = [threading.Thread(target=write, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failures
    assert put(Cache(tmp_path / "cache", 5000), tmp_path, "last")
    assert sum(path.stat().st_size for path in (tmp_path / "cache").iterdir()) <= 5000


def test_a_full_disk_is_reported_once_and_leaves_nothing_behind(tmp_path: Path, monkeypatch: Any, caplog: Any) -> None:
    cache = Cache(tmp_path / "cache", 1000)
    real = shutil.move

    def full(source: Path, target: Path) -> None:
        target.write_bytes(b"half")
        raise OSError(errno.ENOSPC, "No space left on device", str(target))

    monkeypatch.setattr(shutil, "move", full)
    assert not put(cache, tmp_path, "a")
    assert not put(cache, tmp_path, "b")
    assert caplog.text.count("No space left on device") == 1
    assert not list((tmp_path / "cache").iterdir())
    monkeypatch.setattr(shutil, "move", real)
    assert put(cache, tmp_path, "a")
    monkeypatch.setattr(shutil, "move", full)
    assert not put(cache, tmp_path, "b")
    assert caplog.text.count("No space left on device") == 2


@pytest.fixture
def full_disk(tmp_path: Path) -> str:
    """A name whose file takes nothing: a link to the device that is always full."""
    (tmp_path / "full").symlink_to("/dev/full")
    return str(tmp_path / "full")


def test_an_answer_outlives_a_disk_too_full_to_keep_it(full_disk: str) -> None:
    delivery = solved(GOOD, IN_MEMORY, full_disk)
    assert delivery.body
    assert delivery.not_stored == "No space left on device"


def test_a_disk_too_full_for_the_answer_itself_is_a_refusal(full_disk: str) -> None:
    with pytest.raises(Refused) as raised:
        solved(GOOD, Wanted("csv", "identity", full_disk), None)
    assert raised.value.code == "storage-full"
    assert not Path(full_disk).is_symlink()
    assert Path("/dev/full").exists()


def test_what_was_kept_is_restored_with_the_seconds_of_its_computation(tmp_path: Path) -> None:
    made = solved(GOOD, IN_MEMORY, str(tmp_path / "kept.npz"))
    assert restored(str(tmp_path / "kept.npz"), IN_MEMORY) == made
    (tmp_path / "other.npz").write_bytes(b"PK\x03\x04 something else")
    with pytest.raises(DamagedEntry):
        restored(str(tmp_path / "other.npz"), IN_MEMORY)
    with pytest.raises(FileNotFoundError):
        restored(str(tmp_path / "none.npz"), IN_MEMORY)


def test_the_spool_ends_with_its_server_and_what_a_killed_one_left_goes_too(tmp_path: Path, monkeypatch: Any) -> None:
    first, orphan = Spool(tmp_path), tmp_path / "veselova-spool-orphan"
    first.open()
    place = first.place()
    assert place
    Path(place).write_text("on its way")
    orphan.mkdir()
    monkeypatch.setattr("veselova.service.spool._NEW_S", -1.0)
    second = Spool(tmp_path)
    second.open()
    assert Path(place).exists()
    assert not orphan.exists()
    first.close()
    second.close()
    assert not list(tmp_path.iterdir())
