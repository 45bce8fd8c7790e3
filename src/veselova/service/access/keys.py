"""API keys: made once, shown once, stored as a hash.

A key reads ``vsl_<id>_<secret>``. The id is public and finds the row; the secret has 256 random
bits, which nobody guesses, so that one round of SHA-256 is enough.
"""

from __future__ import annotations

import hashlib
import hmac
import re
import secrets
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from functools import partial
from typing import Any

import sqlalchemy as sa

from veselova.mechanics.core.errors import InvalidInput, show
from veselova.service.access import database
from veselova.service.api.caller import SCOPES, SOLVE
from veselova.service.api.settings import Settings

__all__ = ["Key", "Keys", "open_keys"]

_FORM = re.compile(r"vsl_([0-9a-f]{12})_([A-Za-z0-9_-]{43})")
_ID = re.compile(r"[0-9a-f]{12}")
_LONGEST_NAME = 100

_named_outages = partial(database.named_outages, "database-unavailable", "The keys cannot be read")

_TABLE = database.keys


@dataclass(frozen=True)
class Key:
    """A key as it is stored.

    ``scope`` is what it allows; ``owner`` has the jobs that it makes, which other keys of this
    owner see.
    """

    id: str
    name: str
    sha256: str = field(repr=False)
    scope: str
    owner: str
    created_at: datetime
    expires_at: datetime | None
    revoked_at: datetime | None = None

    @property
    def expired(self) -> bool:
        """Return whether the key's time is over."""
        return self.expires_at is not None and self.expires_at <= datetime.now(UTC)

    @property
    def state(self) -> str:
        """Return whether the key is ``valid``, ``expired`` or ``revoked``."""
        return "revoked" if self.revoked_at else "expired" if self.expired else "valid"

    def as_dict(self) -> dict[str, str | None]:
        """Return the key as JSON, without its hash."""
        names = ("id", "name", "scope", "owner", "state", "created_at", "expires_at", "revoked_at")
        values = {name: getattr(self, name) for name in names}
        return {
            name: value.isoformat() if isinstance(value, datetime) else value
            for name, value in values.items()
        }


class Keys:
    """The keys in a database. Every method may block; raises Refused (``database-unavailable``,
    ``storage-full``) where the database fails.
    """

    def __init__(self, engine: sa.Engine) -> None:
        self._engine = engine

    def create(
        self,
        name: str,
        scope: str = SOLVE,
        expires_at: datetime | None = None,
        same_as: str | None = None,
    ) -> tuple[Key, str]:
        """Return a new key and its text, which is not stored.

        ``same_as``: the id of a key whose owner the new one shares. Raises InvalidInput.
        """
        if not 0 < len(name) <= _LONGEST_NAME or not name.isprintable():
            raise InvalidInput(("NAME",), f"1 to {_LONGEST_NAME} printable characters", show(name))
        if scope not in SCOPES:
            raise InvalidInput(("--scope",), f"one of {', '.join(SCOPES)}", show(scope))
        key_id = secrets.token_hex(6)
        owner = key_id if same_as is None else self._existing(same_as, "--same-owner-as").owner
        text = f"vsl_{key_id}_{secrets.token_urlsafe(32)}"
        key = Key(key_id, name, _digest(text), scope, owner, datetime.now(UTC), expires_at)
        self._write(sa.insert(_TABLE).values(asdict(key)))
        return key, text

    def list(self) -> Sequence[Key]:
        """Return all keys, the oldest first, revoked ones too."""
        return self._read(sa.select(_TABLE).order_by(_TABLE.c.created_at))

    def revoke(self, key_id: str) -> Key:
        """Return the key of this id, which nobody can use from now on; raises InvalidInput where
        there is none.
        """
        self._existing(key_id, "ID")
        still = (_TABLE.c.id == key_id) & _TABLE.c.revoked_at.is_(None)
        self._write(sa.update(_TABLE).where(still).values(revoked_at=datetime.now(UTC)))
        return self._existing(key_id, "ID")

    def _existing(self, key_id: str, field: str) -> Key:
        if _ID.fullmatch(key_id) and (found := self._of_id(key_id)):
            return found[0]
        raise InvalidInput((field,), "the id of a key (veselova keys list)", show(key_id))

    def holder(self, text: str) -> Key | None:
        """Return the key that a client showed, expired or not; None for another text and for a
        revoked key.
        """
        form = _FORM.fullmatch(text)
        for key in self._of_id(form[1]) if form else []:
            if hmac.compare_digest(_digest(text), key.sha256) and not key.revoked_at:
                return key
        return None

    def require(self) -> None:
        """Raise Refused unless the keys can be read."""
        self._of_id("")

    def close(self) -> None:
        """Close the connections."""
        self._engine.dispose()

    def _of_id(self, key_id: str) -> Sequence[Key]:
        return self._read(sa.select(_TABLE).where(_TABLE.c.id == key_id))

    def _read(self, query: sa.Select[Any]) -> Sequence[Key]:
        with _named_outages(), self._engine.connect() as connection:
            return [Key(**row) for row in connection.execute(query).mappings()]

    def _write(self, statement: sa.Insert | sa.Update) -> None:
        with _named_outages(), database.writing(self._engine) as connection:
            connection.execute(statement)


def open_keys(settings: Settings) -> Keys:
    """Return the keys of the service's database.

    Raises InvalidInput, and Refused: ``database-unavailable`` where it cannot be opened,
    ``storage-full``, ``database-damaged``, ``database-newer``.
    """
    with _named_outages():
        return Keys(database.connect(settings))


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
