"""A PostgreSQL server of the tests: of this machine's own programs, in a temporary folder, reached
by a socket in it.
"""

from __future__ import annotations

import os
import pwd
import shutil
import subprocess
import tempfile
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psycopg
import pytest
from pydantic import SecretStr

from veselova.service.api.settings import Settings

#: Where Debian has the programs of each version.
_DEBIAN = Path("/usr/lib/postgresql")

#: Accounts that may run the server where the tests run as root, which it refuses.
_ACCOUNTS = ("postgres", "nobody")


def programs() -> Path | None:
    """Return the folder of initdb and pg_ctl, of the newest version where there are several, or
    None.
    """
    of_versions = sorted(
        _DEBIAN.glob("*/bin"),
        key=lambda path: int(path.parent.name.partition(".")[0]),
        reverse=True,
    )
    named = shutil.which("initdb")
    folders = [*of_versions, *([Path(named).resolve().parent] if named else [])]
    return next(
        (path for path in folders if (path / "initdb").exists() and (path / "pg_ctl").exists()),
        None,
    )


@contextmanager
def postgresql_server() -> Iterator[str]:
    """Give the address of a server without its database, ``postgresql://…?host=…``; skips the test
    where none can be started.
    """
    found = programs()
    if found is None:
        pytest.skip("needs PostgreSQL: apt-get install postgresql")
    account = _account()
    if os.getuid() == 0 and (account is None or shutil.which("setpriv") is None):
        pytest.skip(
            "PostgreSQL does not run as root, and there is no other account, or no setpriv, "
            "to run it"
        )
    with tempfile.TemporaryDirectory(prefix="veselova-pg-") as name:
        folder, become = Path(name), list[str]()
        if account is not None:
            os.chown(folder, account.pw_uid, account.pw_gid)
            become = [
                "setpriv",
                f"--reuid={account.pw_uid}",
                f"--regid={account.pw_gid}",
                "--clear-groups",
            ]

        def run(program: str, *arguments: str) -> None:
            command = [*become, str(found / program), "-D", str(folder / "data"), *arguments]
            answer = subprocess.run(
                command, capture_output=True, text=True, timeout=120, cwd=folder, check=False
            )
            assert answer.returncode == 0, answer.stdout + answer.stderr

        run("initdb", "-U", "veselova", "--auth=trust", "-E", "UTF8", "--locale=C", "--no-sync")
        options = f"-k {folder} -c listen_addresses= -c fsync=off"
        run("pg_ctl", "-w", "-l", str(folder / "log"), "-o", options, "start")
        try:
            yield f"postgresql://veselova@/{{name}}?host={folder}"
        finally:
            run("pg_ctl", "-w", "-m", "immediate", "stop")


def new_database(address: str, name: str) -> str:
    """Return the address of a database that has just been made."""
    with psycopg.connect(address.format(name="postgres"), autocommit=True) as connection:
        connection.execute(f'CREATE DATABASE "{name}"')  # type: ignore[arg-type]
    return address.format(name=name)


def _account() -> pwd.struct_passwd | None:
    """Return the account that runs the server instead of root."""
    if os.getuid() != 0:
        return None
    known = {entry.pw_name: entry for entry in pwd.getpwall()}
    return next((known[name] for name in _ACCOUNTS if name in known), None)


def settings_in(folder: Path, request: pytest.FixtureRequest) -> Settings:
    """Return settings with a folder and a database, SQLite or PostgreSQL as the fixture's parameter
    says.
    """
    if request.param == "sqlite":
        return Settings(data_dir=folder)
    address = new_database(request.getfixturevalue("postgresql"), uuid.uuid4().hex)
    return Settings(data_dir=folder, database_url=SecretStr(address))
