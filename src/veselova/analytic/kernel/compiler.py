"""What compiles the text, and where machine code is kept: below NUMBA_CACHE_DIR, or the user's
cache.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

__all__ = ["is_kept", "jit", "jit_sum"]

F = TypeVar("F", bound=Callable[..., Any])


def jit(function: F) -> F:
    """Return the function, compiled at its first call, without the interpreter's lock."""
    return _compile(function, False)


def jit_sum(function: F) -> F:
    """Return a compiled sum that may add its terms in any order."""
    return _compile(function, {"contract", "nsz", "reassoc"})


def is_kept(module: str, name: str) -> bool:
    """Return whether machine code of a function is where it is looked for first."""
    folder = Path(_folder(os.environ.get("NUMBA_CACHE_DIR", "")))
    return any(folder.rglob(f"{module}.{name}-*.nbi"))


def _compile(function: F, fastmath: Any) -> F:
    try:
        import numba
    except ImportError:  # the interpreter alone runs the text
        return function
    options = {"error_model": "numpy", "nogil": True, "fastmath": fastmath}
    settings: Any = numba.config
    before = settings.CACHE_DIR
    settings.CACHE_DIR = _folder(before)
    try:
        return cast("F", numba.njit(cache=True, **options)(function))
    except RuntimeError:  # no folder to keep machine code in
        return cast("F", numba.njit(**options)(function))
    finally:
        settings.CACHE_DIR = before


def _folder(chosen: str) -> str:
    """Return the folder of this text: numba looks at the source of a function alone, and not at
    those of what it calls.
    """
    cache_home = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    base = chosen or os.path.join(os.path.expanduser(cache_home), "veselova")
    return os.path.join(base, f"kernel-{_digest()}")


@cache
def _digest() -> str:
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
