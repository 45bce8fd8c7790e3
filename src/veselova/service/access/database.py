"""The database of the service: its tables, its migrations, and the one way to connect to it.

SQLite in write-ahead mode by default, PostgreSQL by ``VESELOVA_DATABASE_URL``. The tables are made
and changed by the migrations in ``veselova.migrations`` alone; what is written here must say the
same, and a test compares the two. ``engine.connect()`` reads; whatever writes does so in
``writing(engine)``.
"""

from __future__ import annotations

import errno
import os
import sqlite3
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import sqlalchemy as sa

from veselova.mechanics.core.errors import InvalidInput, show
from veselova.mechanics.core.folders import expand_home
from veselova.service.access.sqlite_file import (
    begin_immediately,
    damage_of,
    empty_log,
    open_sqlite,
    sqlite_path,
)
from veselova.service.api.problem_details import Refused
from veselova.service.api.settings import Settings

__all__ = [
    "REVISION",
    "api_keys",
    "chunks",
    "connect",
    "database_url",
    "idempotency_keys",
    "in_utc",
    "is_outage",
    "jobs",
    "metadata",
    "public_reason",
    "reason_of",
    "schema_differences",
    "writing",
]

metadata = sa.MetaData()

#: One row for each sweep of an owner. ``id`` is the hash of the canonical request and its owner, so
#: that the same request is the same job. ``owner`` is that of the key which asked, empty where none
#: is shown; ``bytes`` what its results may take, or took.
jobs = sa.Table(
    "jobs",
    metadata,
    sa.Column("id", sa.String(32), primary_key=True),
    sa.Column("request", sa.Text, nullable=False),
    sa.Column("state", sa.String(16), nullable=False, index=True),
    sa.Column("detail", sa.Text, nullable=False, server_default=""),
    sa.Column("total", sa.BigInteger, nullable=False),
    sa.Column("chunk_rows", sa.Integer, nullable=False),
    sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
    sa.Column("finished_at", sa.DateTime(timezone=True)),
    sa.Column("owner", sa.String(16), nullable=False, server_default=""),
    sa.Column("bytes", sa.BigInteger, nullable=False, server_default="0"),
)

#: The finished chunks of a job, each a file whose content has this hash.
chunks = sa.Table(
    "chunks",
    metadata,
    sa.Column(
        "job_id", sa.String(32), sa.ForeignKey("jobs.id", ondelete="CASCADE"), primary_key=True
    ),
    sa.Column("position", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("rows", sa.Integer, nullable=False),
    sa.Column("sha256", sa.String(64), nullable=False),
)

#: What a client said with ``Idempotency-Key``, and the job that it got. A row is written before its
#: job is.
idempotency_keys = sa.Table(
    "idempotency_keys",
    metadata,
    sa.Column("owner", sa.String(16), primary_key=True),
    sa.Column("key", sa.String(255), primary_key=True),
    sa.Column(
        "job_id",
        sa.String(32),
        sa.ForeignKey("jobs.id", ondelete="CASCADE", deferrable=True, initially="DEFERRED"),
        nullable=False,
    ),
    sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
)

#: Keys that clients show; only the hash of a key is known here. Keys of one ``owner`` see the same
#: jobs and answers.
api_keys = sa.Table(
    "api_keys",
    metadata,
    sa.Column("id", sa.String(16), primary_key=True),
    sa.Column("name", sa.String(100), nullable=False),
    sa.Column("sha256", sa.String(64), nullable=False, unique=True),
    sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
    sa.Column("revoked_at", sa.DateTime(timezone=True)),
    sa.Column("scope", sa.String(16), nullable=False, server_default="solve"),
    sa.Column("owner", sa.String(16), nullable=False, server_default=""),
    sa.Column("expires_at", sa.DateTime(timezone=True)),
)

#: The revision of the tables here, to which the last of ``veselova.migrations`` leads.
REVISION = "0003"

#: Alembic keeps the migration that runs in a module of its own, so two must not run in one process
#: at once.
_MIGRATING = threading.Lock()

#: What libpq is told of a server that does not answer: how long it waits for a connection (in
#: seconds), and for what it sent to be taken (in milliseconds), and when it looks whether a silent
#: one is still there (seconds, and how often).
_PATIENCE = {
    "connect_timeout": 10,
    "tcp_user_timeout": 20_000,
    "keepalives_idle": 10,
    "keepalives_interval": 5,
    "keepalives_count": 3,
}

#: Seconds that a statement may take on PostgreSQL, what it waits for others included.
_STATEMENT_S = 20

#: Failures of a statement or its values. The database is there: asking again changes nothing.
_NO_OUTAGE = (
    sa.exc.DataError,
    sa.exc.IntegrityError,
    sa.exc.ProgrammingError,
    sa.exc.NotSupportedError,
)


def connect(settings: Settings) -> sa.Engine:
    """Return an engine on the database of the settings, its tables brought up to date.

    Raises InvalidInput for an address that cannot be read or a folder that others may write,
    Refused (``database-damaged``, ``database-newer``), OSError or sqlalchemy.exc.SQLAlchemyError
    where it cannot be opened.
    """
    url = database_url(settings)
    path = sqlite_path(url)
    engine = open_sqlite(url, path) if url.get_backend_name() == "sqlite" else _open_postgresql(url)
    try:
        with _MIGRATING:
            _bring_up_to_date(engine, path)
    except BaseException:
        engine.dispose()
        raise
    return engine


def _open_postgresql(url: sa.URL) -> sa.Engine:
    """Return an engine on a server, which may be far away, and is not waited for without end. What
    the address states of connections goes first; statements have ``_STATEMENT_S`` in any case.
    """
    from veselova.service.access.patient_connection import listen_patiently

    stated = {name: value for name, value in _PATIENCE.items() if name not in url.query}
    engine = sa.create_engine(url, pool_pre_ping=True, connect_args=stated)
    sa.event.listen(engine, "connect", _limit_statements)
    listen_patiently(engine)
    return engine


def _limit_statements(connection: Any, _: Any) -> None:
    with connection.cursor() as cursor:
        cursor.execute(f"SET statement_timeout = '{_STATEMENT_S}s'")
    connection.commit()


def _bring_up_to_date(engine: sa.Engine, path: Path | None) -> None:
    try:
        damage = "" if path is None else damage_of(engine, path)
        if not damage:
            with writing(engine, "migrations") as connection:
                changed = False if _is_current(connection) else _migrate(connection)
            if changed and path is not None:
                empty_log(engine)  # tables that are in the file outlive what may happen to the log
            lacking = sorted(metadata.tables.keys() - set(sa.inspect(engine).get_table_names()))
            damage = f"it lacks the tables {', '.join(lacking)}" if lacking else ""
    except sa.exc.OperationalError:
        raise
    except sa.exc.DatabaseError as error:
        if path is None:
            raise
        damage = reason_of(error)
    if damage:
        raise Refused("database-damaged", _what_to_do(damage, path))


def _what_to_do(damage: str, path: Path | None) -> str:
    if path is None:
        return f"The database is damaged: {damage}. Restore it from a copy."
    return (
        f"The database {path} is damaged: {damage}. Stop every veselova that uses it and "
        f"move {path.name}, {path.name}-wal and "
        f"{path.name}-shm together into another folder; then put a copy of it in their "
        "place, or start without one. "
        f"`sqlite3 {path.name} .recover` in that folder prints what can be read, the keys "
        "among it. Where the log alone is "
        "damaged, the database without it is as it was before what the log has."
    )


@contextmanager
def writing(engine: sa.Engine, lock: str = "") -> Iterator[sa.Connection]:
    """Give a connection whose transaction writes, and commits at the end of the block.

    On SQLite it holds the one lock for writing from its first statement on, so nothing that it read
    can change before it writes. On PostgreSQL ``lock`` names what two such transactions may not do
    at once.
    """
    with engine.connect() as plain:
        connection = begin_immediately(plain)
        with connection.begin():
            if lock and connection.dialect.name == "postgresql":
                connection.execute(
                    sa.text("SELECT pg_advisory_xact_lock(hashtext(:name))"),
                    {"name": f"veselova {lock}"},
                )
            yield connection


def database_url(settings: Settings) -> sa.URL:
    """Return the address of the database. Raises InvalidInput for one that cannot be read, or
    another kind of database.
    """
    stated = settings.database_url.get_secret_value()
    try:
        url = sa.make_url(stated or f"sqlite:///{settings.data_dir / 'veselova.db'}")
    except sa.exc.ArgumentError:
        url = sa.URL.create("unreadable")
    # SQLite in memory would be another database for each connection.
    nowhere = not url.database or url.database.startswith((":memory:", "file:"))
    if url.get_backend_name() == "sqlite" and nowhere:
        raise InvalidInput(
            ("VESELOVA_DATABASE_URL",), "the path of a file after sqlite:///", show(stated)
        )
    if url.get_backend_name() == "sqlite" and url.database:
        url = url.set(database=str(expand_home(url.database, "VESELOVA_DATABASE_URL")))
    if url.get_backend_name() not in ("sqlite", "postgresql"):
        raise InvalidInput(
            ("VESELOVA_DATABASE_URL",),
            "an address sqlite:///PATH or postgresql://USER@HOST/NAME",
            url.render_as_string(),
        )
    # A bare postgresql:// would mean psycopg2, which is not what the extra installs.
    return url.set(drivername="postgresql+psycopg") if url.drivername == "postgresql" else url


def _migrate(connection: sa.Connection) -> bool:
    """Run the missing migrations and return whether there were any; raises Refused
    (``database-newer``).
    """
    from veselova.service.access.schema_migrations import LaterVersion, migrate

    try:
        return migrate(connection, metadata)
    except LaterVersion as error:
        detail = (
            "The database was made by a later version of veselova, which has to be started "
            f"instead ({error})."
        )
        raise Refused("database-newer", detail) from None


def _is_current(connection: sa.Connection) -> bool:
    """Return whether the database has seen all migrations."""
    if not sa.inspect(connection).has_table("alembic_version"):
        return False
    found = connection.execute(sa.text("SELECT version_num FROM alembic_version")).scalars().all()
    return list(found) == [REVISION]


def in_utc(moment: datetime) -> datetime:
    """Return a moment in UTC; SQLite gives back what was stored in UTC without saying so."""
    return moment.replace(tzinfo=UTC) if moment.tzinfo is None else moment.astimezone(UTC)


def reason_of(error: Exception) -> str:
    """Return what the disk or the database says, without statements; for the log, since it may name
    addresses and paths.
    """
    return str(getattr(error, "orig", None) or getattr(error, "strerror", None) or error).rstrip(
        "."
    )


def public_reason(error: Exception) -> str:
    """Return why the disk, the database or the cluster does not answer, for everybody to read: no
    address, port, path or role, which the messages of servers and libraries may have.
    """
    cause = getattr(error, "orig", None) or error
    if isinstance(cause, sqlite3.Error):  # these messages name neither file nor statement
        return str(cause).rstrip(".")
    number = getattr(cause, "errno", None) or 0
    if number in errno.errorcode:
        return os.strerror(number)
    return "it does not answer"


def is_outage(error: Exception) -> bool:
    """Return whether a failure says that the disk or the database does not answer at present, so
    that asking again may help.
    """
    return isinstance(error, (OSError, sa.exc.SQLAlchemyError)) and not isinstance(
        error, _NO_OUTAGE
    )


def schema_differences(engine: sa.Engine) -> list[Any]:
    """Return what the tables in the database have that those of this module have not, and the other
    way round.
    """
    from veselova.service.access.schema_migrations import differences

    with engine.connect() as connection:
        return differences(connection, metadata)
