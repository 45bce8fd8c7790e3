"""Processes that compute: each has bounded memory, and is killed with its task."""

from __future__ import annotations

import ctypes
import logging
import math
import os
import pickle
import resource
import signal
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from multiprocessing import resource_tracker
from threading import Thread
from typing import Any, TypeVar

from loky.backend import resource_tracker as tracker_of_loky
from loky.backend.context import LokyContext
from loky.backend.process import LokyProcess
from pebble import ProcessPool

from veselova.mechanics.core.budget import limits
from veselova.service.api.settings import MEGABYTE
from veselova.service.workers.tasks import warm_up

T = TypeVar("T")

_LOG = logging.getLogger("veselova.service")

#: Seconds that a task has to notice its own timeout, which keeps its process, before the process
#: is killed.
_GRACE_S = 0.2


@contextmanager
def _signals_blocked() -> Iterator[None]:
    """Block the signals of a terminal in what is started inside the block."""
    signals = {signal.SIGINT, signal.SIGHUP}
    before = signal.pthread_sigmask(signal.SIG_BLOCK, signals)
    try:
        for tracker in (resource_tracker, tracker_of_loky):
            tracker.ensure_running()
        signal.pthread_sigmask(signal.SIG_BLOCK, signals)  # the trackers unblock SIGINT
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class _Process(LokyProcess):  # type: ignore[misc]
    """A process that leaves the signals of a terminal to the one that started it."""

    def __init__(self, **options: Any) -> None:
        # More threads do not help with small matrices, and their stacks count as memory.
        super().__init__(env={"OPENBLAS_NUM_THREADS": "1"}, **options)

    def start(self) -> None:
        """Start the process."""
        with _signals_blocked():
            super().start()


class _Context(LokyContext):  # type: ignore[misc]
    Process = _Process


class Processes:
    """A pool of warm processes, started at the first call. They import no ``__main__``."""

    def __init__(self, number: int, memory_mb: int, niceness: int = 0) -> None:
        self._number = number
        self._options = (memory_mb * MEGABYTE, niceness)
        self._pool: ProcessPool | None = None

    @property
    def active(self) -> bool:
        """Return whether the pool works: it breaks when a process dies while none computes."""
        return self._pool is not None and self._pool.active

    def submit(
        self, task: Callable[..., T], *arguments: Any, budget_s: float = math.inf
    ) -> Future[T]:
        """Return the future of a task; its budget begins with the work. To cancel it kills its
        process.

        Raises in ``result()`` what the task raises, OverBudget or TimeoutError after the budget,
        MemoryError beyond the memory of a process, pebble.ProcessExpired or BrokenProcessPool
        where the process died.
        """
        if self._pool is None or not self._pool.active:
            self.close()
            with _signals_blocked():
                self._pool = ProcessPool(
                    self._number, context=_Context(), initializer=_begin, initargs=self._options
                )
        timeout = budget_s + _GRACE_S if math.isfinite(budget_s) else None
        return self._pool.schedule(_run, (task, arguments, budget_s), timeout=timeout)

    def close(self) -> Thread:
        """Kill all processes, in a thread that ends when they are gone."""
        pool = self._pool

        def stop() -> None:
            if pool is not None:
                pool.stop()
                pool.join()

        stopping = Thread(target=stop)
        stopping.start()
        return stopping


def _begin(most_bytes: int, niceness: int) -> None:
    """Prepare a new process."""
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # it ends compiled code too
    if sys.platform == "linux":  # PR_SET_PDEATHSIG: none computes for a server that was killed
        ctypes.CDLL(None).prctl(1, signal.SIGKILL)
    os.nice(niceness)
    # Arrow's own allocator reserves a gigabyte, used or not, which would count.
    os.environ.setdefault("ARROW_DEFAULT_MEMORY_POOL", "system")
    # On Linux RLIMIT_DATA counts what a process writes to, and not the libraries that it maps, as
    # RLIMIT_AS would.
    kind = resource.RLIMIT_DATA if sys.platform == "linux" else resource.RLIMIT_AS
    hard = resource.getrlimit(kind)[1]
    soft = most_bytes if hard == resource.RLIM_INFINITY else min(most_bytes, hard)
    resource.setrlimit(kind, (soft, hard))
    try:
        warm_up()
    except Exception:  # its first task will say what is wrong
        _LOG.exception("a worker process could not warm up")


def _run(task: Callable[..., T], arguments: tuple[Any, ...], budget_s: float) -> T:
    """Return what a task gives within its budget, in a process of the pool."""
    try:
        with limits(budget_s if math.isfinite(budget_s) else None, False):
            return task(*arguments)
    except Exception as error:
        try:
            pickle.loads(pickle.dumps(error))
        except Exception:  # it holds what cannot be sent, or made again
            raise RuntimeError(f"{type(error).__name__}: {error}") from None
        raise
