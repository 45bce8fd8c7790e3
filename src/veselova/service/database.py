"""The database of the service: its tables, its migrations, and the one way to connect to it.

SQLite in write-ahead mode by default, PostgreSQL by ``VESELOVA_DATABASE_URL``. The tables are made and changed by the migrations
in ``veselova.migrations`` alone; what is written here must say the same, and a test compares the two.
"""

from __future__ import annotations

import threading
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import sqlalchemy as sa
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.runtime.environment import EnvironmentContext
from alembic.runtime.migration import MigrationContext, MigrationStep
from alembic.script import ScriptDirectory

from veselova.mechanics.errors import InvalidInput
from veselova.service.settings import Settings

__all__ = [
    "api_keys",
    "chunks",
    "connect",
    "database_url",
    "idempotency_keys",
    "in_utc",
    "jobs",
    "metadata",
    "reason_of",
    "schema_differences",
]

metadata = sa.MetaData()

#: One row for each sweep. ``id`` is the hash of the canonical request, so that the same request is the same job.
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
)

#: The finished chunks of a job, each a file whose content has this hash.
chunks = sa.Table(
    "chunks",
    metadata,
    sa.Column("job_id", sa.String(32), sa.ForeignKey("jobs.id", ondelete="CASCADE"), primary_key=True),
    sa.Column("position", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("rows", sa.Integer, nullable=False),
    sa.Column("sha256", sa.String(64), nullable=False),
)

#: What a client said with ``Idempotency-Key``, and the job that it got.
idempotency_keys = sa.Table(
    "idempotency_keys",
    metadata,
    sa.Column("key", sa.String(255), primary_key=True),
    sa.Column("job_id", sa.String(32), sa.ForeignKey("jobs.id", ondelete="CASCADE"), nullable=False),
)

#: Keys that clients show; only the hash of a key is known here.
api_keys = sa.Table(
    "api_keys",
    metadata,
    sa.Column("id", sa.String(16), primary_key=True),
    sa.Column("name", sa.String(100), nullable=False),
    sa.Column("sha256", sa.String(64), nullable=False, unique=True),
    sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
    sa.Column("revoked_at", sa.DateTime(timezone=True)),
)

#: Seconds that a connection to SQLite waits for another's write.
_BUSY_S = 10

#: Alembic keeps the migration that runs in a module of its own, so two must not run in one process at once.
_MIGRATING = threading.Lock()


def connect(settings: Settings) -> sa.Engine:
    """Return an engine on the database of the settings, its tables brought up to date.

    Raises InvalidInput for an address that cannot be read, OSError or sqlalchemy.exc.SQLAlchemyError where it cannot be opened.
    """
    url = database_url(settings)
    if url.get_backend_name() == "sqlite" and url.database:
        Path(url.database).parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    engine = sa.create_engine(url, pool_pre_ping=True)
    if url.get_backend_name() == "sqlite":
        sa.event.listen(engine, "connect", _prepare_sqlite)
    with _MIGRATING, engine.begin() as connection:
        _migrate(connection)
    return engine


def database_url(settings: Settings) -> sa.URL:
    """Return the address of the database. Raises InvalidInput for one that cannot be read, or another kind of database."""
    stated = settings.database_url.get_secret_value()
    try:
        url = sa.make_url(stated or f"sqlite:///{settings.data_dir / 'veselova.db'}")
    except sa.exc.ArgumentError:
        url = sa.URL.create("unreadable")
    if url.get_backend_name() not in ("sqlite", "postgresql"):
        raise InvalidInput(
            ("VESELOVA_DATABASE_URL",), "an address sqlite:///PATH or postgresql://USER@HOST/NAME", url.render_as_string()
        )
    # A bare postgresql:// would mean psycopg2, which is not what the extra installs.
    return url.set(drivername="postgresql+psycopg") if url.drivername == "postgresql" else url


def _prepare_sqlite(connection: Any, _: Any) -> None:
    """Set a connection up: writers do not block readers, and what was committed survives the death of the machine."""
    for pragma in ("journal_mode = WAL", "synchronous = FULL", "foreign_keys = ON", f"busy_timeout = {_BUSY_S * 1000}"):
        connection.execute(f"PRAGMA {pragma}")


def _migrate(connection: sa.Connection) -> None:
    """Run the migrations that the database has not seen. Of two servers that start together the second finds nothing to do."""
    if connection.dialect.name == "postgresql":
        connection.execute(sa.text("SELECT pg_advisory_xact_lock(hashtext('veselova migrations'))"))
    scripts = Path(__file__).parent.parent / "migrations"
    config = Config()
    config.set_main_option("script_location", str(scripts).replace("%", "%%"))
    config.set_main_option("version_locations", str(scripts).replace("%", "%%"))
    config.set_main_option("path_separator", "newline")
    script = ScriptDirectory.from_config(config)

    def steps(current: Any, _: Any) -> list[Any]:
        pending = reversed(list(script.iterate_revisions("head", current or "base")))
        return [MigrationStep.upgrade_from_script(script.revision_map, revision) for revision in pending]

    with EnvironmentContext(config, script, fn=steps) as environment:
        environment.configure(connection=connection, target_metadata=metadata, render_as_batch=True)
        environment.run_migrations()


def in_utc(moment: datetime) -> datetime:
    """Return a moment in UTC; SQLite gives back what was stored in UTC without saying so."""
    return moment.replace(tzinfo=UTC) if moment.tzinfo is None else moment.astimezone(UTC)


def reason_of(error: Exception) -> str:
    """Return what the disk or the database says, without statements, addresses or paths."""
    return str(getattr(error, "orig", None) or getattr(error, "strerror", None) or error).rstrip(".")


def schema_differences(engine: sa.Engine) -> list[Any]:
    """Return what the tables in the database have that those of this module have not, and the other way round."""
    with engine.connect() as connection:
        return list(compare_metadata(MigrationContext.configure(connection), metadata))
