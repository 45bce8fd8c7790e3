"""Who asks, and so whose jobs a request may see."""

from __future__ import annotations

from collections.abc import Mapping, MutableMapping
from dataclasses import dataclass
from typing import Any

#: What a key allows, each all of those before it: to read, to have work done and ended, to see what
#: all do.
READ, SOLVE, ADMIN = SCOPES = ("read", "solve", "admin")

#: Where the scope of an ASGI request has its caller.
_PLACE = "veselova.caller"


@dataclass(frozen=True)
class Caller:
    """Who asks: ``owner`` has jobs, and is empty where no key is shown."""

    owner: str = ""
    scope: str = SOLVE

    def may(self, scope: str) -> bool:
        """Return whether the caller's key allows what a scope stands for."""
        return SCOPES.index(self.scope) >= SCOPES.index(scope)

    @property
    def seen(self) -> str | None:
        """Return the owner whose jobs the caller may name, None for those of all."""
        return None if self.may(ADMIN) else self.owner


#: Whoever shows no key, where none is asked for.
ANONYMOUS = Caller()


def put_caller(scope: MutableMapping[str, Any], caller: Caller) -> None:
    """Say who makes a request."""
    scope[_PLACE] = caller


def caller_of(scope: Mapping[str, Any]) -> Caller:
    """Return who makes a request; ``scope`` is that of ASGI, or a request."""
    caller: Caller = scope.get(_PLACE, ANONYMOUS)
    return caller
