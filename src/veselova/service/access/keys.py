"""API keys: made once, shown once, stored as a hash.

A key reads ``vsl_<id>_<secret>``. The id is public; the secret has 256 random bits, which nobody
guesses, so that one round of SHA-256 is enough, and finds the row.
"""

from __future__ import annotations

import hashlib
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
from veselova.service.api.settings import Settings

_ID = re.compile(r"[0-9a-f]{12}")
_LONGEST_NAME = 100

_named_outages = partial(database.named_outages, "database-unavailable", "The keys cannot be read")

_TABLE = database.keys

#: What a key allows, each all of those before it: to read, to have work done and ended, to see what
#: all do.
READ, SOLVE, ADMIN = SCOPES = ("read", "solve", "admin")


@dataclass(frozen=True)
class Caller:
    """Who asks: ``owner`` has jobs, and is empty where no key is shown."""

    owner: str = ""
    scope: str = SOLVE

    def may(self, scope: str) -> bool:
        """Return whether the caller's key allows what a scope stands for."""
        return SCOPES.index(self.scope) >= SCOPES.index(scope)

    @property
    def seen(self) -> str | None:
        """Return the owner whose jobs the caller may name, None for those of all."""
        return None if self.may(ADMIN) else self.owner


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
    def state(self) -> str:
        """Return whether the key is ``valid``, ``expired`` or ``revoked``."""
        if self.revoked_at:
            return "revoked"
        return "expired" if self.expires_at and self.expires_at <= datetime.now(UTC) else "valid"

    def as_dict(self) -> dict[str, Any]:
        """Return what may be told of the key: all but its hash."""
        told = {name: value for name, value in asdict(self).items() if name != "sha256"}
        return {**told, "state": self.state}


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
        owner = key_id
        if same_as is not None:
            owner = self._one("--same-owner-as", same_as, sa.select(_TABLE)).owner
        text = f"vsl_{key_id}_{secrets.token_urlsafe(32)}"
        key = Key(key_id, name, _digest(text), scope, owner, datetime.now(UTC), expires_at)
        self._ask(sa.insert(_TABLE).values(asdict(key)).returning(_TABLE))
        return key, text

    def list(self) -> Sequence[Key]:
        """Return all keys, the oldest first, revoked ones too."""
        return self._ask(sa.select(_TABLE).order_by(_TABLE.c.created_at))

    def revoke(self, key_id: str) -> Key:
        """Return the key of this id, which nobody can use from now on; raises InvalidInput where
        there is none.
        """
        moment = sa.func.coalesce(_TABLE.c.revoked_at, datetime.now(UTC))
        change = sa.update(_TABLE).values(revoked_at=moment)
        return self._one("ID", key_id, change.returning(_TABLE))

    def holder(self, text: str) -> Key | None:
        """Return the key that a client showed, expired or not; None for another text and for a
        revoked key.
        """
        known = (_TABLE.c.sha256 == _digest(text)) & _TABLE.c.revoked_at.is_(None)
        return next(iter(self._ask(sa.select(_TABLE).where(known))), None)

    def close(self) -> None:
        """Close the connections."""
        self._engine.dispose()

    def _one(self, field: str, key_id: str, statement: Any) -> Key:
        """Return the key of an id by a statement; raises InvalidInput where there is none."""
        if _ID.fullmatch(key_id) and (found := self._ask(statement.where(_TABLE.c.id == key_id))):
            return found[0]
        raise InvalidInput((field,), "the id of a key (veselova keys list)", show(key_id))

    def _ask(self, statement: Any) -> Sequence[Key]:
        """Return the keys that a statement finds or writes."""
        begin = sa.Engine.connect if statement.is_select else database.writing
        with _named_outages(), begin(self._engine) as connection:
            return [Key(**row) for row in connection.execute(statement).mappings()]


def open_keys(settings: Settings) -> Keys:
    """Return the keys of the service's database.

    Raises InvalidInput, and Refused: ``database-unavailable`` where it cannot be opened,
    ``storage-full``, ``database-damaged``, ``database-newer``.
    """
    with _named_outages():
        return Keys(database.connect(settings))


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
