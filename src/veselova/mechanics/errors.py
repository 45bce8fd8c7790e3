"""The exceptions of veselova, one tree for every door (Python, command line, HTTP).

VeselovaError
├── InvalidInput            bad input; names the field, what was required, what was given   (also a ValueError)
├── InvalidRequest          a JSON request with one or more such faults                     (also a ValueError)
├── Unsolved                an engine's named outcome: it cannot serve this problem, and why
├── BackendMissing          an optional library that was asked for is not installed          (also an ImportError)
├── InternalContradiction   two results that must agree do not: a bug of ours
└── ServiceError            what the HTTP client raises
    ├── ServiceUnreachable  no answer from the server after all retries
    └── ProblemResponse     the server answered with a problem document, carried along
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from decimal import Decimal
from fractions import Fraction
from typing import Any

__all__ = [
    "BackendMissing",
    "InternalContradiction",
    "InvalidInput",
    "InvalidRequest",
    "ProblemResponse",
    "ServiceError",
    "ServiceUnreachable",
    "Unsolved",
    "VeselovaError",
    "shown",
]

#: Longest rendering of a given value in a message: enough to recognise it, short enough for one line.
_SHOWN_CHARACTERS = 60

#: Texts besides numerals that are shown in quotes.
_QUOTED = ("", "None", "True", "False")


def shown(value: object) -> str:
    """Return a one-line rendering of a given value for an error message, shortened when long."""
    try:
        bare = isinstance(value, (Fraction, Decimal)) or (isinstance(value, str) and not _reads_otherwise(value))
        text = str(value) if bare else repr(value)
    except ValueError:  # an int of more digits than Python is willing to print
        text = f"an integer of about {value.bit_length() * 0.30103:.0f} digits" if isinstance(value, int) else "a value"
    # Lone surrogates, which JSON strings can carry, cannot be written as UTF-8.
    text = " ".join(text.encode("utf-8", "backslashreplace").decode("utf-8").split())
    return text if len(text) <= _SHOWN_CHARACTERS else text[: _SHOWN_CHARACTERS - 1] + "…"


def _reads_otherwise(text: str) -> bool:
    """Return whether a text without quotes reads as nothing, or as another value."""
    try:
        float(text)
    except ValueError:
        return text.strip() in _QUOTED
    return True


class VeselovaError(Exception):
    """The root of every exception that veselova raises on purpose."""

    def __reduce__(self) -> tuple[Any, ...]:
        # Errors cross process borders (workers), and constructors take keywords: rebuild from the state alone.
        return (_rebuilt, (type(self), self.args, self.__dict__.copy()))


def _rebuilt(kind: type[VeselovaError], args: tuple[Any, ...], state: dict[str, Any]) -> VeselovaError:
    error = kind.__new__(kind, *args)
    error.args = args
    error.__dict__.update(state)
    return error


class InvalidInput(VeselovaError, ValueError):
    """Bad input: which field, what was required, what was given.

    ``path`` locates the value, e.g. ``("A", 1)``; ``field`` is its readable form ``A[1]``.
    """

    def __init__(self, path: Sequence[str | int], required: str, given: str) -> None:
        self.path = tuple(path)
        self.required = required
        self.given = given
        super().__init__(f"{self.field}: required {required}; given {given}.")

    @property
    def field(self) -> str:
        """Return the field in the notation of its Python argument, e.g. ``frame[0][2]``."""
        head, *rest = self.path or ("the request",)
        return str(head) + "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in rest)

    def below(self, *parents: str | int) -> InvalidInput:
        """Return the same error, located inside the given parents (``problem``, say)."""
        return InvalidInput((*parents, *self.path), self.required, self.given)


class InvalidRequest(VeselovaError, ValueError):
    """A JSON request with faults, each an InvalidInput whose path starts at the request's root."""

    def __init__(self, faults: Sequence[InvalidInput]) -> None:
        self.faults = tuple(faults)
        super().__init__(" ".join(str(fault) for fault in self.faults))


class Unsolved(VeselovaError):
    """A named outcome: the engine cannot serve this problem, with the reason and what to do instead."""

    def __init__(self, outcome: str, reason: str) -> None:
        self.outcome = outcome
        self.reason = reason
        super().__init__(f"{outcome}: {reason}")


class BackendMissing(VeselovaError, ImportError):
    """An optional library that was asked for is not installed."""

    def __init__(self, library: str, purpose: str, install: str) -> None:
        self.library = library
        super().__init__(f"{purpose} needs {library}, which is not installed; install it with: {install}")


class InternalContradiction(VeselovaError):
    """Two results that must agree do not: a bug of veselova, never of the input."""

    def __init__(self, what: str) -> None:
        super().__init__(f"internal contradiction ({what}); this is a bug in veselova, please report the input with it")


class ServiceError(VeselovaError):
    """What the HTTP client raises."""


class ServiceUnreachable(ServiceError):
    """The server could not be reached, or did not answer, after all retries."""


class ProblemResponse(ServiceError):
    """The server answered with an RFC 9457 problem document, kept in ``document``."""

    def __init__(self, status: int, document: Mapping[str, Any]) -> None:
        self.status = status
        self.document = dict(document)
        detail = self.document.get("detail") or self.document.get("title") or "no detail given"
        super().__init__(f"HTTP {status}: {detail}")
