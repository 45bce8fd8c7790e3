"""What a terminal, a shell or a supervisor sends to end a server goes to all of its processes;
workers are to leave it to the process that started them.
"""

from __future__ import annotations

import _thread
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker

__all__ = ["ignore_interrupt_in_children", "keep_from_children"]

# only POSIX systems have them, and interrupts that go to a group of processes
_MASKS = hasattr(signal, "pthread_sigmask")


def keep_from_children() -> None:
    """Let no process that the main thread starts from now on receive SIGINT, SIGTERM or SIGHUP;
    this process goes on receiving them. A SIGHUP that is ignored (nohup) stays so in all of them.

    A process inherits the signals that are blocked in the thread that starts it, and there is no
    other way to reach one that is still loading its interpreter. Blocked here, they are awaited by
    a thread and handed to the main one, which SIGURG, otherwise ignored, wakes from what it waits
    for. Call it in the main thread.
    """
    if _MASKS:
        kept = {signal.SIGINT, signal.SIGTERM}
        if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
            kept.add(signal.SIGHUP)
        signal.signal(signal.SIGURG, lambda *_: None)
        signal.pthread_sigmask(signal.SIG_BLOCK, kept)
        threading.Thread(target=_hand_on, args=(kept,), name="signals", daemon=True).start()


def _hand_on(kept: set[signal.Signals]) -> None:
    while True:
        _thread.interrupt_main(signal.Signals(signal.sigwait(kept)))
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGURG)


@contextmanager
def ignore_interrupt_in_children() -> Iterator[None]:
    """Let no process that this thread, or one that it starts, starts within the block receive
    SIGINT, nor what else this thread has blocked.

    Interrupts of this thread mostly come after the block.
    """
    if not _MASKS:
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        # multiprocessing starts it with its first process, and unblocks SIGINT and SIGTERM then
        resource_tracker.ensure_running()
        signal.pthread_sigmask(signal.SIG_SETMASK, {*before, signal.SIGINT})
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
