"""What computes the chunks of sweeps, each an executor with ``submit``: processes of this machine,
a Dask cluster, or this process.
"""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Future
from contextlib import contextmanager
from typing import Any
from urllib.parse import urlsplit

from pebble import ProcessExpired

from veselova.mechanics.core.errors import BackendMissing, InvalidInput
from veselova.mechanics.core.installation import install_extra
from veselova.service.access.database import public_reason
from veselova.service.api.settings import Settings
from veselova.service.sweeps.chunk import Chunk, compute_chunk
from veselova.service.workers.processes import Processes
from veselova.version import __version__

__all__ = ["ChunkFailed", "answer", "open_executor", "require_scheduler", "submit"]

#: Seconds for a connection to the scheduler.
_CONNECT_S = 30

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


@contextmanager
def open_executor(
    settings: Settings, processes: bool = True, niceness: int = 0
) -> Iterator[tuple[Any, int]]:
    """Give an executor, and how many chunks of a job it is to have at a time: a Dask cluster where
    the settings name its scheduler, else processes of this machine, or this process alone.

    Raises InvalidInput for an address that is refused, ConnectionError where the scheduler cannot
    be reached, BackendMissing without Dask.
    """
    require_scheduler(settings)
    if settings.dask_scheduler:
        with _connect(settings) as client:
            chunks = 2 * max(sum(client.nthreads().values()), settings.sweep_workers)
            yield client.get_executor(pure=False), chunks
    elif processes:
        pool = Processes(settings.sweep_workers, settings.worker_memory_mb, niceness)
        try:
            yield pool, settings.sweep_workers + 1
        finally:
            pool.close().join()
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
    """Computes in the thread that asks, so that an interrupt ends the computation too."""

    def submit(self, task: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Return the future of a task, which is done."""
        future: Future[Any] = Future()
        try:
            future.set_result(task(*arguments))
        except Exception as error:
            future.set_exception(error)
        return future


def submit(executor: Any, request: str, start: int, stop: int) -> Future[Chunk]:
    """Return the future of the answers to the problems start … stop−1 of a sweep."""
    future: Future[Chunk] = executor.submit(compute_chunk, request, start, stop, __version__)
    return future


def answer(future: Future[Chunk], start: int, stop: int) -> Chunk | None:
    """Return the answers of a future that is done, None where the worker died over them.

    Raises ConnectionError where the executor is lost, ChunkFailed, and what ``compute_chunk``
    raises.
    """
    killed = getattr(sys.modules.get("distributed.scheduler"), "KilledWorker", ProcessExpired)
    try:
        return future.result()
    except (ProcessExpired, killed, MemoryError):
        return None
    except BrokenExecutor as error:
        raise ConnectionError(f"the workers ended: {error}") from error
    except CancelledError:
        raise ConnectionError("the cluster dropped the work") from None
    except OSError as error:
        raise ChunkFailed(
            f"a worker could not compute the problems {start} to {stop - 1}: {public_reason(error)}"
        ) from error
