"""API keys: made once, shown once, known afterwards by their hash alone.

A key reads ``vsl_<id>_<secret>``. The id is public and finds the row; the secret has 256 random
bits, so that one round of SHA-256 keeps it: what cannot be guessed needs no slow hash.
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

from veselova.mechanics.core.errors import InvalidInput, show
from veselova.service.access.database import api_keys, connect, in_utc, is_outage, writing
from veselova.service.api.caller import SCOPES, SOLVE
from veselova.service.api.problem_details import Refused
from veselova.service.api.settings import Settings

__all__ = ["Key", "Keys", "open_keys"]

_FORM = re.compile(r"vsl_([0-9a-f]{12})_([A-Za-z0-9_-]{43})")
_ID = re.compile(r"[0-9a-f]{12}")
_LONGEST_NAME = 100

#: Compared with where there is no such key, so that an answer takes as long whether or not the id
#: exists.
_NO_DIGEST = "0" * 64


@dataclass(frozen=True)
class Key:
    """What is known of a key: everything but the key.

    ``scope`` is what it allows; ``owner`` has the jobs and answers that it makes, which other keys
    of this owner see.
    """

    id: str
    name: str
    created_at: datetime
    revoked_at: datetime | None
    scope: str
    owner: str
    expires_at: datetime | None

    @property
    def expired(self) -> bool:
        """Return whether the key's time is over."""
        return self.expires_at is not None and self.expires_at <= datetime.now(UTC)

    @property
    def state(self) -> str:
        """Return whether the key is ``valid``, ``expired`` or ``revoked``."""
        return "revoked" if self.revoked_at else "expired" if self.expired else "valid"

    def as_dict(self) -> dict[str, str | None]:
        """Return the key as JSON."""
        names = ("id", "name", "scope", "owner", "state", "created_at", "expires_at", "revoked_at")
        values = ((name, getattr(self, name)) for name in names)
        return {
            name: value.isoformat() if isinstance(value, datetime) else value
            for name, value in values
        }


class Keys:
    """The keys in a database. Every method may block; raises Refused ``database-unavailable`` where
    the database fails.
    """

    def __init__(self, database: sa.Engine) -> None:
        self._database = database

    def create(
        self,
        name: str,
        scope: str = SOLVE,
        expires_at: datetime | None = None,
        same_as: str | None = None,
    ) -> tuple[Key, str]:
        """Return a new key and its text, which is kept nowhere.

        ``same_as``: the id of a key whose owner the new one shares. Raises InvalidInput.
        """
        if not 0 < len(name) <= _LONGEST_NAME or not name.isprintable():
            raise InvalidInput(("NAME",), f"1 to {_LONGEST_NAME} printable characters", show(name))
        if scope not in SCOPES:
            raise InvalidInput(("--scope",), f"one of {', '.join(SCOPES)}", show(scope))
        key_id = secrets.token_hex(6)
        owner = key_id if same_as is None else self._existing(same_as, "--same-owner-as").owner
        key = Key(key_id, name, datetime.now(UTC), None, scope, owner, expires_at)
        text = f"vsl_{key.id}_{secrets.token_urlsafe(32)}"
        row = {"id": key.id, "name": name, "sha256": _digest(text), "created_at": key.created_at}
        with self._writing() as connection:
            connection.execute(
                sa.insert(api_keys).values(**row, scope=scope, owner=owner, expires_at=expires_at)
            )
        return key, text

    def list(self) -> list[Key]:
        """Return all keys, the oldest first, revoked ones too."""
        with self._reading() as connection:
            return [
                _key(row)
                for row in connection.execute(sa.select(api_keys).order_by(api_keys.c.created_at))
            ]

    def revoke(self, key_id: str) -> Key:
        """Return the key of this id, which nobody can use from now on; raises InvalidInput where
        there is none.
        """
        self._existing(key_id, "ID")
        at = datetime.now(UTC)
        with self._writing() as connection:
            still = (api_keys.c.id == key_id) & api_keys.c.revoked_at.is_(None)
            connection.execute(sa.update(api_keys).where(still).values(revoked_at=at))
        return self._existing(key_id, "ID")

    def _existing(self, key_id: str, field: str) -> Key:
        row = None
        if _ID.fullmatch(key_id):
            with self._reading() as connection:
                row = connection.execute(
                    sa.select(api_keys).where(api_keys.c.id == key_id)
                ).one_or_none()
        if row is None:
            raise InvalidInput((field,), "the id of a key (veselova keys list)", show(key_id))
        return _key(row)

    def holder(self, text: str) -> Key | None:
        """Return the key that a client showed, expired or not; None where it is not one of these,
        or revoked.
        """
        form = _FORM.fullmatch(text)
        if form is None:
            return None
        with self._reading() as connection:
            row = connection.execute(
                sa.select(api_keys).where(api_keys.c.id == form[1])
            ).one_or_none()
        same = hmac.compare_digest(_digest(text), _NO_DIGEST if row is None else row.sha256)
        return _key(row) if row is not None and same and row.revoked_at is None else None

    def require(self) -> None:
        """Raise Refused unless the keys can be read."""
        with self._reading() as connection:
            connection.execute(sa.select(api_keys.c.id).limit(1)).all()

    def close(self) -> None:
        """Close the connections."""
        self._database.dispose()

    @contextmanager
    def _reading(self) -> Iterator[sa.Connection]:
        with _named_outages(), self._database.connect() as connection:
            yield connection

    @contextmanager
    def _writing(self) -> Iterator[sa.Connection]:
        with _named_outages(), writing(self._database) as connection:
            yield connection


@contextmanager
def _named_outages() -> Iterator[None]:
    try:
        yield
    except (OSError, sa.exc.SQLAlchemyError) as error:
        if not is_outage(error):
            raise
        raise _unavailable(error) from error


def open_keys(settings: Settings) -> Keys:
    """Return the keys of the service's database.

    Raises Refused: ``database-unavailable`` where it cannot be opened, ``database-damaged``,
    ``database-newer``.
    """
    with _named_outages():
        return Keys(connect(settings))


def _unavailable(error: Exception) -> Refused:
    return Refused(
        "database-unavailable",
        f"The keys cannot be read: the database does not answer ({type(error).__name__}).",
        retry_after=5,
    )


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _key(row: sa.Row[tuple[object, ...]]) -> Key:
    created, revoked, expires = (
        moment and in_utc(moment) for moment in (row.created_at, row.revoked_at, row.expires_at)
    )
    return Key(row.id, row.name, created, revoked, row.scope, row.owner, expires)
