"""Whether a server can answer: what of it is missing."""

from __future__ import annotations

import anyio.to_thread

from veselova.mechanics.core.errors import BackendMissing
from veselova.service.access.keys import Keys
from veselova.service.api.problem_details import Refused
from veselova.service.http.job_service import JobService
from veselova.service.http.shared_look import SharedLook
from veselova.service.workers.pool import Workers

__all__ = ["Readiness"]

#: Seconds between the beginnings of two looks at the storage, which write to the disk.
_PAUSE_S = 0.1


class Readiness:
    """What keeps a server from answering, in words: a warm worker, the store of its jobs, its keys
    where it asks for them.

    Anyone may read it, so it names no address, file or role: the log has those. Anyone may ask, as
    often as they like: those who ask at once share one look at the storage.
    """

    def __init__(self, workers: Workers, jobs: JobService, keys: Keys | None) -> None:
        self._workers = workers
        self._jobs = jobs
        self._keys = keys
        self._storage = SharedLook(self._look, _PAUSE_S)

    async def missing(self) -> list[str]:
        """Return what is missing, as it is found after this was asked.

        A server without the libraries of jobs is complete without their store.
        """
        worker = [] if self._workers.ready() else ["No worker is warm yet."]
        return [*worker, *await self._storage()]

    async def _look(self) -> list[str]:
        missing = []
        try:
            await self._jobs.require()
        except Refused:
            missing.append("Jobs cannot be stored or read at present.")
        except BackendMissing:
            pass
        if self._keys is not None:
            try:
                await anyio.to_thread.run_sync(self._keys.require)
            except Refused as error:
                missing.append(error.detail)
        return missing
