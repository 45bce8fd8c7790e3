"""The names by which a server may be called.

A page of the web can make the browser that shows it call any server of its machine, under a name of
the page's own that it lets point to 127.0.0.1 (DNS rebinding). Such calls name that host, which no
server on loopback goes by.
"""

from __future__ import annotations

import ipaddress
import re

from starlette.types import ASGIApp, Receive, Scope, Send

from veselova.service.api.problem_details import Refused, problem_response
from veselova.service.api.settings import Settings
from veselova.service.observability.request_log import note

__all__ = ["Hosts", "allowed_hosts"]

#: A name or an address with or without a port; nothing else is looked into.
_HOST = re.compile(r"(\[[0-9a-f:.]+\]|[^][:/@,\s]*)(:\d*)?|[0-9a-f:.]+", re.IGNORECASE)


def allowed_hosts(settings: Settings, loopback: bool, keyed: bool) -> frozenset[str] | None:
    """Return the hosts that requests may name besides those of loopback, or None where they may
    name any; ``keyed`` says that clients must show a key, which no page has.
    """
    stated = settings.allowed_hosts.strip()
    if stated == "auto":
        return None if keyed and not loopback else frozenset()
    names = {_bare(name.strip()) for name in stated.split(",")}
    return None if "*" in names else frozenset(names)


class Hosts:
    """ASGI middleware: refuses requests to another host than the allowed ones and this machine
    itself.
    """

    def __init__(self, app: ASGIApp, allowed: frozenset[str]) -> None:
        self._app = app
        self._allowed = allowed

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or answer it with 421."""
        # the address of the socket, which is no name that a page could choose
        reached = (scope.get("server") or ("",))[0]
        if scope["type"] == "http" and not all(
            self._is_allowed(name, reached) for name in _stated_host(scope)
        ):
            error = Refused(
                "unknown-host",
                "Host: required a name of this server (VESELOVA_ALLOWED_HOSTS); given another.",
            )
            note(outcome=error.code)
            await problem_response(error)(scope, receive, send)
            return
        await self._app(scope, receive, send)

    def _is_allowed(self, field: str, reached: str) -> bool:
        host = _bare(field) if _HOST.fullmatch(field) else ""
        if (
            host in self._allowed
            or host == reached
            or host == "localhost"
            or host.endswith(".localhost")
        ):
            return True
        try:
            return ipaddress.ip_address(host).is_loopback
        except ValueError:
            return False


def _stated_host(scope: Scope) -> list[str]:
    """Return the Host of a request, empty where it states none."""
    return [value.decode("latin-1") for name, value in scope["headers"] if name == b"host"] or [""]


def _bare(host: str) -> str:
    """Return a host without its port, without brackets, in small letters."""
    host = host.lower().rstrip(".")
    if host.startswith("["):
        return host[1:].partition("]")[0]
    return host if host.count(":") > 1 else host.partition(":")[0].rstrip(".")
