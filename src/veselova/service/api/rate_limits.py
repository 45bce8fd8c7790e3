"""How often one caller may ask: fixed windows counted in memory, per API key or per address."""

from __future__ import annotations

import ipaddress
import math
import time
from dataclasses import dataclass
from functools import lru_cache

from limits import RateLimitItem, parse
from limits.aio.storage import MemoryStorage
from limits.aio.strategies import FixedWindowRateLimiter

__all__ = ["Allowance", "RateLimit", "network_of", "rate_of"]

#: One subscriber of IPv6 has at least a network of this length, and may take a new address in it
#: for every request.
_IPV6_PREFIX = 64

#: Callers counted by themselves in one window; others share one count. Every request looks through
#: all of them for those whose window has ended: 0.7 ms at this number.
_MOST_CALLERS = 10_000

#: Seconds by which a clock may be set back without anyone being counted anew.
_STEP_S = 1.0


@dataclass(frozen=True)
class Allowance:
    """What a caller has left in the current window: requests, and the whole seconds until the
    window ends.
    """

    quota: int
    window_s: int
    left: int
    reset_s: int
    granted: bool

    @property
    def headers(self) -> dict[str, str]:
        """Return the fields RateLimit-Policy and RateLimit
        (draft-ietf-httpapi-ratelimit-headers).
        """
        return {
            "RateLimit-Policy": f'"default";q={self.quota};w={self.window_s}',
            "RateLimit": f'"default";r={self.left};t={self.reset_s}',
        }


class RateLimit:
    """A limit such as 120/minute, counted for every caller by itself.

    A fixed window costs one counter for each caller, and its end is known exactly; around it a
    caller may spend two quotas.
    """

    def __init__(self, item: RateLimitItem) -> None:
        self._item = item
        self._storage = MemoryStorage()
        self._limiter = FixedWindowRateLimiter(self._storage)

    async def spend(self, caller: str) -> Allowance:
        """Count one request of a caller, and return what is left."""
        counted = await self._count(caller)
        return await self._allowance(counted, await self._limiter.hit(self._item, counted))

    async def look(self, caller: str) -> Allowance:
        """Return what is left without counting; ``granted`` says whether one more would be."""
        counted = await self._count(caller)
        return await self._allowance(counted, await self._limiter.test(self._item, counted))

    async def _count(self, caller: str) -> str:
        """Return who is counted for a caller. A window that ends later than a new one would is that
        of a clock which was set back meanwhile, and is over.
        """
        known = self._storage.expirations
        if len(known) >= _MOST_CALLERS and self._item.key_for(caller) not in known:
            caller = "everyone else"
        name = self._item.key_for(caller)
        if known.get(name, 0.0) > time.time() + self._item.get_expiry() + _STEP_S:
            await self._storage.clear(name)
        return caller

    async def _allowance(self, caller: str, granted: bool) -> Allowance:
        end, left = await self._limiter.get_window_stats(self._item, caller)
        reset = max(1, math.ceil(end - time.time()))
        return Allowance(self._item.amount, self._item.get_expiry(), max(0, left), reset, granted)


def rate_of(text: str) -> RateLimit | None:
    """Return the limit that a text states, None for ``none``; raises ValueError for a text that
    states no limit.
    """
    if text == "none":
        return None
    try:
        item = parse(text)
    except ValueError:
        item = None
    if item is None or item.amount < 1 or ";" in text or "," in text:
        raise ValueError(
            "required requests per second, minute, hour or day, such as 120/minute, or none"
        )
    return RateLimit(item)


@lru_cache(_MOST_CALLERS)
def network_of(host: str | None) -> str:
    """Return the network that an address is counted with: itself, or its /64 in IPv6."""
    try:
        address = ipaddress.ip_address(host or "")
    except ValueError:
        return "unknown"  # a socket of the file system has no address
    if isinstance(address, ipaddress.IPv6Address):
        if address.ipv4_mapped is not None:
            return str(address.ipv4_mapped)
        return str(ipaddress.ip_network((int(address), _IPV6_PREFIX), strict=False))
    return str(address)
