"""Whether compiled loops serve, and what compiles them: numba (extra ``fast``), which is loaded
only where the work is worth it.

Machine code is kept in the user's cache or in NUMBA_CACHE_DIR; ``python -m
veselova.analytic.compiled`` makes it ahead. Without numba, for few starts, and within a budget,
NumPy does all of it.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache, wraps
from pathlib import Path
from typing import Any, TypeAlias, TypeVar, cast

from veselova.mechanics.core.budget import has_budget
from veselova.mechanics.core.errors import BackendMissing
from veselova.mechanics.core.exact_input import require_truth_value
from veselova.mechanics.core.folders import account_folder, expand_home
from veselova.mechanics.core.installation import install_extra
from veselova.tunings import COMPILED_STARTS, LOADED_STARTS

__all__ = ["Record", "compiled", "compiled_loops", "compiling", "is_kept", "ready", "serving"]

F = TypeVar("F", bound=Callable[..., Any])

#: One record of a structured array: room for the numbers of one motion, which one argument passes.
Record: TypeAlias = Any

#: The module of the loops that are called first.
_LOOPS = "veselova.analytic.closed.motion"

#: What is asked for: True, False, or None for what pays.
_wanted: ContextVar[bool | None] = ContextVar("veselova_compiled", default=None)

_serving: ContextVar[bool] = ContextVar("veselova_serving", default=False)


@contextmanager
def serving(starts: int) -> Iterator[None]:
    """Let compiled loops serve in the block where so many starts are worth it, and no budget is in
    force. What was loaded before does not count: equal work has equal results.
    """
    wanted = _wanted.get()
    if wanted is None:
        worth = starts >= COMPILED_STARTS or (starts >= LOADED_STARTS and is_kept())
        wanted = worth and not has_budget()
    before = _serving.set(wanted and _load())
    try:
        yield
    finally:
        _serving.reset(before)


def _load() -> bool:
    """Load the loops; return False without numba."""
    if _LOOPS in sys.modules:
        return True
    if importlib.util.find_spec("numba") is None:
        return False
    importlib.import_module(_LOOPS)
    return True


def is_kept() -> bool:
    """Return whether there is machine code of the loops where it is looked for first."""
    folder = Path(_folder(os.environ.get("NUMBA_CACHE_DIR", "")))
    return any(folder.rglob("states._states-*.nbi"))


def ready() -> bool:
    """Return whether compiled loops serve the work at hand."""
    return _serving.get()


@contextmanager
def compiled_loops(wanted: bool = True) -> Iterator[None]:
    """Let compiled loops serve in the block, however few the starts are; with False, let none.

    They serve ``solve`` for systems ``veselova``, ``neumann``, ``ellipsoid-geodesic`` and bodies
    without area constant or potential, any n, up to some thousand times, where A's are within a
    factor of 10⁶ and no separatrix is near; with n > 4 for some thousand cycles. They serve
    ``FlowMap``, and ``solve_many`` for ``veselova`` with n = 2 to 4. NumPy does the rest.
    ``provenance.details`` of a trajectory then has ``compiled``. Both ways state an ``error`` above
    the true one, and differ by less than both errors together. A motion of few times takes a fifth
    of the time.

    The first block of a process loads numba (extra ``fast``), a second; the first of a version
    compiles for a minute, many starts for half a minute an n, unless ``python -m
    veselova.analytic.compiled`` has. Results
    depend on the block alone, not on what was loaded before. Raises InvalidInput unless ``wanted``
    is true or false, BackendMissing without numba.
    """
    require_truth_value(wanted, "wanted")
    if wanted and not _load():
        raise BackendMissing("numba", "veselova.compiled_loops", install_extra("fast"))
    before = _wanted.set(bool(wanted)), _serving.set(bool(wanted))
    try:
        yield
    finally:
        _serving.reset(before[1])
        _wanted.reset(before[0])


def compiled(*, fast: bool = False, inline: bool = False) -> Callable[[F], F]:
    """Return the decorator of a compiled loop. ``fast`` ones are sums in any order; ``inline`` ones
    return parts of arrays, and become part of what calls them.
    """
    import numba

    options: dict[str, Any] = {"error_model": "numpy", "nogil": True, "_nrt": False}
    if inline:
        options["inline"] = "always"
    if fast:
        options["fastmath"] = {"contract", "nsz", "reassoc"}

    @compiling
    def decorate(function: F) -> F:
        settings: Any = numba.config
        before = settings.CACHE_DIR
        settings.CACHE_DIR = _folder(before)
        try:
            return cast("F", numba.njit(cache=True, **options)(function))
        except RuntimeError:  # no folder to keep machine code in
            return cast("F", numba.njit(**options)(function))
        finally:
            settings.CACHE_DIR = before

    return decorate


def compiling(function: F) -> F:
    """Return the function with numba compiling inside, even where NUMBA_DISABLE_JIT is set."""
    import numba

    settings: Any = numba.config

    @wraps(function)
    def run(*arguments: Any) -> Any:
        if not settings.DISABLE_JIT:
            return function(*arguments)
        before, settings.DISABLE_JIT = settings.DISABLE_JIT, 0
        try:
            return function(*arguments)
        finally:
            settings.DISABLE_JIT = before

    return cast("F", run)


def _folder(chosen: str) -> str:
    """Return where machine code of these sources is kept: below NUMBA_CACHE_DIR, or the user's
    cache. Numba looks at the source of a function alone, and not at those of what it calls.
    """
    base = (
        expand_home(chosen, "NUMBA_CACHE_DIR")
        if chosen
        else account_folder("XDG_CACHE_HOME", ".cache")
    )
    return str(base / f"compiled-{_sources()}")


@cache
def _sources() -> str:
    """Return a digest of the sources that machine code is made from, and of their constants."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.parent.rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
