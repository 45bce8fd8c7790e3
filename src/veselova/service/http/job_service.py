"""The jobs of one server: the store and the runner, opened with the server and again when the
storage has come back.
"""

from __future__ import annotations

import asyncio
import logging
import math
import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager
from copy import copy
from importlib.util import find_spec
from typing import TYPE_CHECKING, TypeVar

import anyio
from sqlalchemy.exc import DataError, SQLAlchemyError

from veselova.mechanics.core.errors import BackendMissing, InvalidInput
from veselova.mechanics.core.installation import install_extra
from veselova.service.access.database import is_outage, public_reason, reason_of
from veselova.service.api.problem_details import Refused, problem_code
from veselova.service.api.settings import Settings

if TYPE_CHECKING:
    from veselova.service.sweeps.job_store import Jobs
    from veselova.service.sweeps.runner import Sweeps

__all__ = ["JobService"]

_LOG = logging.getLogger("veselova.sweeps")

#: Interactive requests go before sweeps where both want the processors: three times as much of
#: them.
_NICENESS = 5

#: Calls of the store at a time. Where it does not answer, threads of others than these are free.
_THREADS = 10

T = TypeVar("T")


class JobService:
    """Opens the store of jobs for a server's life. A server without it answers everything else."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self.root_path = settings.root_path
        self._opening = anyio.Lock()
        self._threads = anyio.CapacityLimiter(_THREADS)
        self._sweeps: Sweeps | None = None
        self._watching: asyncio.Task[None] | None = None
        self._tried_at = -math.inf
        self._refused = Refused("storage-unavailable", "")
        #: Why there is no store, where there is none.
        self.failure = "not opened yet"

    @asynccontextmanager
    async def running(self) -> AsyncIterator[None]:
        """Run the jobs until the context ends; those that another server left unfinished are taken
        up.
        """
        try:
            await self.sweeps()
        except (Refused, BackendMissing) as error:
            _LOG.warning("no sweeps for the present: %s", error)
        try:
            yield
        finally:
            if self._sweeps is not None and self._watching is not None:
                self._watching.cancel()
                await self._sweeps.close()
                self._sweeps.jobs.close()

    async def sweeps(self) -> Sweeps:
        """Return the runner. Raises Refused (``storage-unavailable``), or BackendMissing without
        the extra ``sweeps``. Those who ask while the store does not open share the next try.
        """
        asked_at = time.monotonic()
        async with self._opening:
            if self._sweeps is None:
                if self._tried_at > asked_at:
                    raise copy(self._refused)
                began = time.monotonic()
                try:
                    self._sweeps = await self._open()
                except Refused as error:
                    self._refused, self._tried_at = error, began
                    raise
        return self._sweeps

    async def _open(self) -> Sweeps:
        try:
            from veselova.service.sweeps.job_store import Jobs
            from veselova.service.sweeps.runner import Sweeps

            # It is loaded when the first sweep arrives, which is to be refused and not to fail.
            if find_spec("pyarrow") is None:
                raise ModuleNotFoundError("pyarrow is missing", name="pyarrow")
        except ImportError as error:
            self.failure = f"{error.name} is not installed"
            raise BackendMissing(
                error.name or "pyarrow", "A sweep", install_extra("sweeps")
            ) from None
        try:
            jobs = await anyio.to_thread.run_sync(Jobs, self._settings)
            sweeps = Sweeps(self._settings, jobs, niceness=_NICENESS)
            await sweeps.resume()
            self._watching = asyncio.create_task(sweeps.watch())
        except (
            Refused,
            InvalidInput,
        ) as error:  # which names a file, and what is to be done by whoever runs the server
            if self.failure != str(error):
                _LOG.error("no sweeps: %s", error)
            self.failure = str(error)
            detail = f"Jobs cannot be stored at present: {problem_code(error)}."
            raise Refused("storage-unavailable", detail, retry_after=30) from None
        except (OSError, SQLAlchemyError) as error:
            if not is_outage(error):
                raise
            if self.failure != reason_of(error):
                _LOG.error("no sweeps: %s", reason_of(error))
            self.failure = reason_of(error)
            raise Refused(
                "storage-unavailable",
                f"Jobs cannot be stored at present: {public_reason(error)}.",
                retry_after=30,
            ) from None
        self.failure = ""
        return sweeps

    async def ask(self, call: Callable[[Jobs], T]) -> T:
        """Return what the store answers. Raises Refused (``storage-unavailable``) where the disk or
        the database refuse.

        Values that the database cannot hold are InvalidInput. What it says of our statements is no
        outage, and is raised.
        """
        sweeps = await self.sweeps()
        with _named_outages():
            return await anyio.to_thread.run_sync(call, sweeps.jobs, limiter=self._threads)

    async def cancel(self, job_id: str) -> None:
        """Stop a job, unless it has ended; raises Refused as ``ask`` does."""
        sweeps = await self.sweeps()
        with _named_outages():
            await sweeps.cancel(job_id)

    def counts(self) -> dict[str, int]:
        """Return how many jobs are in each state, nothing while the store does not
        answer. Blocks.
        """
        if self._sweeps is None:
            return {}
        try:
            return self._sweeps.jobs.counts()
        except (OSError, SQLAlchemyError) as error:
            _LOG.warning("the storage of jobs failed: %s", reason_of(error))
            return {}

    async def require(self) -> None:
        """Raise Refused (``storage-unavailable``) unless the database can be written."""
        await self.ask(lambda jobs: jobs.require_writable())


@contextmanager
def _named_outages() -> Iterator[None]:
    try:
        yield
    except DataError:
        raise InvalidInput((), "values that the database can hold", "others") from None
    except (OSError, SQLAlchemyError) as error:
        if not is_outage(error):
            raise
        _LOG.warning("the storage of jobs failed: %s", reason_of(error))
        detail = f"Jobs cannot be stored or read at present: {public_reason(error)}."
        raise Refused("storage-unavailable", detail, retry_after=30) from None
