"""What browsers are told of every answer."""

from __future__ import annotations

from starlette.types import ASGIApp, Message, Receive, Scope, Send

__all__ = ["SecurityHeaders"]

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
