"""Connections to PostgreSQL that do not wait for ever.

A server that is halted, or a machine that is stopped, takes what is sent and says nothing: its
kernel goes on answering for it, and no limit that it was told of runs out.
"""

from __future__ import annotations

import time
from typing import Any

import psycopg
import sqlalchemy as sa
from psycopg.abc import RV, PQGen

__all__ = ["listen_patiently"]

#: Seconds that a server has for an answer: some more than it is told that a statement may take.
_ANSWER_S = 30.0


class _Connection(psycopg.Connection[Any]):
    """A connection that is closed when its server does not answer: OperationalError is raised."""

    def wait(self, gen: PQGen[RV], *arguments: Any, **options: Any) -> RV:
        """Return what the server answers to what was sent."""
        return super().wait(self._in_time(gen), *arguments, **options)

    def _in_time(self, gen: PQGen[RV]) -> PQGen[RV]:
        """Pass on what a conversation waits for, and end it when the time is up; psycopg looks ten
        times a second.
        """
        late = time.monotonic() + _ANSWER_S
        try:
            wanted = next(gen)
            while True:
                ready = yield wanted
                if not ready and time.monotonic() > late:
                    self.close()
                    raise psycopg.OperationalError("the server does not answer")
                wanted = gen.send(ready)
        except StopIteration as end:
            answer: RV = end.value
            return answer


def listen_patiently(engine: sa.Engine) -> None:
    """Let the connections of an engine give up a server that does not answer."""
    sa.event.listen(engine, "do_connect", _connect)


def _connect(_: Any, __: Any, positional: list[Any], named: dict[str, Any]) -> Any:
    return _Connection.connect(*positional, **named)
