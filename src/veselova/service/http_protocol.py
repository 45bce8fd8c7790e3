"""HTTP/1.1 on one connection: uvicorn's protocol on h11, with a problem document for what is no HTTP."""

from __future__ import annotations

import orjson
from uvicorn.protocols.http.h11_impl import H11Protocol

from veselova.service.problem_details import MEDIA_TYPE, Refused, problem_document

__all__ = ["Http"]


class Http(H11Protocol):
    """A connection. h11 bounds what it holds of a head that does not end, and reads one request after the other.

    httptools, which uvicorn would take where it is installed, saves 0.3 ms a request, but takes fields of trailers for fields of
    heads, leaves aside the bodies of requests to upgrade, and has no bounds.
    """

    def send_400_response(self, msg: str) -> None:
        """Answer what is no HTTP with a problem document, unless another answer is under way, and end the connection."""
        if self.cycle is not None and self.cycle.response_started and not self.cycle.response_complete:
            self.transport.close()
            return
        detail = "The request: required HTTP/1.1, with a head of at most 64 kB; given something else."
        body = orjson.dumps(problem_document(Refused("malformed-http", detail)))
        fields = b"content-type: %b\r\ncontent-length: %d\r\nconnection: close\r\n" % (MEDIA_TYPE.encode(), len(body))
        self.transport.write(b"HTTP/1.1 400 Bad Request\r\n%b\r\n%b" % (fields, body))
        self.transport.close()
