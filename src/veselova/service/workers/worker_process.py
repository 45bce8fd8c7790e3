"""What runs in a worker process: it takes one call after the other from its server, and answers
each.

    python -m veselova.service.workers.worker_process BYTES

Calls come on standard input and answers leave on standard output, each a pickle behind its size.
The first thing that comes is the server's path of imports.
"""

from __future__ import annotations

import math
import os
import pickle
import signal
import struct
import sys
from collections.abc import Callable
from typing import Any, BinaryIO

__all__ = ["SIZE", "answer", "message", "serve"]

#: Seconds after its budget before a worker ends without having been ended.
_SERVERS_TURN_S = 1.0

#: Longer than this, some thirty years, no process is let run; beyond 2⁶³ s there is no timer.
_LONGEST_TIMER_S = 1e9

#: What stands before a pickle: its size in bytes.
SIZE = struct.Struct("<Q")


def message(content: Any) -> bytes:
    """Return something as it is sent from a process to the other.

    A call is (task, arguments, seconds that it may take), an answer (succeeded, value).
    """
    pickled = pickle.dumps(content, pickle.HIGHEST_PROTOCOL)
    return SIZE.pack(len(pickled)) + pickled


def serve(most_bytes: int) -> None:
    """Answer the calls of a server, within so much memory, until it closes its end."""
    # what a terminal or a supervisor sends to all is for the server, which ends its workers
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    calls = _withdraw(0, "rb")
    answers = _withdraw(1, "wb")
    sys.path[:] = pickle.loads(_receive(calls) or pickle.dumps(sys.path))
    _limit_memory(most_bytes)
    while call := _receive(calls):
        answers.write(answer(call))
        answers.flush()


def _withdraw(descriptor: int, mode: str) -> Any:
    """Return the stream behind a descriptor, which leads nowhere from now on: nothing that a
    library prints is an answer.
    """
    stream = os.fdopen(os.dup(descriptor), mode)
    nowhere = os.open(os.devnull, os.O_RDWR)
    os.dup2(nowhere, descriptor)
    os.close(nowhere)
    return stream


def _receive(calls: BinaryIO) -> bytes:
    """Return the pickle that comes next, nothing where the server has closed its end."""
    size = calls.read(SIZE.size)
    return calls.read(SIZE.unpack(size)[0]) if len(size) == SIZE.size else b""


def answer(call: bytes) -> bytes:
    """Return the message that answers a call, the pickle of a task, its arguments and the seconds
    that it may take.
    """
    try:
        task, arguments, seconds = pickle.loads(call)
        _end_after(seconds)
        return message((True, _run(task, arguments, seconds)))
    except Exception as error:
        try:
            pickle.loads(pickle.dumps(error))
            return message((False, error))
        except Exception:  # it holds what cannot be sent, or made again
            return message((False, RuntimeError(f"{type(error).__name__}: {error}")))
    finally:
        _end_after(math.inf)


def _run(task: Callable[..., Any], arguments: tuple[Any, ...], seconds: float) -> Any:
    """Return what a task gives, which knows how long it may take; its progress is for nobody."""
    from veselova.mechanics.core.budget import limits

    with limits(seconds if math.isfinite(seconds) else None, False):
        return task(*arguments)


def _end_after(seconds: float) -> None:
    """Let the system end this process after so many seconds, as its server would have done, had it
    not been killed itself.
    """
    if hasattr(signal, "setitimer"):
        ends = seconds <= _LONGEST_TIMER_S
        signal.setitimer(signal.ITIMER_REAL, seconds + _SERVERS_TURN_S if ends else 0)


def _limit_memory(most_bytes: int) -> None:
    try:
        import resource
    except ImportError:  # not a POSIX system: the limit of its container is what there is
        return
    # Arrow's own allocator reserves a gigabyte, used or not, which would count.
    os.environ.setdefault("ARROW_DEFAULT_MEMORY_POOL", "system")
    # On Linux RLIMIT_DATA counts what a process writes to, and not the libraries that it maps, as
    # RLIMIT_AS would.
    kind = resource.RLIMIT_DATA if sys.platform == "linux" else resource.RLIMIT_AS
    hard = resource.getrlimit(kind)[1]
    resource.setrlimit(
        kind, (most_bytes if hard == resource.RLIM_INFINITY else min(most_bytes, hard), hard)
    )


if __name__ == "__main__":
    serve(int(sys.argv[1]))
