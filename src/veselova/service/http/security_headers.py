"""What browsers are told of every answer, and the page of the documentation with the one policy
that lets it run.
"""

from __future__ import annotations

import base64
import hashlib
import re

from fastapi import FastAPI
from fastapi.openapi.docs import get_swagger_ui_html
from starlette.requests import Request
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

__all__ = ["SecurityHeaders", "add_documentation"]

#: An answer of the service is data: nothing in it is to be run, framed or guessed at.
_HEADERS = (
    (b"content-security-policy", b"default-src 'none'; frame-ancestors 'none'"),
    (b"referrer-policy", b"no-referrer"),
    (b"x-content-type-options", b"nosniff"),
    (b"x-frame-options", b"DENY"),
)

#: And a failure is not to be kept.
_OF_FAILURES = (*_HEADERS, (b"cache-control", b"no-store"))


class SecurityHeaders:
    """ASGI middleware: adds the headers that an answer does not have; failures are not to be
    stored.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, and its answer back with the headers."""

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                fields = list(message.get("headers", ()))
                stated = {name for name, _ in fields}
                further = _HEADERS if message["status"] < 400 else _OF_FAILURES
                message = {
                    **message,
                    "headers": fields + [field for field in further if field[0] not in stated],
                }
            await send(message)

        await self._app(scope, receive, send_with_headers if scope["type"] == "http" else send)


def add_documentation(app: FastAPI) -> None:
    """Serve the interactive documentation at ``/docs``: its own script by its hash, the rest from
    the network it names.
    """
    page = get_swagger_ui_html(openapi_url="/openapi.json", title="veselova")
    script = re.search(rb"<script>(.*?)</script>", bytes(page.body), re.DOTALL)
    assert script, "the page starts itself by a script of its own"
    digest = base64.b64encode(hashlib.sha256(script[1]).digest()).decode()
    page.headers["Content-Security-Policy"] = "; ".join(
        (
            "default-src 'none'",
            f"script-src https://cdn.jsdelivr.net 'sha256-{digest}'",
            "style-src https://cdn.jsdelivr.net 'unsafe-inline'",
            "img-src https://fastapi.tiangolo.com data:",
            "connect-src 'self'",
            "frame-ancestors 'none'",
        )
    )

    async def documentation(_: Request) -> Response:
        return page

    app.add_route("/docs", documentation, include_in_schema=False)
