"""What computes the chunks of sweeps, each an executor with ``submit``: processes of this machine,
a Dask cluster, or this process.
"""

from __future__ import annotations

import asyncio
import logging
import sys
from collections.abc import AsyncIterator, Callable
from concurrent.futures import BrokenExecutor, Future
from contextlib import asynccontextmanager
from threading import Thread
from typing import Any
from urllib.parse import urlsplit

from pebble import ProcessExpired

from veselova.mechanics.core.errors import BackendMissing, InvalidInput
from veselova.mechanics.core.installation import install_extra
from veselova.service.access.database import public_reason
from veselova.service.api.settings import Settings
from veselova.service.sweeps.chunk import Chunk, compute_chunk, lost_chunk
from veselova.service.sweeps.job_store import Job
from veselova.service.workers.processes import Processes
from veselova.version import __version__

__all__ = ["ChunkFailed", "answers", "open_executor", "require_scheduler"]

#: Seconds for a connection to the scheduler.
_CONNECT_S = 30

#: Deaths of workers over one chunk before its problems are tried one by one.
_DEATHS = 2

_LOOPBACK = ("127.0.0.1", "localhost", "::1")

#: Files of the certificates of a cluster: of its authority, of this server, and the private key.
_CERTIFICATES = ("ca.pem", "node.pem", "node.key")


class ChunkFailed(Exception):
    """A worker of a cluster could not compute, for a reason of its machine: a full disk, say."""


def require_scheduler(settings: Settings) -> None:
    """Raise InvalidInput for a scheduler that is neither on loopback nor behind TLS, or for TLS
    without its files.
    """
    if not settings.dask_scheduler:
        return
    address = urlsplit(settings.dask_scheduler)
    required = ""
    if address.scheme not in ("tcp", "tls") or not address.hostname:
        required = "an address tls://HOST:PORT"
    elif address.scheme == "tcp" and address.hostname not in _LOOPBACK:
        required = "tls://, for whoever reaches a Dask cluster can run code on it"
    if required:
        given = settings.dask_scheduler[:100]
        raise InvalidInput(("VESELOVA_DASK_SCHEDULER",), required, given)
    folder = settings.dask_certificates
    if address.scheme == "tls" and (
        folder is None or not all((folder / name).is_file() for name in _CERTIFICATES)
    ):
        required = f"a folder with {', '.join(_CERTIFICATES)}, for tls://"
        raise InvalidInput(("VESELOVA_DASK_CERTIFICATES",), required, str(folder or "nothing"))


@asynccontextmanager
async def open_executor(
    settings: Settings, processes: bool = True, niceness: int = 0
) -> AsyncIterator[tuple[Any, int]]:
    """Give an executor, and how many chunks it is to have at a time: a Dask cluster where the
    settings name its scheduler, else processes of this machine, or this process alone.

    Raises InvalidInput for an address that is refused, ConnectionError where the scheduler cannot
    be reached, BackendMissing without Dask.
    """
    require_scheduler(settings)
    if settings.dask_scheduler:
        client = await asyncio.to_thread(_connect, settings)
        try:
            threads = await asyncio.to_thread(client.nthreads)
            chunks = 2 * max(sum(threads.values()), settings.sweep_workers)
            yield client.get_executor(pure=False), chunks
        finally:
            await asyncio.to_thread(client.close)
    elif processes:
        pool = Processes(settings.sweep_workers, settings.worker_memory_mb, niceness)
        try:
            yield pool, settings.sweep_workers + 1
        finally:
            await asyncio.to_thread(pool.close().join)
    else:
        yield _ThisProcess(), 1


def _connect(settings: Settings) -> Any:
    """Return a client of the scheduler of the settings."""
    try:
        from distributed import Client
        from distributed.security import Security
    except ImportError:
        raise BackendMissing("distributed", "A cluster", install_extra("sweeps")) from None
    # What goes wrong comes back as an exception.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    security = None
    if (folder := settings.dask_certificates) is not None:
        ca, cert, key = (str(folder / name) for name in _CERTIFICATES)
        security = Security(
            tls_ca_file=ca, tls_client_cert=cert, tls_client_key=key, require_encryption=True
        )
    address = settings.dask_scheduler
    try:
        return Client(address, security=security, timeout=_CONNECT_S, set_as_default=False)
    except OSError as error:
        raise ConnectionError(f"the scheduler cannot be reached: {error}") from error


class _ThisProcess:
    """Computes in a thread, which the end of the process does not wait for."""

    def submit(self, task: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Return the future of a task."""
        future: Future[Any] = Future()

        def work() -> None:
            try:
                future.set_result(task(*arguments))
            except Exception as error:
                future.set_exception(error)

        future.set_running_or_notify_cancel()
        Thread(target=work, daemon=True).start()
        return future


async def answers(executor: Any, job: Job, start: int, stop: int) -> list[Chunk]:
    """Return the answers to the problems start … stop−1 of a job; where workers die over them, one
    by one, to find out over which.

    Raises ConnectionError where the executor is lost, ChunkFailed, and what ``compute_chunk``
    raises.
    """
    killed = getattr(sys.modules.get("distributed.scheduler"), "KilledWorker", ProcessExpired)
    for _ in range(_DEATHS):
        future = executor.submit(compute_chunk, job.request, start, stop, __version__)
        try:
            return [await asyncio.wrap_future(future)]
        except (ProcessExpired, killed, MemoryError):
            pass
        except BrokenExecutor as error:
            raise ConnectionError(f"the workers ended: {error}") from error
        except OSError as error:
            raise ChunkFailed(
                f"a worker could not compute the problems {start} to {stop - 1}: "
                f"{public_reason(error)}"
            ) from error
        except asyncio.CancelledError:
            if (task := asyncio.current_task()) is None or task.cancelling():
                raise
            raise ConnectionError("the cluster dropped the work") from None
    if stop - start == 1:
        return [lost_chunk(job.sweep, start)]
    rows = range(start, stop)
    return [part for row in rows for part in await answers(executor, job, row, row + 1)]
