"""A worker process as its server sees it."""

from __future__ import annotations

import asyncio
import pickle
import sys
from contextlib import suppress
from typing import Any, cast

import anyio

from veselova.service.workers import worker_process
from veselova.service.workers.worker_process import SIZE, message

__all__ = ["Worker", "WorkerLost"]


class WorkerLost(Exception):
    """A worker process has ended before it answered, or could not be started."""


class Worker(asyncio.SubprocessProtocol):
    """One process of ``worker_process``, which answers one call at a time.

    Nothing stands between its pipes and the event loop: a call is one write, and the end of an
    answer wakes whoever waits for it.
    """

    def __init__(self) -> None:
        self._received = bytearray()
        self._answer: asyncio.Future[bytes] | None = None
        self._closed = False
        self._ended = asyncio.Event()

    @classmethod
    async def start(cls, most_bytes: int) -> Worker:
        """Return a new worker, whose process may take so much memory; it can be asked at once.
        Raises WorkerLost.
        """
        command = (sys.executable, "-m", worker_process.__name__, str(most_bytes))
        try:
            _, worker = await asyncio.get_running_loop().subprocess_exec(cls, *command, stderr=None)
        except OSError as error:
            raise WorkerLost from error
        worker._calls.write(message(sys.path))
        return worker

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Keep the way to the process."""
        self._process = cast(asyncio.SubprocessTransport, transport)
        self._calls = cast(asyncio.WriteTransport, self._process.get_pipe_transport(0))

    def pipe_data_received(self, fd: int, data: bytes) -> None:
        """Take a part of an answer."""
        received = self._received
        received += data
        if (
            len(received) >= SIZE.size
            and len(received) == SIZE.size + SIZE.unpack_from(received)[0]
        ):
            content = bytes(memoryview(received)[SIZE.size :])
            received.clear()
            if self._answer is not None and not self._answer.done():
                self._answer.set_result(content)

    def pipe_connection_lost(self, fd: int, exc: Exception | None) -> None:
        """Tell whoever waits that no answer comes any more; what was sent before has
        come by now.
        """
        if fd == 1:
            self._closed = True
            if self._answer is not None and not self._answer.done():
                self._answer.set_exception(WorkerLost())

    def process_exited(self) -> None:
        """Note the end of the process."""
        self._ended.set()

    def connection_lost(self, exc: Exception | None) -> None:
        """Let go of a process that has ended by itself."""
        self._process.close()

    @property
    def process_id(self) -> int:
        """Return the id of the process."""
        return self._process.get_pid()

    @property
    def lives(self) -> bool:
        """Return whether the process can be asked: as far as is known, it has not ended."""
        return not self._closed and not self._ended.is_set()

    async def ask(self, call: bytes) -> Any:
        """Return what a call gives (the ``message`` of a task, its arguments and its budget), and
        raise what it raises.

        Raises WorkerLost where the process ends before it has answered. Who stops waiting for the
        answer ends the process.
        """
        if not self.lives:
            raise WorkerLost
        self._answer = asyncio.get_running_loop().create_future()
        self._calls.write(call)
        try:
            content = await self._answer
        except BaseException:
            await self.end()
            raise
        succeeded, value = pickle.loads(content)
        if not succeeded:
            raise value
        return value

    async def end(self) -> None:
        """Kill the process, whatever it does, and wait until it is gone."""
        with suppress(ProcessLookupError):
            self._process.kill()
        with anyio.CancelScope(shield=True):
            await self._ended.wait()
        self._process.close()
