"""Who asks, and so whose jobs a request may see."""

from __future__ import annotations

from dataclasses import dataclass

#: What a key allows, each all of those before it: to read, to have work done and ended, to see what
#: all do.
READ, SOLVE, ADMIN = SCOPES = ("read", "solve", "admin")


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
