"""The jobs of one server: the store and the runner, opened with the server, and later where the
storage fails at first.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from functools import partial
from importlib.util import find_spec
from typing import TYPE_CHECKING, TypeVar

import anyio.to_thread
from sqlalchemy.exc import SQLAlchemyError

from veselova.mechanics.core.errors import BackendMissing, InvalidInput, install_extra
from veselova.service.access.database import named_outages, reason_of
from veselova.service.access.keys import Keys
from veselova.service.api.problem_details import Refused, problem_code
from veselova.service.api.settings import Settings
from veselova.service.workers.pool import Workers

if TYPE_CHECKING:
    from veselova.service.sweeps.job_store import Jobs
    from veselova.service.sweeps.runner import Sweeps

_LOG = logging.getLogger("veselova.sweeps")

#: Seconds between two tries to open the store.
_PAUSE_S = 10.0

_named_outages = partial(named_outages, "storage-unavailable", "Jobs cannot be stored or read")

T = TypeVar("T")


class JobService:
    """Opens the store of jobs for a server's life. A server without it answers everything else."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self.root_path = settings.root_path
        self._sweeps: Sweeps | None = None
        self._failure: Refused | BackendMissing = Refused("storage-unavailable", "")

    @asynccontextmanager
    async def running(self) -> AsyncIterator[None]:
        """Run the jobs until the context ends; those that another server left unfinished are taken
        up.
        """
        await self._open()
        opening = asyncio.create_task(self._go_on_opening())
        try:
            yield
        finally:
            opening.cancel()
            if self._sweeps is not None:
                await anyio.to_thread.run_sync(self._sweeps.close)
                self._sweeps.jobs.close()

    async def _go_on_opening(self) -> None:
        while self._sweeps is None:
            await asyncio.sleep(_PAUSE_S)
            await self._open()

    async def _open(self) -> None:
        """Open the store, or keep why it cannot be opened."""
        try:
            from veselova.service.sweeps.job_store import Jobs
            from veselova.service.sweeps.runner import Sweeps

            # It is loaded when the first sweep arrives, which is to be refused and not to fail.
            if find_spec("pyarrow") is None:
                raise ModuleNotFoundError("pyarrow is missing", name="pyarrow")
            with _named_outages():
                jobs = await anyio.to_thread.run_sync(Jobs, self._settings)
            self._sweeps = Sweeps(self._settings, jobs)
        except ImportError as error:
            name = error.name or "pyarrow"
            self._failure = BackendMissing(name, "A sweep", install_extra("sweeps"))
        except InvalidInput as error:  # which names a folder
            self._failure = _unavailable(error)
        except Refused as error:
            is_outage = error.code in ("storage-unavailable", "storage-full")
            self._failure = error if is_outage else _unavailable(error)

    @property
    def sweeps(self) -> Sweeps:
        """Return the runner. Raises Refused (``storage-unavailable``, ``storage-full``), or
        BackendMissing without the extra ``sweeps``.
        """
        if self._sweeps is None:
            raise self._failure.with_traceback(None)
        return self._sweeps

    async def ask(self, call: Callable[[Jobs], T]) -> T:
        """Return what a call of the store gives; raises as ``sweeps`` does where the disk or the
        database fails.
        """
        with _named_outages():
            return await anyio.to_thread.run_sync(call, self.sweeps.jobs)

    def counts(self) -> dict[str, int]:
        """Return how many jobs are in each state, nothing while the store does not
        answer. Blocks.
        """
        if self._sweeps is None:
            return {}
        try:
            return self._sweeps.jobs.counts()
        except SQLAlchemyError as error:
            _LOG.warning("the jobs cannot be counted: %s", reason_of(error))
            return {}


def _unavailable(error: InvalidInput | Refused) -> Refused:
    """Return the refusal for clients of what names a file, and what whoever runs the server has to
    do.
    """
    _LOG.error("no sweeps: %s", error)
    detail = f"Jobs cannot be stored at present: {problem_code(error)}."
    return Refused("storage-unavailable", detail, retry_after=30)


async def missing_parts(workers: Workers, jobs: JobService, keys: Keys | None) -> list[str]:
    """Return what keeps a server from answering: a warm worker, the store of its jobs, its keys
    where it asks for them. Anyone may read it, so it names no address, file or role.

    A server without the libraries of jobs is complete without their store.
    """
    missing = [] if workers.ready() else ["No worker is warm yet."]
    try:
        await jobs.ask(lambda store: store.require_writable())
    except Refused:
        missing.append("Jobs cannot be stored or read at present.")
    except BackendMissing:
        pass
    if keys is not None:
        try:
            await anyio.to_thread.run_sync(keys.list)
        except Refused as error:
            missing.append(error.detail)
    return missing
