"""Limits on the time of a computation, and its progress as a line on standard error.

Long loops call ``checkpoint``. Whoever asked for the result learns from it how far the work has
come, and stops it there when the budget is used up. Nothing is interrupted between two
checkpoints, so no lock, no precision and no cache is left half made. Limits belong to one thread
and its context. They nest, and the earliest deadline holds.
"""

from __future__ import annotations

import math
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from numbers import Real
from typing import Any, TypeAlias, TypeVar

from veselova.mechanics.core.errors import InvalidInput, OverBudget, show

__all__ = [
    "Progress",
    "ProgressLine",
    "Report",
    "acquire",
    "checkpoint",
    "has_budget",
    "has_reader",
    "iterate",
    "limits",
    "reporting",
    "stated_s",
]

#: Called with the name of a step, what is done of it, and the whole of it.
Report: TypeAlias = Callable[[str, float, float], object]

#: Seconds of work before the line appears.
_PATIENCE_S = 1.0

#: Characters of the bar.
_WIDTH = 24


def has_reader() -> bool:
    """Return whether a person reads standard error: terminal or notebook, main thread."""
    stream = sys.stderr
    if stream is None or threading.current_thread() is not threading.main_thread():
        return False
    if type(stream).__module__.startswith("ipykernel."):
        return True
    try:
        return stream.isatty()
    except ValueError:  # a closed stream
        return False


class ProgressLine:
    """One line on standard error, which appears after a second of work and is removed at the end.

    It is written again from a carriage return on, which terminals and notebooks both understand.
    """

    def __init__(self) -> None:
        self._stream: Any = sys.stderr
        self._began, self._length = time.monotonic(), 0

    def __call__(self, step: str, done: float, total: float) -> None:
        """Show how much of a step is done."""
        passed = time.monotonic() - self._began
        if passed < _PATIENCE_S or self._stream is None:
            return
        part = min(max(done / total, 0.0), 1.0)
        bar = ("#" * round(_WIDTH * part)).ljust(_WIDTH, ".")
        self._write(f"veselova: {step or 'work'} [{bar}] {100 * part:3.0f} %, {passed:.0f} s")

    def close(self) -> None:
        """Remove the line."""
        if self._length:
            self._write("")
            self._length = 0

    def _write(self, text: str) -> None:
        """Write a text over the line; a stream that is gone has no line any more."""
        try:
            self._stream.write("\r" + text.ljust(self._length) + "\r" * (not text))
            self._stream.flush()
        except (OSError, ValueError):
            self._stream = None
        self._length = len(text)


T = TypeVar("T")

#: Whether progress is shown (None: where a person reads it), or who is called with (done, total).
Progress: TypeAlias = bool | Callable[[float, float], object] | None

#: Seconds between two reports of progress.
_REPORT_S = 0.1


class _Limits:
    """The limits in force: a deadline, the budget that ends there, and who hears of progress."""

    def __init__(self, deadline: float, budget_s: float, report: Report | None) -> None:
        self.deadline, self.budget_s, self.report = deadline, budget_s, report
        self._next = 0.0

    def check(self, step: str, done: float, total: float) -> None:
        """Raise OverBudget after the deadline; report what is done a few times a second."""
        now = time.monotonic()
        if now > self.deadline:
            raise OverBudget(self.budget_s)
        if self.report is not None and total > 0 and now >= self._next:
            self._next = now + _REPORT_S
            self.report(step, done, total)


_in_force: ContextVar[_Limits | None] = ContextVar("veselova_limits", default=None)


def checkpoint(step: str = "", done: float = 0.0, total: float = 0.0) -> None:
    """Stop here when the budget is used up, and report that so much of a step is done.

    Without limits in force this takes a tenth of a microsecond. Raises OverBudget.
    """
    in_force = _in_force.get()
    if in_force is not None:
        in_force.check(step, done, total)


def iterate(items: Sequence[T], step: str = "") -> Iterator[T]:
    """Yield the items of a sequence, with a checkpoint before each. Raises OverBudget."""
    total = len(items)
    for done, item in enumerate(items):
        checkpoint(step, done, total)
        yield item


def has_budget() -> bool:
    """Return whether a budget is in force."""
    return stated_s() < math.inf


def stated_s() -> float:
    """Return the seconds of the budget in force, infinite where there is none."""
    in_force = _in_force.get()
    return math.inf if in_force is None else in_force.budget_s


def acquire(lock: threading.RLock) -> None:
    """Acquire a lock, waiting no longer than the budget lasts. Raises OverBudget."""
    in_force = _in_force.get()
    if in_force is None or not has_budget():
        lock.acquire()
    elif not lock.acquire(timeout=max(0.0, in_force.deadline - time.monotonic())):
        raise OverBudget(in_force.budget_s)


@contextmanager
def limits(budget_s: float | None = None, progress: Progress = False) -> Iterator[None]:
    """Stop the work in the block after so many seconds, and report its progress.

    ``budget_s``: seconds above zero, None for no limit. ``progress``: False for none, True for a
    line on standard error, None for that line where a person reads it, or a function of (done,
    total). Within other limits their deadline holds too, and None leaves progress to them.
    Raises InvalidInput for other values, OverBudget when the budget is used up.
    """
    seconds = math.inf if budget_s is None else _seconds(budget_s)
    outer = _in_force.get()
    with reporting(progress) as report:
        inner = _Limits(time.monotonic() + seconds, seconds, report)
        if outer is not None and outer.deadline < inner.deadline:
            inner.deadline = outer.deadline
            inner.budget_s = outer.budget_s
        before = _in_force.set(inner)
        try:
            yield
        finally:
            _in_force.reset(before)


@contextmanager
def reporting(progress: Progress = None) -> Iterator[Report | None]:
    """Give who hears of progress, None where nobody does; see ``limits``. Raises InvalidInput."""
    outer = _in_force.get()
    if progress is None and outer is not None:
        yield outer.report
    elif progress is True or (progress is None and has_reader()):
        line = ProgressLine()
        try:
            yield line
        finally:
            line.close()
    elif progress is None or progress is False:
        yield None
    elif callable(progress):
        yield lambda _, done, total: progress(done, total)
    else:
        required = "True, False, None or a function of (done, total)"
        raise InvalidInput(("progress",), required, show(progress))


def _seconds(budget_s: Any) -> float:
    """Return a budget in seconds; raises InvalidInput."""
    is_number = isinstance(budget_s, Real) and not isinstance(budget_s, bool)
    if is_number and 0 < budget_s < math.inf:
        return float(min(budget_s, threading.TIMEOUT_MAX))
    raise InvalidInput(("budget_s",), "a finite number of seconds above 0, or None", show(budget_s))
