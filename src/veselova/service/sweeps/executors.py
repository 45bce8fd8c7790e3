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

from pebble import ProcessExpired

from veselova.mechanics.core.errors import needs
from veselova.mechanics.core.installation import install_extra
from veselova.service.api.settings import Settings
from veselova.service.workers.processes import Processes

#: Seconds for a connection to the scheduler.
_CONNECT_S = 30


@contextmanager
def open_executor(settings: Settings, pool: Processes | None) -> Iterator[tuple[Any, int]]:
    """Give an executor, and how many chunks of a job it is to have at a time: a Dask cluster where
    the settings name its scheduler, else the processes of a pool, or this process alone.

    Raises ConnectionError where the scheduler cannot be reached, BackendMissing without Dask.
    """
    if settings.dask_scheduler:
        with _connect(settings.dask_scheduler) as client:
            chunks = 2 * max(sum(client.nthreads().values()), settings.sweep_workers)
            yield client.get_executor(pure=False), chunks
    elif pool is not None:
        yield pool, settings.sweep_workers + 1
    else:
        yield _ThisProcess(), 1


def _connect(address: str) -> Any:
    """Return a client of a scheduler, with the certificates that Dask's own settings name."""
    with needs("distributed", "A cluster", install_extra("sweeps")):
        from distributed import Client
    # What goes wrong comes back as an exception.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    try:
        return Client(address, timeout=_CONNECT_S, set_as_default=False)
    except (OSError, TypeError) as error:  # the latter for tls:// without certificates
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


def answer(future: Future[bytes]) -> bytes | None:
    """Return the table of a future that is done, None where the worker died over it.

    Raises ConnectionError where the executor is lost, and what ``compute_chunk`` raises.
    """
    killed = getattr(sys.modules.get("distributed.scheduler"), "KilledWorker", ProcessExpired)
    try:
        return future.result()
    except (ProcessExpired, killed, MemoryError):
        return None
    except (BrokenExecutor, CancelledError, OSError) as error:
        raise ConnectionError(f"the workers are lost: {error!r}") from error
