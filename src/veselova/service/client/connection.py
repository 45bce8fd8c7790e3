"""Arguments of a client: its address, its key and its connections, checked before anything is
sent.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from typing import Any, Generic, TypeVar
from urllib.request import getproxies, proxy_bypass

import httpx2 as httpx

from veselova.mechanics.core.errors import InvalidInput, ServiceError, show

__all__ = ["Connections", "credentials"]

T = TypeVar("T")


def credentials(api_key: Any) -> dict[str, str]:
    """Return the header that shows a key; none for an empty one. The refusal does not quote what
    may be a secret.
    """
    if not isinstance(api_key, str) or not re.fullmatch(r"[\x21-\x7e]*", api_key):
        given = "other characters" if isinstance(api_key, str) else type(api_key).__name__
        raise InvalidInput(("api_key",), "a key of the server (printable ASCII, no spaces)", given)
    return {"authorization": f"Bearer {api_key}"} if api_key else {}


class Connections(Generic[T]):
    """The HTTP client of an address: one for each process, since a connection that two of them use
    mixes up their answers. A copy, or what pickle makes, has its own.
    """

    def __init__(self, kind: Callable[..., T], base_url: Any, transport: Any) -> None:
        """Raises InvalidInput for an address that is none, and for proxies or certificates of the
        environment that cannot be used.
        """
        self._made_of = (kind, base_url, transport)
        self._http = _open(kind, base_url, transport)
        self._process = os.getpid()
        self._loop: Any = None
        self.closed = False

    def here(self, loop: Any = None) -> T:
        """Return the HTTP client of this process; raises ServiceError once it is closed, and in
        another event loop than the first.
        """
        if self.closed:
            raise ServiceError("the client is closed")
        self._loop = self._loop or loop
        if loop is not self._loop:
            raise ServiceError(
                "an AsyncClient belongs to the event loop of its first request: make one client in "
                "each loop"
            )
        if self._process != os.getpid():
            self._http, self._process = _open(*self._made_of), os.getpid()
        return self._http

    def close(self, loop: Any = None) -> T | None:
        """Refuse further requests, and return the HTTP client that is to be closed; None if it is
        closed, or another process opened it.

        Raises ServiceError in another event loop than that of the first request.
        """
        if self.closed or self._process != os.getpid():
            self.closed = True
            return None
        http = self.here(loop)
        self.closed = True
        return http

    def __reduce__(self) -> Any:
        return type(self), self._made_of, {"closed": self.closed}

    def proxy(self) -> str:
        """Return how a failure names the proxy of the environment that stands between this client
        and the server, without its password; nothing where there is none.
        """
        _, base_url, transport = self._made_of
        url = httpx.URL(base_url)
        proxies = getproxies()
        proxy = proxies.get(url.scheme) or proxies.get("all")
        if transport is not None or not proxy or proxy_bypass(url.netloc.decode("ascii")):
            return ""
        address = httpx.URL(proxy if "://" in proxy else f"http://{proxy}").netloc.decode("ascii")
        return f", asked by way of the proxy {address} that the environment names"


def _open(kind: Callable[..., T], base_url: Any, transport: Any) -> T:
    """Return an HTTP client; raises InvalidInput as above."""
    try:
        url = httpx.URL(base_url)
        is_address = url.scheme in ("http", "https") and bool(url.host)
    except (httpx.InvalidURL, TypeError, ValueError):
        is_address = False
    if not is_address:
        required = "the address of a server, such as http://127.0.0.1:8000"
        raise InvalidInput(("base_url",), required, show(base_url))
    try:
        return kind(base_url=base_url, transport=transport)
    except (httpx.InvalidURL, ImportError, OSError, ValueError) as error:
        required = "HTTP_PROXY, HTTPS_PROXY, ALL_PROXY, SSL_CERT_FILE that can be used, or none"
        raise InvalidInput(("environment",), required, show(f"{error}")) from error
