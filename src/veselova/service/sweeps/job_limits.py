"""Whether a new job has room: the limits of a server and of an owner, held against what was
promised to other jobs.
"""

from __future__ import annotations

from typing import Any

import sqlalchemy as sa

from veselova.mechanics.core.errors import InvalidInput
from veselova.service.access.database import jobs
from veselova.service.api.problem_details import Refused
from veselova.service.api.settings import Settings
from veselova.service.api.sweep_request import SweepPlan, SweepRequest

__all__ = ["ENDED", "JOB_BYTES", "promised_bytes", "require_room"]

#: States of a job that does not go on by itself; ``queued`` and ``running`` are the others.
ENDED = ("finished", "failed", "cancelled")


#: Problems of one sweep; jobs that wait or run, and those of one owner; owners that fill a server.
MOST_PROBLEMS = 1_000_000
MOST_JOBS = 100
MOST_JOBS_OF_OWNER = 20
_OWNERS = 4

#: Bytes of a job besides its results and its request: its folders, its rows in the database, and
#: what files take beyond their content.
JOB_BYTES = 16_000


def promised_bytes(sweep: SweepPlan | SweepRequest) -> int:
    """Return the bytes that a job may take: its numbers as doubles, its request, and itself."""
    return sweep.total * sweep.row_values * 8 + len(sweep.canonical) + JOB_BYTES


def require_room(
    connection: sa.Connection,
    sweep: SweepPlan | SweepRequest,
    job_id: str,
    owner: str,
    settings: Settings,
) -> None:
    """Raise InvalidInput where a sweep is beyond what this server takes from anybody, Refused
    (``too-many-jobs``, ``storage-full``) where its job has no room beside the others.

    ``connection`` is in a transaction that no other of its kind runs beside, so that no two jobs
    are promised the same room.
    """
    size = promised_bytes(sweep)
    if sweep.total > MOST_PROBLEMS:
        raise InvalidInput(("vary",), f"at most {MOST_PROBLEMS} problems", str(sweep.total))
    if size > settings.max_stored_bytes:
        room = f"at most {settings.max_stored_bytes} bytes of results on this server"
        raise InvalidInput(
            ("trajectories" if sweep.trajectories else "vary",), room, f"about {size}"
        )
    others = jobs.c.id != job_id
    of_all = _count_taken(connection, others)
    of_owner = _count_taken(connection, others & (jobs.c.owner == owner))
    if of_all.waiting >= MOST_JOBS:
        raise Refused(
            "too-many-jobs",
            f"{of_all.waiting} jobs are waiting or running; try again later.",
            retry_after=30,
        )
    if owner and of_owner.waiting >= MOST_JOBS_OF_OWNER:
        detail = (
            f"{of_owner.waiting} jobs of this key are waiting or running; try again when one "
            "has ended."
        )
        raise Refused("too-many-jobs", detail, retry_after=30)
    share = settings.max_stored_bytes // _OWNERS
    if owner and size + of_owner.bytes > share:
        detail = (
            f"The jobs of this key take {of_owner.bytes} bytes, and this one may take {size}: "
            "at most "
        )
        detail += f"{share} in all; remove some (DELETE …?remove=true)."
        raise Refused("storage-full", detail)
    if size + of_all.bytes > settings.max_stored_bytes:
        detail = (
            "The results of earlier jobs take the room that this server has for them; remove "
            "some (DELETE …?remove=true)."
        )
        raise Refused("storage-full", detail)


def _count_taken(connection: sa.Connection, which: sa.ColumnElement[bool]) -> Any:
    """Return the number of jobs that wait or run, as ``waiting``, and the bytes that all have or
    were promised, as ``bytes``.
    """
    going_on = sa.func.sum(sa.case((jobs.c.state.not_in(ENDED), 1), else_=0))
    numbers = (
        sa.func.coalesce(going_on, 0).label("waiting"),
        sa.func.coalesce(sa.func.sum(jobs.c.bytes), 0).label("bytes"),
    )
    return connection.execute(sa.select(*numbers).where(which)).one()
