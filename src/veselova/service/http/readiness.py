"""Whether a server can answer: what of it is missing."""

from __future__ import annotations

import anyio.to_thread

from veselova.mechanics.core.errors import BackendMissing
from veselova.service.access.keys import Keys
from veselova.service.api.problem_details import Refused
from veselova.service.http.job_service import JobService
from veselova.service.workers.pool import Workers

__all__ = ["missing_parts"]


async def missing_parts(workers: Workers, jobs: JobService, keys: Keys | None) -> list[str]:
    """Return what keeps a server from answering, in words: a warm worker, the store of its jobs,
    its keys where it asks for them.

    Anyone may read it, so it names no address, file or role: the log has those.
    A server without the libraries of jobs is complete without their store.
    """
    missing = [] if workers.ready() else ["No worker is warm yet."]
    try:
        await jobs.require()
    except Refused:
        missing.append("Jobs cannot be stored or read at present.")
    except BackendMissing:
        pass
    if keys is not None:
        try:
            await anyio.to_thread.run_sync(keys.require)
        except Refused as error:
            missing.append(error.detail)
    return missing
