"""The files that the command line reads and writes."""

from __future__ import annotations

import os
import sys
from contextlib import nullcontext
from pathlib import Path
from typing import Any

__all__ = [
    "FILMS",
    "MOST_BYTES",
    "PICTURES",
    "WRITERS",
    "check_file",
    "check_files",
    "draw",
    "film",
    "read_document",
    "say_written",
    "warn_of_moments",
    "without_motion",
    "write_motion",
]


#: Budget: bytes of the file of a request, four million numbers of an ensemble.
MOST_BYTES = 100_000_000


def read_document(file: str) -> Any:
    """Return the decoded JSON of a file, or of standard input for ``-``; raises InvalidInput, for
    more than ``MOST_BYTES`` too.
    """
    from veselova.mechanics.core.errors import InvalidInput
    from veselova.mechanics.core.folders import expand_home
    from veselova.service.api.problem_details import loads

    if file == "-" and sys.stdin is None:
        raise InvalidInput(("FILE",), "an open standard input", "a closed one")
    try:
        with (
            nullcontext(sys.stdin.buffer)
            if file == "-"
            else expand_home(file, "FILE").open("rb") as stream
        ):
            text = stream.read(MOST_BYTES + 1)
    except OSError as error:
        raise InvalidInput(("FILE",), "a readable file", f"{file} ({error.strerror})") from None
    if len(text) > MOST_BYTES:
        raise InvalidInput(
            ("FILE",), f"a file of at most {MOST_BYTES / 1e6:g} MB", f"{file}, larger"
        )
    return loads(text, "standard input" if file == "-" else file)


#: Fields of a motion's request that say nothing of its torus.
_OF_MOTIONS = ("times", "engine", "method", "formulation", "outputs", "digits", "certified")


def without_motion(document: Any, but: tuple[str, ...] = ()) -> Any:
    """Return a request without the fields of a motion, but those named: its file serves for its
    torus too.
    """
    if not isinstance(document, dict):
        return document
    left_out = set(_OF_MOTIONS) - set(but)
    return {name: value for name, value in document.items() if name not in left_out}


#: Suffixes of files of motions, of pictures and of films.
WRITERS = (".npz", ".csv", ".parquet", ".arrow", ".json")
PICTURES = (".png", ".pdf", ".svg")
FILMS = (".mp4", ".gif", ".html")


def check_files(output: Path | None, plot: Path | None) -> None:
    """Refuse file names before the work, not after it."""
    for option, path, suffixes in (("--output", output, WRITERS), ("--plot", plot, PICTURES)):
        check_file(option, path, suffixes)


def check_file(option: str, path: Path | None, suffixes: tuple[str, ...]) -> None:
    """Raise InvalidInput unless an option names no file, or one that can be written."""
    from veselova.mechanics.core.errors import InvalidInput

    if path is None:
        return
    if path.suffix.lower() not in suffixes:
        raise InvalidInput((option,), f"a file name ending in {', '.join(suffixes)}", str(path))
    if not path.parent.is_dir():
        raise InvalidInput((option,), "a file in an existing folder", str(path))
    if path.is_dir() or not os.access(path if path.exists() else path.parent, os.W_OK):
        raise InvalidInput((option,), "a file that can be written", str(path))


def write_motion(trajectory: Any, path: Path, outputs: list[str] | None) -> None:
    """Write a motion in the format that the suffix names."""
    from veselova.service.api.json_documents import encode, trajectory_document

    if path.suffix.lower() == ".json":
        path.write_bytes(encode(trajectory_document(trajectory, outputs)))
    else:
        getattr(trajectory, f"to_{path.suffix[1:].lower()}")(path, outputs)


def say_written(output: Path | None, plot: Path | None, film: Path | None = None) -> None:
    """Print which files were written."""
    for name, path in (("Motion", output), ("Picture", plot), ("Film", film)):
        if path is not None:
            print(f"{name}: {path}")


def warn_of_moments(request: Any) -> None:
    """Say on standard error that no body has the moments of a request, unless it states ``strict``;
    Python warns of them too.
    """
    from veselova.mechanics.bodies.ball import require_body
    from veselova.mechanics.core.errors import InvalidInput

    stated = request.problem
    if stated.system != "veselova-so3" or "strict" in stated.model_fields_set:
        return
    try:
        require_body(stated.problem().moments)
    except InvalidInput as fault:
        print(f"veselova: {str(fault).rstrip('.')}; computed all the same", file=sys.stderr)


def draw(subject: Any, path: Path) -> None:
    """Draw a motion or a comparison into a picture."""
    subject.plot().savefig(path, dpi=130)


def film(trajectory: Any, path: Path) -> None:
    """Write a motion as a film, or as a page that plays it."""
    if path.suffix.lower() == ".html":
        from veselova.motion_page import write_page

        write_page(trajectory, path)
    else:
        trajectory.animate(path)
