"""The kernel over Arb: the same files, executed with another arithmetic in the place of theirs."""

from __future__ import annotations

import importlib.abc
import importlib.machinery
import importlib.util
import sys
import types
from collections.abc import Sequence
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from veselova.analytic import kernel
from veselova.analytic.arithmetic.balls import balls

__all__ = ["over_arb"]

_TEXT = Path(kernel.__file__).parent


class _Finder(importlib.abc.MetaPathFinder):
    """Finds the files of the kernel below another name."""

    def __init__(self, package: str) -> None:
        self._package = package

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: types.ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        """Return the spec of a file of the package, with the arithmetic of Arb for doubles."""
        head, _, last = fullname.rpartition(".")
        if head != self._package:
            return None
        file = "arithmetic_of_arb" if last == "arithmetic" else last
        return importlib.util.spec_from_file_location(fullname, _TEXT / f"{file}.py")


@cache
def over_arb(digits: int) -> Any:
    """Return the kernel as a package of modules over balls of so many digits; call its functions
    ``with balls(digits)``.
    """
    name = f"{__package__}.over_arb_{digits}"
    package: Any = types.ModuleType(name)
    package.__path__ = []
    sys.modules[name] = package
    sys.meta_path.insert(0, _Finder(name))
    with balls(digits):
        for part in ("elliptic", "periods", "rate"):
            setattr(package, part, import_module(f"{name}.{part}"))
    return package
