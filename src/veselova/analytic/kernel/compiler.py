"""What compiles the text, and where machine code is kept: below NUMBA_CACHE_DIR, or the user's
cache.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar, cast

from veselova.mechanics.core.folders import account_folder, expand_home

__all__ = ["HALF", "jit", "jit_making", "jit_sum", "prepare"]

F = TypeVar("F", bound=Callable[..., Any])

#: Names to a process the half of the text that it is to compile.
HALF = "VESELOVA_COMPILES"


def jit(function: F) -> F:
    """Return the function, compiled at its first call, without the interpreter's lock, and without
    counts of references, which take longer than what is counted for: it makes no array, returns
    none, and calls nothing that does.
    """
    return _compile(function, False, False)


def jit_making(function: F) -> F:
    """Return a compiled function that makes arrays, or calls one that does."""
    return _compile(function, False, True)


def jit_sum(function: F) -> F:
    """Return a compiled sum, as by ``jit``, that may add its terms in any order."""
    return _compile(function, {"contract", "nsz", "reassoc"}, False)


@cache
def prepare() -> None:
    """Compile all of the text where nobody has, in processes of their own, and say so: a function
    compiles what it calls, so that one motion would take nearly as long. Who comes meanwhile waits.
    """
    if find_spec("numba") is None or HALF in os.environ:
        return
    folder = Path(_folder(os.environ.get("NUMBA_CACHE_DIR", "")))
    done = folder / "compiled"
    if done.exists():
        return
    print("veselova: compiling the closed form, once; about a minute …", file=sys.stderr)
    # without a folder to keep machine code in, or locks, each process compiles what it needs
    with suppress(ImportError, OSError):
        import fcntl

        folder.mkdir(parents=True, exist_ok=True)
        with open(folder / "lock", "w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not done.exists():
                command = [sys.executable, "-m", "veselova.analytic.kernel"]
                halves = [
                    subprocess.Popen(command, env=os.environ | {HALF: half})
                    for half in ("one", "many")
                ]
                codes = [half.wait() for half in halves]
                if not any(codes):
                    done.touch()


def _compile(function: F, fastmath: Any, counts: bool) -> F:
    try:
        import numba
    except ImportError:  # the interpreter alone runs the text
        return function
    options = {"error_model": "numpy", "nogil": True, "fastmath": fastmath, "_nrt": counts}
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
    those of what it calls. One that cannot be written is copied to the user's cache.
    """
    name = f"kernel-{_digest()}"
    own = account_folder("XDG_CACHE_HOME", ".cache") / name
    folder = expand_home(chosen, "NUMBA_CACHE_DIR") / name if chosen else own
    if not folder.is_dir() or os.access(folder, os.W_OK):
        return str(folder)
    if not own.is_dir():  # as in a container
        with suppress(OSError):
            shutil.copytree(folder, own)
    return str(own)


@cache
def _digest() -> str:
    """Return the digest of the text, that of geodesics too, of its place, by which numba looks for
    machine code, and of what compiles it.
    """
    digest = hashlib.sha256(f"{sys.implementation.cache_tag} {version('numba')}".encode())
    for folder in ("kernel", "geodesics"):
        for path in sorted((Path(__file__).parent.parent / folder).glob("[!_]*.py")):
            digest.update(str(path).encode() + path.read_bytes())
    return digest.hexdigest()[:16]
