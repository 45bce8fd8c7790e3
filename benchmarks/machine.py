"""How fast is this machine?

    python benchmarks/machine.py

Prints a table in some ten seconds. Every line is one question, answered by the closed form and by
its peer in the same process; the other scripts here ask more.
"""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from typing import Any

import numpy as np
from heyoka_peer import HeyokaPeer
from numpy.typing import NDArray

from veselova.analytic.closed.many import tori
from veselova.engines import solve, torus
from veselova.mechanics.systems.veselova import Veselova
from veselova.version import __version__

Array = NDArray[np.float64]

#: What is looked up by name: the libraries that decide the figures.
_LIBRARIES = ("numpy", "scipy", "python-flint", "heyoka")

#: Times of the orbit, and how far it goes by either integrator: SciPy's takes a hundred times as
#: long as heyoka.
_TIMES = 100_000
_SPANS = {"heyoka": 1000.0, "dop853": 30.0}

_FAR = 1e6
_SHORT = np.linspace(0.2, 10.0, 50)
_TOGETHER = 2000
_SINGLE = 20

#: Calls of which the least time counts, where a call takes milliseconds.
_CALLS = 5


@dataclass(frozen=True)
class Measurement:
    """One question: what the closed form does, and its peer; processor seconds of each, or None;
    how far their answers differ.
    """

    question: str
    seconds: float
    peer: str
    peer_seconds: float
    difference: float

    @property
    def ratio(self) -> float:
        """Return how many times faster the closed form is."""
        return self.peer_seconds / self.seconds

    @property
    def row(self) -> str:
        """Return the line of the table."""
        ours = _show(self.seconds)
        theirs = _show(self.peer_seconds)
        return (
            f"| {self.question} | {ours} | {self.peer} | {theirs} | {self.ratio:.3g} | "
            f"{self.difference:.0e} |"
        )


def machine() -> dict[str, Any]:
    """Return what the figures depend on: versions, processors, system."""
    found: dict[str, Any] = {"veselova": __version__, "python": platform.python_version()}
    for name in _LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return {
        **found,
        "system": f"{platform.system()} {platform.machine()}",
        "processors": os.cpu_count(),
    }


def measurements() -> Iterator[Measurement]:
    """Yield the answers one by one.

    The integrator is heyoka where it is installed, called as its users call it; elsewhere it is
    SciPy's DOP853.
    """
    methods = ["heyoka", "dop853"] if find_spec("heyoka") else ["dop853"]
    method = methods[0]
    for n in (3, 4):  # imports and compilation are no part of any figure
        solve(_body(n, 1), _SHORT)
        for name in methods:
            _integrate(_body(n, 1), _SHORT, name)
    for n in (3, 4):
        yield _orbit(n, method)
    for n in (3, 4):
        yield _far(n, method)
    for name in methods:
        yield _short(4, name)
    for n in (3, 5):
        yield _tori(n)


def main() -> None:
    """Print the table line by line."""
    print(", ".join(f"{name} {value}" for name, value in machine().items()) + "\n")
    print("| question | closed form | peer | takes | ratio | difference |")
    print("|---|---|---|---|---|---|")
    for measurement in measurements():
        print(measurement.row)
    print(
        "\nProcessor time of one core, with the peer in the same process; a ratio above one: "
        "the closed form is faster."
    )


def _orbit(n: int, method: str) -> Measurement:
    times = np.linspace(0.0, _SPANS[method], _TIMES)
    seconds, closed = _time(lambda: solve(_body(n, 2), times))
    theirs, frames = _time(lambda: _integrate(_body(n, 2), times, method))
    question = f"n = {n}: {_TIMES} attitudes in [0, {times[-1]:g}]"
    return Measurement(
        question, seconds, f"integration ({method})", theirs, _largest(closed.frame - frames)
    )


def _far(n: int, method: str) -> Measurement:
    """Ask for one attitude far out, after others; integrating there is scaled up from a shorter
    stretch.
    """
    closed = solve(_body(n, 3), [_FAR])
    span = _SPANS[method]
    seconds, _ = _time(lambda: closed.at([_FAR - 1]))
    theirs, frames = _time(lambda: _integrate(_body(n, 3), np.array([span]), method))
    difference = _largest(closed.at([span]).frame - frames)
    question = f"n = {n}: one more attitude at t = {_FAR:.0e}"
    return Measurement(
        question,
        seconds,
        f"integration ({method}), from t = {span:g}",
        theirs * _FAR / span,
        difference,
    )


def _short(n: int, method: str) -> Measurement:
    seconds, closed = _time(lambda: solve(_body(n, 4), _SHORT), _CALLS)
    theirs, frames = _time(lambda: _integrate(_body(n, 4), _SHORT, method), _CALLS)
    question = f"n = {n}: a new body, {_SHORT.size} times in [0, {_SHORT[-1]:g}]"
    return Measurement(
        question, seconds, f"integration ({method})", theirs, _largest(closed.frame - frames)
    )


def _integrate(body: Veselova, times: Array, method: str) -> Array:
    """Return the frames by one integrator; DOP853 integrates twice, for its error."""
    return (
        HeyokaPeer(body)(times)[-1]
        if method == "heyoka"
        else solve(body, times, "numeric", method).frame
    )


def _tori(n: int) -> Measurement:
    rng = np.random.default_rng(n)
    A, q, q_dot = (
        np.exp(rng.uniform(0, np.log(5), (_TOGETHER, n))),
        *rng.normal(size=(2, _TOGETHER, n)),
    )
    tori(A[:_SINGLE], q[:_SINGLE], q_dot[:_SINGLE])
    together, found = _time(lambda: tori(A, q, q_dot))
    bodies = [
        Veselova(A[i], q[i], q_dot[i], normalize=True)
        for i in np.flatnonzero(found.known)[:_SINGLE]
    ]
    single, alone = _time(lambda: [torus(body) for body in bodies])
    expected = np.array([one.frequencies_t for one in alone])
    difference = _largest(found.frequencies_t[found.known][:_SINGLE] / expected - 1)
    question = f"n = {n}: a torus, {_TOGETHER} together"
    return Measurement(
        question, together / _TOGETHER, "one by one", single / len(bodies), difference
    )


def _body(n: int, seed: int) -> Veselova:
    """Return a body that no other call has seen, with A's within a factor of five and unit speed; a
    seed gives one motion.
    """
    rng = np.random.default_rng([n, seed])
    A, q, q_dot = np.exp(rng.uniform(0, np.log(5), n)), *rng.normal(size=(2, n))
    q /= np.linalg.norm(q)
    q_dot -= (q_dot @ q) * q
    return Veselova(A, q, q_dot / np.linalg.norm(q_dot), normalize=True)


def _time(call: Callable[[], Any], calls: int = 1) -> tuple[float, Any]:
    """Return the least processor seconds of some calls, and the last answer."""
    least = np.inf
    for _ in range(calls):
        began = time.process_time()
        answer = call()
        least = min(least, time.process_time() - began)
    return max(least, 1e-6), answer


def _largest(values: Any) -> float:
    return float(np.max(np.abs(values)))


def _show(seconds: float) -> str:
    """Return a duration in the unit that suits it."""
    for unit, size in (("s", 1.0), ("ms", 1e-3)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds * 1e6:.3g} µs"


if __name__ == "__main__":
    main()
