"""HTTP/1.1 on one connection: uvicorn's protocol on h11, with limits in time, and problem documents
for what is no request.
"""

from __future__ import annotations

import asyncio
import re
from contextlib import suppress
from typing import Any, cast
from urllib.parse import unquote

import h11
import orjson
from starlette.types import Message, Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol

from veselova.service.api.problem_details import (
    MEDIA_TYPE,
    Refused,
    problem_document,
    problem_response,
)
from veselova.service.api.settings import Settings
from veselova.service.http.connections import Connections

__all__ = ["Http"]

#: Seconds between two looks at how far a connection is.
_LOOK_S = 0.25

#: Bytes that are read at once: h11 takes some 10 µs for each of the smallest chunks, and other
#: connections wait meanwhile.
_READ_BYTES = 4_096

#: Seconds for which a client may go on sending what nobody reads, so that it comes to read the
#: answer.
_LINGER_S = 2.0

#: Bytes that it may send so.
_MOST_UNREAD = 2_000_000

#: Bytes that the chunks of a body may take besides it, with one more for so many bytes of it: the
#: smallest take six bytes each, and h11 some 10 µs.
_MOST_FRAMING = 16_000
_BODY_PER_FRAMING = 16

#: Seconds that a body has before its rate is looked at.
_GRACE_S = 5.0

_CLOSE = (b"connection", b"close")


class Http(H11Protocol):
    """A connection. h11 bounds what it holds of a head that does not end, and reads one request
    after the other.

    httptools, which uvicorn would take where it is installed, saves 0.3 ms a request, but takes
    fields of trailers for fields of heads, leaves aside the bodies of requests to upgrade, and has
    no bounds.
    """

    def __init__(self, settings: Settings, connections: Connections, **uvicorn: Any) -> None:
        super().__init__(**uvicorn)
        self._settings = settings
        self._connections = connections
        self._application, self.app = self.app, self._answer
        self._counted = self._lingers = False
        self._fault = ""
        self._received = 0
        self._framing_left = 0.0
        self._watched: tuple[Any, Any] = (None, None)
        self._since = self._taken_at = self.loop.time()
        self._taken = 0
        self._looking: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin, unless there are too many connections."""
        own = cast(asyncio.Transport, transport)
        if hasattr(own, "max_size"):
            own.max_size = _READ_BYTES
        self._own = _Ending(own, self)
        super().connection_made(cast(asyncio.Transport, self._own))
        self._look()
        try:
            self._connections.enter(self._peer)
            self._counted = True
        except Refused as error:
            self._refuse(error)

    def connection_lost(self, exc: Exception | None) -> None:
        """End."""
        if self._looking is not None:
            self._looking.cancel()
        if self._counted:
            self._counted = False
            self._connections.leave(self._peer)
        super().connection_lost(exc)

    @property
    def _peer(self) -> str | None:
        return self.client[0] if self.client else None

    def data_received(self, data: bytes) -> None:
        """Take what comes; what comes after the end of the conversation is left aside."""
        self._received += len(data)
        if self._lingers or self._fault:
            if self._received > _MOST_UNREAD:
                self._own.abort()
            return
        cycle = self.cycle
        held = len(cycle.body) if self._reads_body else 0
        super().data_received(data)
        if self.cycle is not cycle:
            self._framing_left = _MOST_FRAMING
        elif self._reads_body:
            self._count_framing(len(data), len(cycle.body) - held)

    def _count_framing(self, received: int, of_body: int) -> None:
        """Let a body go that has come in chunks so small, or with so much beside their sizes, that
        reading it takes more than its size says.
        """
        self._framing_left += of_body / _BODY_PER_FRAMING - (received - of_body)
        if self._framing_left < 0:
            self._fail("body-too-large")

    def _unsupported_upgrade_warning(self) -> None:
        """Say nothing: the request has its line in the log, and is answered as if it did not
        ask.
        """

    def shutdown(self) -> None:
        """Answer what is not here yet with 503, finish what is, and end the connection."""
        if self.transport.is_closing():
            return
        super().shutdown()
        if self._reads_body:
            self._fail("shutting-down")
        elif self.cycle is not None and not self.cycle.response_complete:
            self.scope["state"]["ending"] = True

    @property
    def _reads_body(self) -> bool:
        """Return whether a request has come but for its body, and no answer is under way."""
        return self.cycle is not None and self.cycle.more_body and not self.cycle.response_started

    async def _answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Run the application on a request, which is told where no more of the body comes; ends the
        connection after that.
        """
        cycle = self.cycle
        _to_origin_form(scope)
        names = {name for name, _ in scope["headers"]}
        # RFC 9112, 6.3: an attempt at smuggling
        if b"content-length" in names and b"transfer-encoding" in names:
            self._fault = scope["state"]["unfinished"] = "malformed-http"
        started = False

        async def receive_whole() -> Message:
            if (self._fault and cycle.more_body) or self._fault == "malformed-http":
                return {"type": "http.disconnect"}
            message = await receive()
            return {"type": "http.disconnect"} if self._fault and cycle.more_body else message

        async def send_last(message: Message) -> None:
            nonlocal started
            if message["type"] == "http.response.start":
                started = True
                if cycle.more_body or self._fault or not cycle.keep_alive:
                    message = {**message, "headers": [*message.get("headers", ()), _CLOSE]}
            await send(message)

        try:
            await self._application(scope, receive_whole, send_last)
        except asyncio.CancelledError:  # the grace after SIGTERM has run out
            if not started:
                await problem_response(_shutting_down())(scope, receive, send_last)

    def _fail(self, code: str) -> None:
        """Let the application answer a request whose body will not be read to its end."""
        self._fault = self.scope["state"]["unfinished"] = code
        self.cycle.message_event.set()

    def send_400_response(self, msg: str) -> None:
        """Answer what is no HTTP with a problem document, unless another answer is under way, and
        end the connection.
        """
        if self.cycle is not None and not self.cycle.response_complete:
            if self._reads_body:
                self._fail("malformed-http")
            else:
                self.transport.close()
            return
        self._refuse(
            Refused(
                "malformed-http",
                "The request: required HTTP/1.1, with a head of at most 64 kB; given "
                "something else.",
            )
        )

    def _refuse(self, error: Refused) -> None:
        """Write a problem document where no request is, and end the connection."""
        document = problem_document(error)
        body = orjson.dumps(document)
        status = document["status"]
        fields = b"content-type: %b\r\ncontent-length: %d\r\nconnection: close\r\n" % (
            MEDIA_TYPE.encode(),
            len(body),
        )
        if error.retry_after is not None:
            fields += b"retry-after: %d\r\n" % error.retry_after
        self.transport.write(
            b"HTTP/1.1 %d %b\r\n%b\r\n%b" % (status, _PHRASES[status], fields, body)
        )
        self._fault = error.code
        self.transport.close()

    def _look(self) -> None:
        """Look whether the client sends and reads as fast as it must, and again in a moment."""
        self._looking = self.loop.call_later(_LOOK_S, self._look)
        now = self.loop.time()
        limits = self._settings
        if (taken := self._own.taken) != self._taken or not self._own.waiting:
            self._taken = taken
            self._taken_at = now
        elif now - self._taken_at > limits.send_timeout_s:
            self._own.abort()
            return
        watched = (self.cycle, self._stage())
        if watched != self._watched:
            self._watched = watched
            self._since = now
            self._received = 0
        passed = now - self._since
        if self._stage() == "end" and passed > _LINGER_S and not self._own.waiting:
            self._own.abort()
        elif self._stage() == "head" and passed > limits.head_timeout_s:
            if self.conn.trailing_data[0]:
                self._refuse(
                    Refused(
                        "request-timeout",
                        f"The head: required within {limits.head_timeout_s:g} s; given a part.",
                    )
                )
            else:
                self.transport.close()
        elif self._stage() == "body" and not self.flow.read_paused:
            slow = passed > _GRACE_S and self._received < limits.body_bytes_per_s * passed
            if slow or passed > limits.body_timeout_s:
                self._fail("request-timeout")

    def _stage(self) -> str:
        """Return what is awaited of the client: a head, a body, the end, or nothing (while it is
        answered, say).
        """
        if self._lingers:
            return "end"
        if self._fault or self.transport.is_closing():
            return ""
        if self.conn.their_state is h11.IDLE and (self.cycle is None or self.conn.trailing_data[0]):
            return "head"
        return "body" if self._reads_body else ""

    def linger(self) -> bool:
        """Return whether the client may still be sending what nobody reads, so that the connection
        must not end at once.
        """
        unread = self.cycle is not None and self.cycle.more_body
        self._lingers = bool(self._fault) or unread
        if self._lingers:
            self.flow.resume_reading()
        return self._lingers


class _Ending:
    """The transport of a connection, which tells how much of what was written has been taken, and
    ends so that it is read.

    A socket that is closed while there is something to read resets the connection, and the client
    may never see its answer.
    """

    def __init__(self, transport: asyncio.Transport, protocol: Http) -> None:
        self._transport = transport
        self._protocol = protocol
        self._written = 0
        self._closing = False

    def __getattr__(self, name: str) -> Any:
        return getattr(self._transport, name)

    def write(self, data: bytes) -> None:
        """Send data, nothing after the end."""
        if not self._closing:
            self._written += len(data)
            self._transport.write(data)

    @property
    def waiting(self) -> int:
        """Return the bytes that the client has not taken yet."""
        return self._transport.get_write_buffer_size()

    @property
    def taken(self) -> int:
        """Return the bytes that it has."""
        return self._written - self.waiting

    def is_closing(self) -> bool:
        """Return whether the end has begun."""
        return self._closing or self._transport.is_closing()

    def close(self) -> None:
        """Send what was written, and end; where the client still sends, when it has heard that, or
        has had the time to.
        """
        if self.is_closing():
            return
        self._closing = True
        if self._protocol.linger() and self._transport.can_write_eof():
            with suppress(OSError):  # the client has gone already
                self._transport.write_eof()
                return
        self._transport.close()


def _to_origin_form(scope: Scope) -> None:
    """Let a target that states scheme and host, as for a proxy, be a path and a Host (RFC 9112,
    3.2.2).
    """
    if absolute := _ABSOLUTE.fullmatch(scope["raw_path"]):
        host, path = absolute.groups()
        scope["raw_path"] = path or b"/"
        scope["path"] = unquote(scope["raw_path"].decode("ascii"))
        others = [(name, value) for name, value in scope["headers"] if name != b"host"]
        scope["headers"] = [(b"host", host), *others]


#: A target in absolute form: its host and its path.
_ABSOLUTE = re.compile(rb"https?://([^/]+)(.*)", re.IGNORECASE)

#: Reasons of the statuses that connections themselves answer with.
_PHRASES = {400: b"Bad Request", 408: b"Request Timeout", 503: b"Service Unavailable"}


def _shutting_down() -> Refused:
    return Refused(
        "shutting-down", "The server is shutting down and stopped this work.", retry_after=5
    )
