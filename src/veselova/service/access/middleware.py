"""API keys: an ASGI middleware around the application asks for them, and says who calls."""

from __future__ import annotations

from collections.abc import Callable

import anyio.to_thread
from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from veselova.service.access.keys import ADMIN, READ, SOLVE, Caller, Key, Keys
from veselova.service.api.problem_details import Refused, problem_response
from veselova.service.api.settings import Settings
from veselova.service.observability.logs import note

#: Paths for the probes of orchestrators.
PROBES = frozenset({"/healthz", "/readyz"})

#: The contract of the service, the explorer and the guide are no secret.
_PUBLIC = PROBES | {"/", "/geodesics", "/docs", "/guide", "/openapi.json"}
_PUBLIC_FOLDERS = ("/explorer/", "/guide/")

#: Methods for which a key of scope ``read`` is enough, and paths that tell of what all do.
_READING = frozenset({"GET", "HEAD", "OPTIONS"})
_ADMINISTRATIVE = frozenset({"/metrics"})

_REALM = 'Bearer realm="veselova"'


def requires_keys(settings: Settings, loopback: bool) -> bool:
    """Return whether clients must show a key, where the server does or does not bind to
    loopback.
    """
    return settings.keys == "required" or (settings.keys == "auto" and not loopback)


class Access:
    """The middleware. What it refuses never reaches the application; ``refused`` is told the
    code. Without ``keys`` it admits everyone.
    """

    def __init__(self, app: ASGIApp, keys: Keys | None, refused: Callable[[str], None]) -> None:
        self._app = app
        self._keys = keys
        self._refused = refused

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or answer it with 401, 403, 404, 501 or 503."""
        if scope["type"] == "http":
            try:
                await self._admit(scope)
            except Refused as error:
                self._refused(error.code)
                note(outcome=error.code)
                await problem_response(error)(scope, receive, send)
                return
        await self._app(scope, receive, send)

    async def _admit(self, scope: Scope) -> None:
        """Raise Refused unless the request may go on, and say whose it is."""
        scope["user"] = Caller()
        # The framework takes /metrics and a line feed for /metrics, whose scope another has.
        if not scope["path"].isprintable():
            raise Refused("no-such-resource", "No resource has control characters in its path.")
        credentials = ",".join(Headers(scope=scope).getlist("authorization"))
        public = scope["path"] in _PUBLIC or scope["path"].startswith(_PUBLIC_FOLDERS)
        if self._keys is None or scope["path"] in PROBES or (public and not credentials):
            return
        if not credentials:
            detail = "Authorization: required an API key, as Bearer vsl_…; given none."
            raise Refused("unauthorized", detail, authenticate=_REALM)
        key = await self._holder(self._keys, credentials)
        note(key=key.id)
        caller = Caller(key.owner, key.scope)
        needed = READ if scope["method"] in _READING else SOLVE
        needed = ADMIN if scope["path"] in _ADMINISTRATIVE else needed
        if not caller.may(needed):
            raise Refused(
                "insufficient-scope",
                f"The API key: required scope {needed}; given one of scope {key.scope}.",
                authenticate=f'{_REALM}, error="insufficient_scope", scope="{needed}"',
            )
        scope["user"] = caller

    async def _holder(self, keys: Keys, credentials: str) -> Key:
        """Return the key that was shown."""
        scheme, _, text = credentials.partition(" ")
        key = None
        if scheme.lower() == "bearer":
            key = await anyio.to_thread.run_sync(keys.holder, text.strip())
        if key is None:
            detail = "Authorization: required an API key of this server, as Bearer vsl_…; given "
            detail += "another."
        elif key.state == "expired":
            detail = "The API key has expired; whoever runs the server can make another."
        else:
            return key
        raise Refused("unauthorized", detail, authenticate=f'{_REALM}, error="invalid_token"')
