"""A database of SQLite: its file, which this account alone may read, its connections, and how
damage is found.
"""

from __future__ import annotations

import os
import sqlite3
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import sqlalchemy as sa

from veselova.service.access.sqlite_wal import wal_is_damaged
from veselova.service.api.private_folder import own_folder, restrict_file

__all__ = ["begin_immediately", "damage_of", "empty_log", "open_sqlite", "sqlite_path", "vacuum"]

#: Seconds that a connection waits for another's write.
_BUSY_S = 10

#: Seconds between two looks at what another process may be in the midst of writing.
_AGAIN_S = 0.05

#: Free pages are given back to the disk when they are this part of the file, and so many bytes at
#: least.
_FREE_PART = 0.25
_FREE_BYTES = 1_000_000

#: The option of a connection whose transactions take the lock for writing at their beginning.
_IMMEDIATE = "sqlite_immediate"


def sqlite_path(url: sa.URL) -> Path | None:
    """Return the file of a database of SQLite, None for one in memory or of another kind."""
    name = url.database or ""
    in_file = (
        url.get_backend_name() == "sqlite"
        and name not in ("", ":memory:")
        and not name.startswith("file:")
    )
    return Path(name) if in_file else None


def open_sqlite(url: sa.URL, path: Path | None) -> sa.Engine:
    """Return an engine on a database, whose folder and file are made where there are none.

    Raises InvalidInput for a folder that others may write, OSError where the file cannot be made.
    """
    if path is not None:
        own_folder(path.parent)
        # to open it beside SQLite would give up the locks of this process
        with suppress(FileExistsError):
            os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o600))
        for suffix in ("", "-wal", "-shm"):  # SQLite gives the latter two the mode of the first
            restrict_file(path.with_name(path.name + suffix))
    engine = sa.create_engine(url, pool_pre_ping=True)
    sa.event.listen(engine, "connect", _prepare)
    sa.event.listen(engine, "begin", _begin)
    return engine


def begin_immediately(connection: sa.Connection) -> sa.Connection:
    """Return a connection whose transactions hold the lock for writing from their beginning; on
    SQLite alone.
    """
    return connection.execution_options(**{_IMMEDIATE: True})


def _prepare(connection: sqlite3.Connection, _: Any) -> None:
    """Set a connection up: writers do not block readers, and what was committed survives the death
    of the machine.

    Transactions are begun here and not by Python's module, which would leave statements that change
    tables outside of them.
    """
    connection.isolation_level = None
    for pragma in (f"busy_timeout = {_BUSY_S * 1000}", "synchronous = FULL", "foreign_keys = ON"):
        connection.execute(f"PRAGMA {pragma}")
    deadline = time.monotonic() + _BUSY_S
    while True:
        try:
            connection.execute("PRAGMA journal_mode = WAL")
        except (
            sqlite3.OperationalError
        ) as error:  # of two that ask for it at once SQLite does not let one wait
            if "locked" not in str(error) or time.monotonic() > deadline:
                raise
            time.sleep(_AGAIN_S)
        else:
            return


def _begin(connection: sa.Connection) -> None:
    """Begin a transaction that writes; whatever only reads does so statement by statement."""
    if connection.get_execution_options().get(_IMMEDIATE, False):
        connection.exec_driver_sql("BEGIN IMMEDIATE")


def damage_of(engine: sa.Engine, path: Path) -> str:
    """Return what is damaged about a database, nothing where it is whole. Raises
    sqlalchemy.exc.DatabaseError.
    """
    log = path.with_name(path.name + "-wal")
    if wal_is_damaged(log):
        time.sleep(_AGAIN_S)  # another process may have been writing it
        if wal_is_damaged(log):
            return f"its log {log.name} does not hold what was written"
    with engine.connect() as connection:
        found = connection.exec_driver_sql("PRAGMA quick_check(1)").scalar_one()
    return "" if found == "ok" else str(found).splitlines()[-1]


def empty_log(engine: sa.Engine) -> None:
    """Move what the log has into the database, unless others are at work with it."""
    with engine.connect() as connection:
        connection.exec_driver_sql("PRAGMA wal_checkpoint(TRUNCATE)")


def vacuum(engine: sa.Engine) -> None:
    """Give the room of what was deleted back to the disk, where it is much. PostgreSQL does that by
    itself.
    """
    if engine.dialect.name != "sqlite":
        return
    with engine.connect() as connection:
        names = ("freelist_count", "page_count", "page_size")
        free, pages, size = (
            connection.exec_driver_sql(f"PRAGMA {name}").scalar_one() for name in names
        )
        if free * size >= _FREE_BYTES and free >= _FREE_PART * pages:
            connection.exec_driver_sql("VACUUM")
            connection.exec_driver_sql("PRAGMA wal_checkpoint(TRUNCATE)")
