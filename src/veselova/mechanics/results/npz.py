"""The NumPy archive of a trajectory, read back."""

from __future__ import annotations

import io
import os
import struct
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any
from zipfile import BadZipFile

import numpy as np

from veselova.mechanics.core.decimals import Decimals, decimals_of
from veselova.mechanics.core.errors import InvalidInput, show
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.results.table import located

__all__ = ["read_decimals", "reading", "require_arrays"]

#: What files of motions are, and how reading others fails.
_ARCHIVE = "a file of a motion that to_npz wrote"
_DAMAGE = (ValueError, TypeError, LookupError, AttributeError, ArithmeticError, RuntimeError)
_FAILURES = (*_DAMAGE, OSError, EOFError, BadZipFile, zlib.error, struct.error)


@contextmanager
def reading(source: Any) -> Iterator[Mapping[str, Any]]:
    """Give the arrays of an archive, by its path or from a stream. Raises InvalidInput, located at
    ``source``, for what is neither, and where reading it fails.
    """
    path = isinstance(source, (str, os.PathLike))
    stream = callable(getattr(source, "read", None)) and not isinstance(source, io.TextIOBase)
    if not path and not stream:
        raise InvalidInput(("source",), f"a path, or a binary stream, of {_ARCHIVE}", show(source))
    try:
        with np.load(located(source) if path else source, allow_pickle=False) as archive:
            yield dict(archive.items())
    except InvalidInput:
        raise
    except _FAILURES as error:
        given = f"{show(str(source) if path else source)} ({type(error).__name__})"
        raise InvalidInput(("source",), _ARCHIVE, given) from None


def read_decimals(
    problem: Problem, archive: Mapping[str, Any], digits: int, certified: bool
) -> Decimals | None:
    """Return the decimals of an open archive, None where it has doubles alone. Raises KeyError
    where some are missing.
    """
    if f"{next(iter(problem.outputs))}_decimal" not in archive:
        return None
    midpoints, radii = (
        {name: decimals_of(archive[f"{name}_{kind}"]) for name in problem.outputs}
        for kind in ("decimal", "radius")
    )
    return Decimals(digits, certified, midpoints, radii, problem.bounded)


def require_arrays(arrays: Mapping[str, Any], problem: Problem) -> None:
    """Raise InvalidInput unless a file has all arrays of a motion: doubles of one number of times,
    in the shapes of the problem's series.
    """
    shapes = {
        "times": (),
        "error": (),
        **{name: problem.start[name].shape[1:] for name in problem.stored},
    }
    if missing := [name for name in ("provenance", *shapes) if name not in arrays]:
        required = f"a file with provenance, {', '.join(shapes)}"
        raise InvalidInput(("source",), required, f"one without {', '.join(missing)}")
    count = np.size(arrays["times"])
    for name, rest in shapes.items():
        found, shape = arrays[name], (count, *rest)
        whole = found.dtype == np.float64 and found.shape == shape and count
        if not whole or not np.isfinite(found).all():
            given = f"{found.dtype} of shape {found.shape}"
            raise InvalidInput(("source", name), f"finite doubles of shape {shape}", given)
