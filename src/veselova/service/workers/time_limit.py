"""A limit on the time of one computation inside a thread that must live on."""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Iterator
from contextlib import contextmanager

__all__ = ["TimeIsUp", "time_limit"]


class TimeIsUp(BaseException):
    """Raised inside a computation that has used up its time; no handler of errors may take it for
    one of its own.
    """


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Raise TimeIsUp in the thread of the caller when the block has run for so many seconds.

    It is raised between two instructions of Python, so a single call into a compiled library ends
    first.
    """
    thread = threading.get_ident()
    lock = threading.Lock()
    ended = False

    def stop() -> None:
        with lock:
            if not ended:
                ctypes.pythonapi.PyThreadState_SetAsyncExc(
                    ctypes.c_ulong(thread), ctypes.py_object(TimeIsUp)
                )

    timer = threading.Timer(seconds, stop)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        with lock:
            ended = True
        timer.cancel()
