"""API keys: made once, shown once, known afterwards by their hash alone.

A key reads ``vsl_<id>_<secret>``. The id is public and finds the row; the secret has 256 random bits, so that one round of
SHA-256 keeps it: what cannot be guessed needs no slow hash.
"""

from __future__ import annotations

import hashlib
import hmac
import re
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime

import sqlalchemy as sa

from veselova.mechanics.errors import InvalidInput, shown
from veselova.service.database import api_keys, connect, in_utc
from veselova.service.problem_details import Refused
from veselova.service.settings import Settings

__all__ = ["Key", "Keys", "open_keys"]

_FORM = re.compile(r"vsl_([0-9a-f]{12})_([A-Za-z0-9_-]{43})")
_LONGEST_NAME = 100

#: Compared with where there is no such key, so that an answer takes as long whether or not the id exists.
_NO_DIGEST = "0" * 64


@dataclass(frozen=True)
class Key:
    """What is known of a key: everything but the key."""

    id: str
    name: str
    created_at: datetime
    revoked_at: datetime | None

    def as_dict(self) -> dict[str, str | None]:
        """Return the key as JSON."""
        revoked = self.revoked_at.isoformat() if self.revoked_at else None
        return {"id": self.id, "name": self.name, "created_at": self.created_at.isoformat(), "revoked_at": revoked}


class Keys:
    """The keys in a database. Every method may block; raises Refused ``database-unavailable`` where the database fails."""

    def __init__(self, database: sa.Engine) -> None:
        self._database = database

    def create(self, name: str) -> tuple[Key, str]:
        """Return a new key and its text, which is kept nowhere."""
        if not 0 < len(name) <= _LONGEST_NAME or not name.isprintable():
            raise InvalidInput(("NAME",), f"1 to {_LONGEST_NAME} printable characters", shown(name))
        key = Key(secrets.token_hex(6), name, datetime.now(UTC), None)
        text = f"vsl_{key.id}_{secrets.token_urlsafe(32)}"
        row = {"id": key.id, "name": name, "sha256": _digest(text), "created_at": key.created_at}
        with self._connection() as connection:
            connection.execute(sa.insert(api_keys).values(row))
        return key, text

    def list(self) -> list[Key]:
        """Return all keys, the oldest first, revoked ones too."""
        with self._connection() as connection:
            return [_key(row) for row in connection.execute(sa.select(api_keys).order_by(api_keys.c.created_at))]

    def revoke(self, key_id: str) -> Key:
        """Return the key of this id, which nobody can use from now on; raises InvalidInput where there is none."""
        at = datetime.now(UTC)
        with self._connection() as connection:
            still = (api_keys.c.id == key_id) & api_keys.c.revoked_at.is_(None)
            connection.execute(sa.update(api_keys).where(still).values(revoked_at=at))
            row = connection.execute(sa.select(api_keys).where(api_keys.c.id == key_id)).one_or_none()
        if row is None:
            raise InvalidInput(("ID",), "the id of a key (veselova keys list)", shown(key_id))
        return _key(row)

    def holder(self, text: str) -> Key | None:
        """Return the key that a client showed, None where it is not one that may be used."""
        form = _FORM.fullmatch(text)
        if form is None:
            return None
        with self._connection() as connection:
            row = connection.execute(sa.select(api_keys).where(api_keys.c.id == form[1])).one_or_none()
        same = hmac.compare_digest(_digest(text), _NO_DIGEST if row is None else row.sha256)
        return _key(row) if row is not None and same and row.revoked_at is None else None

    def require(self) -> None:
        """Raise Refused unless the keys can be read."""
        with self._connection() as connection:
            connection.execute(sa.select(api_keys.c.id).limit(1)).all()

    def close(self) -> None:
        """Close the connections."""
        self._database.dispose()

    @contextmanager
    def _connection(self) -> Iterator[sa.Connection]:
        try:
            with self._database.begin() as connection:
                yield connection
        except sa.exc.SQLAlchemyError as error:
            raise _unavailable(error) from error


def open_keys(settings: Settings) -> Keys:
    """Return the keys of the service's database; raises Refused ``database-unavailable`` where it cannot be opened."""
    try:
        return Keys(connect(settings))
    except (OSError, sa.exc.SQLAlchemyError) as error:
        raise _unavailable(error) from error


def _unavailable(error: Exception) -> Refused:
    return Refused(
        "database-unavailable", f"The keys cannot be read: the database does not answer ({type(error).__name__}).", retry_after=5
    )


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _key(row: sa.Row[tuple[object, ...]]) -> Key:
    return Key(row.id, row.name, in_utc(row.created_at), in_utc(row.revoked_at) if row.revoked_at else None)
