"""The migrations of the database. What runs them takes a second to load, so this module is loaded
where there is something to run.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import sqlalchemy as sa
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.runtime.environment import EnvironmentContext
from alembic.runtime.migration import MigrationContext, MigrationStep
from alembic.script import ScriptDirectory
from alembic.script.revision import RevisionError
from alembic.util import CommandError

__all__ = ["LaterVersion", "differences", "latest", "migrate"]

_SCRIPTS = Path(__file__).parent.parent.parent / "migrations"


class LaterVersion(Exception):
    """A database that a later version of the package has made."""


def migrate(connection: sa.Connection, metadata: sa.MetaData) -> bool:
    """Run the migrations that the database has not seen, all or none of them, and return whether
    there were any. Raises LaterVersion.

    Of two servers that start together the second waits for the first, and finds nothing to do.
    """
    config = _config()
    script = ScriptDirectory.from_config(config)
    pending: list[Any] = []

    def steps(current: Any, _: Any) -> list[Any]:
        pending.extend(reversed(list(script.iterate_revisions("head", current or "base"))))
        return [
            MigrationStep.upgrade_from_script(script.revision_map, revision) for revision in pending
        ]

    try:
        with EnvironmentContext(config, script, fn=steps) as environment:
            environment.configure(
                connection=connection, target_metadata=metadata, transactional_ddl=True
            )
            environment.run_migrations()
    except (CommandError, RevisionError) as error:
        raise LaterVersion(str(error)) from None
    return bool(pending)


def latest() -> str | None:
    """Return the revision that the migrations lead to."""
    return ScriptDirectory.from_config(_config()).get_current_head()


def differences(connection: sa.Connection, metadata: sa.MetaData) -> list[Any]:
    """Return what the tables in the database have that those of the metadata have not, and the
    other way round.
    """
    return list(compare_metadata(MigrationContext.configure(connection), metadata))


def _config() -> Config:
    config = Config()
    config.set_main_option("script_location", str(_SCRIPTS).replace("%", "%%"))
    config.set_main_option("version_locations", str(_SCRIPTS).replace("%", "%%"))
    config.set_main_option("path_separator", "newline")
    return config
