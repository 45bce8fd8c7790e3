"""The database of the service: its two tables, and the one way to connect to it.

SQLite in write-ahead mode by default, PostgreSQL by ``VESELOVA_DATABASE_URL``. A new database gets
the tables of this module; one of another revision is refused.
``engine.connect()`` reads; whatever writes does so in ``writing(engine)``.
"""

from __future__ import annotations

import errno
import logging
import os
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import sqlalchemy as sa

from veselova.mechanics.core.errors import InvalidInput
from veselova.mechanics.core.folders import expand_home
from veselova.service.api.private_files import own_folder
from veselova.service.api.problem_details import Refused
from veselova.service.api.settings import Settings

_LOG = logging.getLogger("veselova.database")

metadata = sa.MetaData()


class _Moment(sa.TypeDecorator[datetime]):
    """A moment in UTC; SQLite returns it without a time zone."""

    impl = sa.DateTime(timezone=True)
    cache_ok = True

    def process_result_value(self, value: datetime | None, _: Any) -> datetime | None:
        """Return the moment with its time zone."""
        if value is None or value.tzinfo is not None:
            return value
        return value.replace(tzinfo=UTC)


#: One row for each sweep of an owner. ``id`` is the hash of the canonical request and its owner, so
#: that the same request is the same job. ``owner`` is that of the key which asked, empty without
#: one; ``bytes`` is the size of the results, estimated until the job has ended. The process
#: ``claimed_by`` runs the job, and renews its lease before ``claimed_until``.
jobs = sa.Table(
    "jobs",
    metadata,
    sa.Column("id", sa.String(32), primary_key=True),
    sa.Column("owner", sa.String(16), nullable=False),
    sa.Column("request", sa.Text, nullable=False),
    sa.Column("state", sa.String(16), nullable=False, index=True),
    sa.Column("detail", sa.Text, nullable=False),
    sa.Column("total", sa.BigInteger, nullable=False),
    sa.Column("done", sa.BigInteger, nullable=False),
    sa.Column("chunk_rows", sa.Integer, nullable=False),
    sa.Column("bytes", sa.BigInteger, nullable=False),
    sa.Column("created_at", _Moment, nullable=False),
    sa.Column("finished_at", _Moment),
    sa.Column("claimed_by", sa.String(32)),
    sa.Column("claimed_until", _Moment),
)

#: Keys that clients show; only the hash of a key is stored. Keys of one ``owner`` see the same
#: jobs.
keys = sa.Table(
    "keys",
    metadata,
    sa.Column("id", sa.String(16), primary_key=True),
    sa.Column("name", sa.String(100), nullable=False),
    sa.Column("sha256", sa.String(64), nullable=False, unique=True),
    sa.Column("scope", sa.String(16), nullable=False),
    sa.Column("owner", sa.String(16), nullable=False),
    sa.Column("created_at", _Moment, nullable=False),
    sa.Column("expires_at", _Moment),
    sa.Column("revoked_at", _Moment),
)

#: The revision of these tables; older ones of it have a column ``idempotency_key``, unused.
REVISION = "0014"

#: Seconds that a connection to SQLite waits for the write of another.
_BUSY_S = 10

#: What libpq gets unless the address states it: time limits of a connection (seconds), of
#: unacknowledged data (milliseconds) and of a statement.
_POSTGRESQL = {
    "connect_timeout": 10,
    "tcp_user_timeout": 20_000,
    "options": "-c statement_timeout=20s",
}

#: Failures of the disk or the database: trying again may help.
OUTAGES = (OSError, sa.exc.SQLAlchemyError)

#: How a system and PostgreSQL say that the disk is full.
_FULL = (errno.ENOSPC, errno.EDQUOT)
_FULL_STATE = "53100"


def connect(settings: Settings) -> sa.Engine:
    """Return an engine on the database of the settings, whose tables are there.

    Raises InvalidInput for an address that cannot be read or a folder that others may write,
    Refused (``database-damaged``, ``database-newer``), OSError or sqlalchemy.exc.SQLAlchemyError
    where it cannot be opened.
    """
    url = database_url(settings)
    if sqlite := url.get_backend_name() == "sqlite":
        path = Path(str(url.database))
        own_folder(path.parent)
        path.touch(0o600)  # the mode of its log, too
        # the driver opens no transactions: ``writing`` does
        options: dict[str, Any] = {"timeout": _BUSY_S, "isolation_level": None}
    else:
        options = {**_POSTGRESQL, **url.query}
    engine = sa.create_engine(url, pool_pre_ping=not sqlite, connect_args=options)
    try:
        if sqlite:
            # Writers do not block readers. Another that sets the mode just now locks the file.
            with suppress(sa.exc.OperationalError), engine.connect() as connection:
                connection.exec_driver_sql("PRAGMA journal_mode = WAL")
        with writing(engine) as connection:
            _migrate(connection)
    except BaseException as error:
        engine.dispose()
        if type(error) is sa.exc.DatabaseError:
            raise Refused(
                "database-damaged",
                f"The database {url.database} is damaged: {reason_of(error)}. Move it, with its "
                "-wal and -shm, into another folder, and start with a copy of it, or without one.",
            ) from error
        raise
    return engine


@contextmanager
def writing(engine: sa.Engine) -> Iterator[sa.Connection]:
    """Give a connection in a transaction that no other writer runs beside."""
    begin = (
        "BEGIN IMMEDIATE"
        if engine.dialect.name == "sqlite"
        else "SELECT pg_advisory_xact_lock(hashtext('veselova'))"
    )
    with engine.begin() as connection:
        connection.exec_driver_sql(begin)
        yield connection


def _migrate(connection: sa.Connection) -> None:
    """Make the tables of a new database; raises Refused (``database-newer``) for one
    of another revision.
    """
    found = None
    if sa.inspect(connection).has_table("alembic_version"):
        found = connection.execute(sa.text("SELECT version_num FROM alembic_version")).scalar()
    if found == REVISION:
        return
    if found is not None:
        raise Refused(
            "database-newer",
            f"The database has revision {found}, and this veselova reads {REVISION}; start the "
            "version that made it, or 0.14 once for a database of 0.10 to 0.13.",
        )
    from alembic import command
    from alembic.config import Config

    metadata.create_all(connection)
    config = Config()
    config.set_main_option("script_location", "veselova:migrations")
    config.attributes["connection"] = connection
    command.stamp(config, REVISION)


def database_url(settings: Settings) -> sa.URL:
    """Return the address of the database. Raises InvalidInput for one that cannot be read, or
    another kind of database.
    """
    stated = settings.database_url.get_secret_value()
    try:
        here = sa.URL.create("sqlite", database=str(settings.data_dir / "veselova.db"))
        url = sa.make_url(stated) if stated else here
    except sa.exc.ArgumentError:
        url = sa.URL.create("unreadable")
    if url.get_backend_name() == "postgresql":
        return url.set(drivername="postgresql+psycopg")
    # in memory it would be another database for each connection
    is_file = url.database and not url.database.startswith((":memory:", "file:"))
    if url.get_backend_name() != "sqlite" or not is_file:
        required = "an address sqlite:///PATH or postgresql://USER@HOST/NAME"
        raise InvalidInput(("VESELOVA_DATABASE_URL",), required, url.render_as_string())
    return url.set(database=str(expand_home(str(url.database), "VESELOVA_DATABASE_URL")))


@contextmanager
def named_outages(code: str, subject: str) -> Iterator[None]:
    """Raise Refused where the disk or the database fails in the block: ``storage-full`` where the
    disk is full, ``code`` else, with a sentence about ``subject``.
    """
    try:
        yield
    except OUTAGES as error:
        _LOG.warning("%s: %s", subject, reason_of(error))
        detail = f"{subject} at present: {public_reason(error)}."
        raise Refused("storage-full" if _is_full(error) else code, detail, retry_after=5) from error


def _cause(error: Exception) -> Any:
    """Return what the system or the driver of the database raised."""
    return getattr(error, "orig", None) or error


def _is_full(error: Exception) -> bool:
    cause = _cause(error)
    return (
        getattr(cause, "sqlite_errorcode", None) == sqlite3.SQLITE_FULL
        or getattr(cause, "sqlstate", None) == _FULL_STATE
        or getattr(cause, "errno", None) in _FULL
    )


def reason_of(error: Exception) -> str:
    """Return what the disk or the database says, without statements; for the log, since it may name
    addresses and paths.
    """
    return str(_cause(error))


def public_reason(error: Exception) -> str:
    """Return why the disk, the database or the cluster does not answer, without the addresses,
    ports, paths and roles that messages of servers and libraries may have.
    """
    cause = _cause(error)
    if isinstance(cause, sqlite3.Error):  # these messages name neither file nor statement
        return str(cause)
    number = errno.ENOSPC if _is_full(error) else getattr(cause, "errno", None) or 0
    return os.strerror(number) if number in errno.errorcode else "it does not answer"
