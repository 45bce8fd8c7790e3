"""What clients say with ``Idempotency-Key``: which job a key stands for, and how many are known."""

from __future__ import annotations

from datetime import UTC, datetime
from importlib import import_module
from typing import Any

import sqlalchemy as sa

from veselova.mechanics.core.errors import InvalidInput
from veselova.service.access.database import idempotency_keys

__all__ = ["claim"]

#: Keys of one owner that are known at a time, and what is left of them when those that came first
#: have to go.
_MOST = 10_000
_KEPT = 9_000


def claim(connection: sa.Connection, owner: str, key: str, job_id: str) -> None:
    """Write which job an owner's key stands for. Raises InvalidInput where it stands for another.

    The row comes before the job: of two requests at once the primary key lets one in, and the other
    finds what it wrote. Beyond ``_MOST`` the oldest of the owner are free again: a client tries
    again within hours, and everyone can invent as many as they like.
    """
    known = idempotency_keys.c
    row = {"owner": owner, "key": key, "job_id": job_id, "created_at": datetime.now(UTC)}
    # only that of the database in use: PostgreSQL's takes a tenth of a second to load
    dialect: Any = import_module(f"sqlalchemy.dialects.{connection.dialect.name}")
    connection.execute(dialect.insert(idempotency_keys).values(row).on_conflict_do_nothing())
    of_owner = known.owner == owner
    stands_for = sa.select(known.job_id).where(of_owner, known.key == key)
    if connection.execute(stands_for).scalar() != job_id:
        raise InvalidInput(
            ("Idempotency-Key",),
            "a key of its own for every request",
            "one that came with another request",
        )
    count = connection.execute(sa.select(sa.func.count()).where(of_owner)).scalar_one()
    if count > _MOST:
        oldest = (
            sa.select(known.key)
            .where(of_owner, known.key != key)
            .order_by(known.created_at)
            .limit(count - _KEPT)
        )
        connection.execute(sa.delete(idempotency_keys).where(of_owner, known.key.in_(oldest)))
