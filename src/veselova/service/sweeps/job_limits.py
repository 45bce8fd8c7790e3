"""How much sweeps may take beside other jobs."""

from __future__ import annotations

import sqlalchemy as sa

from veselova.mechanics.core.errors import InvalidInput
from veselova.service.access.database import jobs
from veselova.service.api.problem_details import Refused
from veselova.service.api.sweep_request import SweepPlan, SweepRequest

__all__ = ["ENDED", "estimated_bytes", "require_room"]

#: States of a job that does not go on by itself; ``queued`` and ``running`` are the others.
ENDED = ("finished", "failed", "cancelled")

#: Problems of one sweep.
MOST_PROBLEMS = 1_000_000

#: Jobs that wait or run, of all and of one owner; owners whose results fill a server.
MOST_JOBS = 100
MOST_JOBS_OF_OWNER = 20
_OWNERS = 4


def estimated_bytes(sweep: SweepPlan | SweepRequest) -> int:
    """Return the bytes that a job may take: its numbers as doubles, and its request."""
    return sweep.total * sweep.row_values * 8 + len(sweep.canonical)


def require_room(
    connection: sa.Connection,
    sweep: SweepPlan | SweepRequest,
    job_id: str,
    owner: str,
    max_bytes: int,
) -> None:
    """Raise InvalidInput where a sweep is beyond what this server takes from anybody, Refused
    (``too-many-jobs``, ``storage-full``) where its job has no room beside the others.

    ``connection`` is that of ``writing``, so that no two jobs get the same room.
    """
    size = estimated_bytes(sweep)
    if sweep.total > MOST_PROBLEMS:
        raise InvalidInput(("vary",), f"at most {MOST_PROBLEMS} problems", str(sweep.total))
    if size > max_bytes:
        field = "trajectories" if sweep.trajectories else "vary"
        required = f"at most {max_bytes} bytes of results on this server"
        raise InvalidInput((field,), required, f"about {size}")
    others = jobs.c.id != job_id
    limits = [("earlier jobs", others, MOST_JOBS, max_bytes)]
    if owner:
        own = others & (jobs.c.owner == owner)
        limits.append(("jobs of this key", own, MOST_JOBS_OF_OWNER, max_bytes // _OWNERS))
    for whose, which, most_jobs, most_bytes in limits:
        active = sa.func.sum(sa.case((jobs.c.state.not_in(ENDED), 1), else_=0))
        query = sa.select(active, sa.func.sum(jobs.c.bytes)).where(which)
        count, taken = connection.execute(query).one()
        if (count or 0) >= most_jobs:
            detail = f"{count} {whose} are waiting or running; try again later."
            raise Refused("too-many-jobs", detail, retry_after=30)
        if size + (taken or 0) > most_bytes:
            detail = f"The results of {whose} take the room for them; remove some "
            detail += "(DELETE …?remove=true)."
            raise Refused("storage-full", detail)
