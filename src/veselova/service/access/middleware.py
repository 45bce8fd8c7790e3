"""Who may ask, and how often: API keys and rate limits, in an ASGI middleware around the
application.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from http import HTTPMethod

import anyio
import anyio.to_thread
from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from veselova.service.access.keys import Key, Keys
from veselova.service.api.caller import ADMIN, READ, SOLVE, Caller, put_caller
from veselova.service.api.problem_details import Refused, problem_response
from veselova.service.api.rate_limits import Allowance, RateLimit, network_of, rate_of
from veselova.service.api.settings import Settings
from veselova.service.observability.request_log import note

__all__ = ["UNLIMITED", "Access", "Policy"]

#: Paths for the probes of orchestrators: neither keys nor limits.
UNLIMITED = frozenset({"/healthz", "/readyz"})

#: The contract of the service, the explorer and the guide are no secret: without a key, within the
#: limit of the address.
_PUBLIC = frozenset({"/", "/docs", "/guide", "/openapi.json"})
_PUBLIC_FOLDERS = ("/explorer/", "/guide/")

#: Methods for which a key of scope ``read`` is enough, and paths that tell of what all do.
_READING = frozenset({"GET", "HEAD", "OPTIONS"})
_ADMINISTRATIVE = frozenset({"/metrics"})

#: Anything else is no method of HTTP; what is counted by method must not be counted by a client's
#: inventions.
_METHODS = frozenset(HTTPMethod) | {"QUERY"}

#: Limit of one caller where ``auto`` says that there is one.
_RATE_BEYOND_LOOPBACK = "600/minute"

#: Keys that are looked for at a time. Where the database does not answer, threads of others than
#: these are free.
_THREADS = 10


@dataclass(frozen=True)
class Policy:
    """Who may ask how often. No keys: everyone; no rate: as often as they like.

    Keys are counted apart from addresses, so that a flood from many addresses takes no room from
    those who have a key.
    """

    keys: Keys | None
    by_key: RateLimit | None
    by_address: RateLimit | None
    failures: RateLimit | None

    @staticmethod
    def requires_keys(settings: Settings, loopback: bool) -> bool:
        """Return whether clients must show a key, where the server does or does not bind to
        loopback.
        """
        return settings.keys == "required" or (settings.keys == "auto" and not loopback)

    @staticmethod
    def of(settings: Settings, loopback: bool, keys: Keys | None) -> Policy:
        """Return the policy that the settings state; ``keys`` are those of the database, None where
        none are asked for.
        """
        stated = settings.rate_limit
        if stated == "auto":
            stated = "none" if loopback else _RATE_BEYOND_LOOPBACK
        return Policy(keys, rate_of(stated), rate_of(stated), rate_of(settings.failed_key_limit))


class Access:
    """The middleware that holds a policy. What it refuses never reaches the application;
    ``refused`` is told the code.
    """

    def __init__(self, app: ASGIApp, policy: Policy, refused: Callable[[str], None]) -> None:
        self._app = app
        self._policy = policy
        self._refused = refused
        self._threads = anyio.CapacityLimiter(_THREADS)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or answer it with 401, 403, 404, 429, 501 or 503."""
        if scope["type"] != "http" or scope["path"] in UNLIMITED:
            await self._app(scope, receive, send)
            return
        headers: dict[str, str] = {}
        try:
            await self._admit(scope, headers)
        except Refused as error:
            self._refused(error.code)
            note(outcome=error.code)
            response = problem_response(error)
            response.headers.update(headers)
            await response(scope, receive, send)
            return

        async def send_with_limits(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(headers)
            await send(message)

        await self._app(scope, receive, send_with_limits if headers else send)

    async def _admit(self, scope: Scope, headers: dict[str, str]) -> None:
        """Raise Refused unless the request may go on; headers of the answer, refusal or not, are
        put into ``headers``.
        """
        if scope["method"] not in _METHODS:
            raise Refused("unknown-method", "The method is not one of HTTP's.")
        # The framework takes /metrics and a line feed for /metrics, whose scope another has.
        if not scope["path"].isprintable():
            raise Refused("no-such-resource", "No resource has control characters in its path.")
        address = network_of((scope.get("client") or (None,))[0])
        credentials = Headers(scope=scope).getlist("authorization")
        put_caller(scope, Caller(address))
        if self._policy.keys is None or not credentials:
            await _spend(self._policy.by_address, address, "address", headers)
            if self._policy.keys is None or _is_public(scope["path"]):
                return
            headers["WWW-Authenticate"] = 'Bearer realm="veselova"'
            raise Refused(
                "unauthorized", "Authorization: required an API key, as Bearer vsl_…; given none."
            )
        key = await self._holder(self._policy.keys, credentials, address, headers)
        note(key=key.id)
        await _spend(self._policy.by_key, key.id, "key", headers)
        _require_scope(key, _scope_of(scope), headers)
        put_caller(scope, Caller(key.owner, key.owner, key.scope))

    async def _holder(
        self, keys: Keys, credentials: list[str], address: str, headers: dict[str, str]
    ) -> Key:
        """Return the key that was shown; an address that showed too many wrong ones is not looked
        at.
        """
        failures = self._policy.failures
        if failures is not None:
            _require(await failures.look(address), "wrong keys from this address", headers)
        scheme, _, text = credentials[0].partition(" ")
        key = None
        if len(credentials) == 1 and scheme.lower() == "bearer":
            shown = text.strip()
            key = await anyio.to_thread.run_sync(keys.holder, shown, limiter=self._threads)
        if key is not None and key.expired:
            headers["WWW-Authenticate"] = 'Bearer realm="veselova", error="invalid_token"'
            raise Refused(
                "unauthorized", "The API key has expired; whoever runs the server can make another."
            )
        if key is not None:
            return key
        if failures is not None:
            await failures.spend(address)
        headers["WWW-Authenticate"] = 'Bearer realm="veselova", error="invalid_token"'
        raise Refused(
            "unauthorized",
            "Authorization: required an API key of this server, as Bearer vsl_…; given another.",
        )


def _is_public(path: str) -> bool:
    return path in _PUBLIC or path.startswith(_PUBLIC_FOLDERS)


def _scope_of(scope: Scope) -> str:
    """Return the scope that a request needs; it is found before anything is looked for, so a
    refusal tells of nothing.
    """
    if scope["path"] in _ADMINISTRATIVE:
        return ADMIN
    return READ if scope["method"] in _READING else SOLVE


def _require_scope(key: Key, needed: str, headers: dict[str, str]) -> None:
    if not Caller(scope=key.scope).may(needed):
        headers["WWW-Authenticate"] = (
            f'Bearer realm="veselova", error="insufficient_scope", scope="{needed}"'
        )
        raise Refused(
            "insufficient-scope",
            f"The API key: required scope {needed}; given one of scope {key.scope}.",
        )


async def _spend(rate: RateLimit | None, caller: str, kind: str, headers: dict[str, str]) -> None:
    if rate is not None:
        allowance = await rate.spend(caller)
        headers.update(allowance.headers)
        _require(allowance, f"requests of one {kind}", headers)


def _require(allowance: Allowance, of: str, headers: dict[str, str]) -> None:
    if not allowance.granted:
        headers["Retry-After"] = str(allowance.reset_s)
        required = f"at most {allowance.quota} in {allowance.window_s} s"
        raise Refused(
            "rate-limited",
            f"Too many {of}: required {required}; try again in {allowance.reset_s} s.",
        )
