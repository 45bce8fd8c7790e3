"""How many connections a server has: in all, and of one address."""

from __future__ import annotations

import asyncio
import errno
import logging
import time
from collections import Counter
from typing import Any

from veselova.service.api.problem_details import Refused
from veselova.service.api.rate_limits import network_of
from veselova.service.api.settings import Settings

__all__ = ["Connections", "report_exhaustion", "use_all_descriptors"]

_LOG = logging.getLogger("veselova.service")

#: Descriptors of a server besides its connections: database, pipes of workers, files of answers.
_OTHER_DESCRIPTORS = 64

#: Connections that a server takes, whatever its limit of descriptors.
_FEWEST = 8

#: Seconds in which one line is logged of descriptors that have run out.
_QUIET_S = 60.0

_EXHAUSTED = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)


class Connections:
    """The connections of one server, by address; in IPv6 by its /64 network."""

    def __init__(self, settings: Settings) -> None:
        self._most = min(
            settings.max_connections, max(_FEWEST, _descriptors() - _OTHER_DESCRIPTORS)
        )
        self._most_of_one = settings.max_connections_per_address
        self._of: Counter[str] = Counter()
        self._total = 0

    def enter(self, address: str | None) -> None:
        """Count a connection; raises Refused (``too-many-connections``) beyond a limit, and counts
        nothing then.
        """
        network = network_of(address)
        if self._total >= self._most:
            raise Refused(
                "too-many-connections",
                f"The server has {self._most} connections, the most it takes.",
                retry_after=5,
            )
        if self._most_of_one and self._of[network] >= self._most_of_one:
            detail = (
                f"This address has {self._most_of_one} connections, the most that one may have."
            )
            raise Refused("too-many-connections", detail, retry_after=5)
        self._total += 1
        self._of[network] += 1

    def leave(self, address: str | None) -> None:
        """Count a connection no more."""
        network = network_of(address)
        self._total -= 1
        self._of[network] -= 1
        if not self._of[network]:
            del self._of[network]


def _descriptors() -> int:
    try:
        import resource
    except ImportError:  # not a POSIX system
        return 1 << 20
    soft = resource.getrlimit(resource.RLIMIT_NOFILE)[0]
    return 1 << 20 if soft == resource.RLIM_INFINITY else soft


def use_all_descriptors() -> None:
    """Raise this process's limit of descriptors to the most that it may have."""
    try:
        import resource
    except ImportError:
        return
    hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    try:
        resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    except (OSError, ValueError) as error:
        _LOG.debug("the limit of descriptors stays: %s", error)


def report_exhaustion() -> None:
    """Log once a minute, for the running event loop, that no descriptor is left for a connection.

    asyncio itself logs a traceback for each of its tries, which are hundreds a second.
    """
    loop = asyncio.get_running_loop()
    reported = -_QUIET_S

    def report(_: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        nonlocal reported
        error = context.get("exception")
        if (
            not isinstance(error, OSError)
            or error.errno not in _EXHAUSTED
            or "socket" not in context
        ):
            loop.default_exception_handler(context)
        elif time.monotonic() - reported >= _QUIET_S:
            reported = time.monotonic()
            _LOG.error(
                "connections wait to be accepted: %s (a process may have %d descriptors)",
                error.strerror,
                _descriptors(),
            )

    loop.set_exception_handler(report)
