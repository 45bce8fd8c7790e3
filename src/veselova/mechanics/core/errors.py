"""The exceptions of veselova, one tree for every door (Python, command line, HTTP).

VeselovaError
├── InvalidInput            bad input; names the field, what was required, what was given   (also a
    ValueError)
│   └── InvalidRequest      several such faults at once
├── Unsolved                an engine's named outcome: it cannot serve this problem, and why
├── OverBudget              the work takes longer than its budget              (also a TimeoutError)
├── BackendMissing          an optional library that was asked for is not installed          (also
    an ImportError)
├── InternalContradiction   two results that must agree do not: a bug of ours
└── ServiceError            what the HTTP client raises
    ├── ServiceUnreachable  no answer from the server after all retries
    └── ProblemResponse     the server answered with a problem document, carried along
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from reprlib import Repr
from typing import Any, TypeVar, cast

__all__ = [
    "MOST_FAULTS",
    "BackendMissing",
    "Faults",
    "InternalContradiction",
    "InvalidInput",
    "InvalidRequest",
    "OverBudget",
    "ProblemResponse",
    "ServiceError",
    "ServiceUnreachable",
    "Unsolved",
    "VeselovaError",
    "did_you_mean",
    "field_faults",
    "install_extra",
    "needs",
    "select_faults",
    "show",
    "summary",
    "unknown_name",
]

#: Longest rendering of a given value in a message: enough to recognise it, short enough for one
#: line.
_SHOWN_CHARACTERS = 60

#: Faults of one request that are reported, and those that its message spells out.
MOST_FAULTS = 100
_SPELLED_OUT = 10

#: A name in a path is quoted up to here.
_LONGEST_NAME = 100

T = TypeVar("T")

#: Texts besides numerals that are shown in quotes.
_QUOTED = ("", "None", "True", "False")


def show(value: object) -> str:
    """Return a one-line rendering of a given value for an error message, shortened when long."""
    if isinstance(value, str):
        value = value[: 2 * _SHOWN_CHARACTERS]
    try:
        bare = isinstance(value, (Fraction, Decimal)) or (
            isinstance(value, str) and not _reads_otherwise(value)
        )
        text = str(value) if bare else _SHORT.repr(value)
    except ValueError:  # an int of more digits than Python is willing to print
        text = (
            f"an integer of about {value.bit_length() * 0.30103:.0f} digits"
            if isinstance(value, int)
            else "a value"
        )
    text = " ".join(_writable(text).split())
    return text if len(text) <= _SHOWN_CHARACTERS else text[: _SHOWN_CHARACTERS - 1] + "…"


#: ``repr`` of no more than the beginning of a value: what was given may be as large as a request.
_SHORT = Repr()
_SHORT.maxlevel, _SHORT.maxlong = 10, 5000
_SHORT.maxstring = _SHORT.maxother = 4 * _SHOWN_CHARACTERS
for _kind in ("list", "tuple", "dict", "set", "array"):
    setattr(_SHORT, f"max{_kind}", _SHOWN_CHARACTERS)
for _kind in ("Fraction", "Decimal"):
    setattr(_SHORT, f"repr_{_kind}", lambda value, level: str(value))


def _writable(text: str) -> str:
    """Return a text that UTF-8 can hold: lone surrogates, which JSON strings can carry, are spelled
    out.
    """
    return text.encode("utf-8", "backslashreplace").decode("utf-8")


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
        # Errors cross process borders (workers), and constructors take keywords: rebuild from the
        # state alone.
        return (_rebuild, (type(self), self.args, self.__dict__.copy()))


def _rebuild(
    kind: type[VeselovaError], args: tuple[Any, ...], state: dict[str, Any]
) -> VeselovaError:
    error = kind.__new__(kind, *args)
    error.args = args
    error.__dict__.update(state)
    return error


class InvalidInput(VeselovaError, ValueError):
    """Bad input: which field, what was required, what was given.

    ``path`` locates the value, e.g. ``("A", 1)``; ``field`` is its readable form ``A[1]``.
    ``further``: how many faults there are besides those of ``faults``.
    """

    further = 0

    def __init__(self, path: Sequence[str | int], required: str, given: str) -> None:
        self.path = tuple(
            _writable(part[:_LONGEST_NAME]) if isinstance(part, str) else part for part in path
        )
        self.required = _writable(required)
        self.given = _writable(given)
        super().__init__(f"{self.field}: required {self.required}; given {self.given}.")

    @property
    def faults(self) -> tuple[InvalidInput, ...]:
        """Return the faults that were found: this one, or all of an InvalidRequest."""
        return (self,)

    @property
    def field(self) -> str:
        """Return the field in the notation of its Python argument, e.g. ``frame[0][2]``."""
        head, *rest = self.path or ("the request",)
        return str(head) + "".join(
            f"[{part}]" if isinstance(part, int) else f".{part}" for part in rest
        )

    def below(self, *parents: str | int) -> InvalidInput:
        """Return the same error, located inside the given parents (``problem``, say)."""
        return InvalidInput((*parents, *self.path), self.required, self.given)


class InvalidRequest(InvalidInput):
    """Several faults at once, each an InvalidInput; path, required and given are those of the
    first.

    ``faults`` has the first MOST_FAULTS of them, and ``further`` says how many there are besides.
    """

    def __init__(self, faults: Sequence[InvalidInput], further: int = 0) -> None:
        found = [single for fault in faults for single in fault.faults]
        self._faults = tuple(found[:MOST_FAULTS])
        self.further = (
            further + len(found) - len(self._faults) + sum(fault.further for fault in faults)
        )
        first = self._faults[0]
        super().__init__(first.path, first.required, first.given)
        self.args = (summary(self._faults, self.further),)

    @property
    def faults(self) -> tuple[InvalidInput, ...]:
        """Return the faults that were found, MOST_FAULTS of them at most."""
        return self._faults

    def below(self, *parents: str | int) -> InvalidInput:
        """Return the same faults, located inside the given parents."""
        return InvalidRequest([fault.below(*parents) for fault in self._faults], self.further)


def select_faults(
    faults: Iterable[InvalidInput], keep: Callable[[InvalidInput], bool]
) -> list[InvalidInput]:
    """Return the faults that are to be kept. Those which are only counted stay with the ones that
    came with them.
    """
    return [
        InvalidRequest(chosen, fault.further)
        for fault in faults
        if (chosen := [single for single in fault.faults if keep(single)])
    ]


def summary(faults: Sequence[InvalidInput], further: int = 0) -> str:
    """Return the first faults in words, and how many there are besides them and
    ``further`` ones.
    """
    unsaid = len(faults[_SPELLED_OUT:]) + further
    return " ".join(map(str, faults[:_SPELLED_OUT])) + (f" And {unsaid} more." if unsaid else "")


def did_you_mean(given: object, names: Iterable[str]) -> str:
    """Return " (did you mean …?)" with the name that is most like a given one, whatever their case,
    or nothing.
    """
    from difflib import get_close_matches

    known = {name.casefold(): name for name in names}
    # Comparing takes the product of the lengths; a longer text is no name.
    close = (
        get_close_matches(given.casefold(), known, 1)
        if isinstance(given, str) and len(given) <= _LONGEST_NAME
        else []
    )
    return f" (did you mean {known[close[0]]}?)" if close else ""


def unknown_name(
    path: Sequence[str | int], given: object, names: Sequence[str], scope: str = ""
) -> InvalidInput:
    """Return the fault of a name that is none of those known, which are known in a scope such as
    "for system lr".
    """
    required = " ".join(filter(None, (f"one of {', '.join(names)}", scope)))
    return InvalidInput(path, required, show(given) + did_you_mean(given, names))


def field_faults(
    path: Sequence[str | int],
    given: Iterable[object],
    names: Sequence[str],
    needed: Sequence[str] = (),
) -> list[InvalidInput]:
    """Return the faults of the fields that an object has at a place, one for each: of those that
    are none of the names, and of those needed that it has not.
    """
    known = set(given)
    unknown = [
        InvalidInput(
            (*path, name if isinstance(name, str) else show(name)),
            f"no field but {', '.join(names)}",
            f"the field {show(name)}" + (did_you_mean(name, names) if i < MOST_FAULTS else ""),
        )
        for i, name in enumerate(name for name in given if name not in names)
    ]
    missing = [name for name in needed if name not in known]
    return unknown + [InvalidInput((*path, name), "this field", "nothing") for name in missing]


class Faults:
    """Collects the faults of parts that are validated one by one, so that all are reported at once.
    Beyond the first MOST_FAULTS they are only counted, in ``further``.
    """

    def __init__(self) -> None:
        self.found: list[InvalidInput] = []
        self.further = 0

    def attempt(self, call: Callable[..., T], *arguments: Any, **options: Any) -> T:
        """Return what a call gives. Where it raises InvalidInput its faults are kept, and the value
        is None, which ``require_none`` keeps from being used.
        """
        try:
            return call(*arguments, **options)
        except InvalidInput as error:
            if len(self.found) >= MOST_FAULTS:
                self.further += len(error.faults) + error.further
            else:
                # where it was raised no message says, and a hundred thousand frames are slow to
                # keep
                error.__context__ = None
                self.found.append(error.with_traceback(None))
            return cast("T", None)

    def add(self, path: Sequence[str | int], required: str, given: str) -> None:
        """Note a fault."""
        if len(self.found) >= MOST_FAULTS:
            self.further += 1
        else:
            self.found.append(InvalidInput(path, required, given))

    def require_none(self) -> None:
        """Raise InvalidInput for one fault, InvalidRequest for several."""
        if len(self.found) == 1:
            raise self.found[0]
        if self.found:
            raise InvalidRequest(self.found, self.further)


class Unsolved(VeselovaError):
    """A named outcome: the engine cannot serve this problem, with the reason and what to do
    instead.
    """

    def __init__(self, outcome: str, reason: str) -> None:
        self.outcome = outcome
        self.reason = reason
        super().__init__(f"{outcome}: {reason}")


class OverBudget(VeselovaError, TimeoutError):
    """The work was stopped when its budget was used up, or not begun where it would take longer.

    ``budget_s``: the budget in seconds. ``estimate_s``: about what the work would take, None where
    it was begun.
    """

    def __init__(self, budget_s: float, estimate_s: float | None = None, remedy: str = "") -> None:
        self.budget_s, self.estimate_s = budget_s, estimate_s
        message = f"the work was stopped after its budget of {budget_s:g} s"
        if estimate_s is not None:
            seconds = f"{float(f'{estimate_s:.2g}'):g}" if estimate_s < 1e5 else f"{estimate_s:.2g}"
            work = f"about {seconds} s of work, as estimated"
            message = f"{work}, for a budget of {budget_s:g} s"
        super().__init__(message + remedy)


class BackendMissing(VeselovaError, ImportError):
    """An optional library that was asked for is not installed; ``install`` is the command that
    installs it.
    """

    def __init__(self, library: str, purpose: str, install: str) -> None:
        self.library = library
        super().__init__(
            f"{purpose} needs {library}, which is not installed; install it with: {install}"
        )


@contextmanager
def needs(library: str, purpose: str, install: str = "") -> Iterator[None]:
    """Raise BackendMissing where the block imports a library that is not installed."""
    try:
        yield
    except ImportError as error:
        way = install or f"pip install {library}"
        raise BackendMissing(error.name or library, purpose, way) from None


class InternalContradiction(VeselovaError):
    """Two results that must agree do not: a bug of veselova, never of the input."""

    def __init__(self, what: str) -> None:
        super().__init__(
            f"internal contradiction ({what}); this is a bug in veselova, please report the "
            "input with it"
        )


class ServiceError(VeselovaError):
    """What the HTTP client raises."""


class ServiceUnreachable(ServiceError):
    """The server could not be reached, or did not answer, after all retries."""


class ProblemResponse(ServiceError):
    """The server answered with an RFC 9457 problem document, kept in ``document``.

    ``retry_after``: seconds after which it asks to try again, None where it does not.
    """

    def __init__(
        self, status: int, document: Mapping[str, Any], retry_after: float | None = None
    ) -> None:
        self.status = status
        self.document = dict(document)
        self.retry_after = retry_after
        detail = self.document.get("detail") or self.document.get("title") or "no detail given"
        super().__init__(f"HTTP {status}: {detail}")


def install_extra(extra: str) -> str:
    """Return the command that installs an extra: from the folder of the source where that is what
    runs, else by the name of the package.
    """
    source = Path(__file__).resolve().parents[4]
    package = source if (source / "pyproject.toml").is_file() else "veselova"
    return f"pip install '{package}[{extra}]'"
