"""HTTP/1.1 on one connection: read by httptools, within bounds that it has not, and by h11 what that leaves aside."""

from __future__ import annotations

import asyncio
from typing import Any

import httptools
import orjson
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

from veselova.service.problem_details import MEDIA_TYPE, Refused, problem_document

__all__ = ["BoundedHttp"]

#: Bytes of the head of a request, of the trailer of its body, and of whatever else is held until it ends: as many as h11 takes.
_LONGEST_HEAD = 64 * 1024

#: Requests that may wait on a connection for the answer to one before them.
_MOST_WAITING = 16


class _Refusing:
    """What is answered to bytes that are no request."""

    transport: asyncio.Transport

    def send_400_response(self, msg: str) -> None:
        """Answer with a problem document, and end the connection."""
        detail = f"The request: required HTTP/1.1 with a head of at most {_LONGEST_HEAD // 1024} kB; given something else."
        body = orjson.dumps(problem_document(Refused("malformed-http", detail)))
        fields = b"content-type: %b\r\ncontent-length: %d\r\nconnection: close\r\n" % (MEDIA_TYPE.encode(), len(body))
        self.transport.write(b"HTTP/1.1 400 Bad Request\r\n%b\r\n%b" % (fields, body))
        self.transport.close()


class _H11(_Refusing, H11Protocol):
    pass


class BoundedHttp(_Refusing, HttpToolsProtocol):
    """uvicorn's protocol on httptools, for clients that send heads without end too, or requests faster than they take answers.

    What is no HTTP gets a problem document, and the connection ends; where requests before it are not answered yet it ends with
    the last of their answers. A connection is handed over to h11 with the first request of an invented method, which httptools
    does not read, or one to upgrade, whose body it leaves aside: clients that speak HTTP/1.1 as well ask for HTTP/2 like this.
    """

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self._held = 0  # bytes that have come since the parser gave anything of a request
        self._head = 0  # bytes of the fields of the request at hand
        self._deaf = False

    def data_received(self, data: bytes) -> None:
        """Read what has come."""
        if self._deaf:
            return
        self._unset_keepalive_if_required()
        self._held += len(data)
        try:
            self.parser.feed_data(data)
        except httptools.HttpParserUpgrade as upgrade:
            self._hand_over(self._head_again() + data[upgrade.args[0] :])
        except httptools.HttpParserInvalidMethodError:
            if self._held == len(data):  # nothing of it has been read
                self._hand_over(data)
            else:
                self._end()
        except httptools.HttpParserError:
            self._end()
        else:
            if self._held > _LONGEST_HEAD:
                self._end()

    def on_message_begin(self) -> None:
        """Begin a request; what is raised here and below ends the parsing as an HttpParserError."""
        if len(self.pipeline) >= _MOST_WAITING:
            raise OverflowError
        self._head = 0
        super().on_message_begin()

    def on_header(self, name: bytes, value: bytes) -> None:
        """Take a field of the head, or of the trailer."""
        self._head += len(name) + len(value)
        if self._head > _LONGEST_HEAD:
            raise OverflowError
        super().on_header(name, value)

    def on_headers_complete(self) -> None:
        """Start the answer to a request, but to none that asks for an upgrade."""
        super().on_headers_complete()
        if not self.parser.should_upgrade():
            self._held = 0

    def on_body(self, body: bytes) -> None:
        """Take a part of the body."""
        self._held = 0
        super().on_body(body)

    def on_message_complete(self) -> None:
        """End a request."""
        self._held = 0
        super().on_message_complete()

    def _should_upgrade(self) -> bool:
        return True

    def _head_again(self) -> bytes:
        fields = b"".join(b"%b: %b\r\n" % field for field in self.headers)
        return b"%b %b HTTP/1.1\r\n%b\r\n" % (self.parser.get_method(), self.url, fields)

    @property
    def _owes(self) -> bool:
        """Return whether the answer to some request is not complete."""
        return self.cycle is not None and not self.cycle.response_complete

    def _hand_over(self, data: bytes) -> None:
        """Let h11 read what comes from now on."""
        if self._owes:
            self._end()
            return
        self.connections.discard(self)
        protocol = _H11(self.config, self.server_state, self.app_state)
        protocol.connection_made(self.transport)
        self.transport.set_protocol(protocol)
        protocol.data_received(data)

    def _end(self) -> None:
        """Read nothing more, and end the connection: after the answers to the requests that are whole."""
        self._deaf = True
        if self._owes and not self.cycle.more_body:
            self.cycle.keep_alive = False
        elif self.pipeline or (self._owes and self.cycle.response_started):
            self.transport.close()
        else:
            self.send_400_response("")
