"""Arguments of a client: its address, its key and its connections, checked before anything is
sent.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, TypeVar

import httpx2 as httpx

from veselova.mechanics.core.errors import InvalidInput, show

__all__ = ["credentials", "open_connection"]

T = TypeVar("T")


def credentials(api_key: Any) -> dict[str, str]:
    """Return the header that shows a key; none for an empty one. The refusal does not quote what
    may be a secret.
    """
    if not isinstance(api_key, str) or not re.fullmatch(r"[\x21-\x7e]*", api_key):
        given = "other characters" if isinstance(api_key, str) else type(api_key).__name__
        raise InvalidInput(("api_key",), "a key of the server (printable ASCII, no spaces)", given)
    return {"authorization": f"Bearer {api_key}"} if api_key else {}


def open_connection(kind: Callable[..., T], base_url: Any, transport: Any) -> T:
    """Return an HTTP client of a kind; raises InvalidInput for an address that is none, and for
    proxies or certificates of the environment that cannot be used.
    """
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
