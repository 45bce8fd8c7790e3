"""Arguments and options that several commands have, and a body in space stated by options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from veselova.mechanics.core.errors import InvalidInput
from veselova.mechanics.core.folders import expand_home
from veselova.service.cli import files

__all__ = [
    "Animate",
    "File",
    "Gamma",
    "Inertia",
    "Json",
    "Method",
    "Omega",
    "OptionalFile",
    "Output",
    "Plot",
    "Times",
    "path_option",
    "read",
]


def path_option(help: str, metavar: str = "PATH") -> Any:  # noqa: A002
    """Return an option that names a path; shells expand no ~ behind an equals sign."""
    return typer.Option(parser=expand_home, metavar=metavar, help=help)


File = Annotated[
    str,
    typer.Argument(metavar="FILE", help="JSON body of the HTTP request; - reads standard input"),
]
OptionalFile = Annotated[
    str | None,
    typer.Argument(
        metavar="FILE",
        help="JSON body of the HTTP request; - reads standard input; or state a body by options",
    ),
]
Json = Annotated[bool, typer.Option("--json", help="print the JSON answer of the HTTP API")]
Output = Annotated[
    Path | None,
    path_option(
        "write the motion (the analytic one of two): .npz, .csv, .parquet, .arrow or .json"
    ),
]
Plot = Annotated[Path | None, path_option("draw the motion into a picture (.png, .pdf, .svg)")]
Animate = Annotated[
    Path | None,
    path_option("write the motion as a film (.mp4, .gif) or as a page that plays (.html)"),
]
Method = Annotated[str | None, typer.Option(help="method of the numeric engine: dop853 or taylor")]
Inertia = Annotated[
    str | None,
    typer.Option(metavar="I1,I2,I3", help="principal moments of a body in space (no FILE then)"),
]
Gamma = Annotated[
    str | None,
    typer.Option(metavar="X,Y,Z", help="its vector γ fixed in space, scaled to unit length"),
]
Omega = Annotated[str | None, typer.Option(metavar="X,Y,Z", help="its angular velocity")]
Times = Annotated[
    str | None,
    typer.Option(metavar="TIMES", help="START:STOP:COUNT, or times with commas; 0:20:201"),
]


def read(
    file: str | None, inertia: str | None, gamma: str | None, omega: str | None, times: str | None
) -> Any:
    """Return the document of a file, or the request of system ``veselova-so3`` that options state.

    Raises InvalidInput unless there is either a file or all of a body.
    """
    given = [text for text in (inertia, gamma, omega) if text is not None]
    if file is not None and not given and times is None:
        return files.read_document(file)
    if file is not None or len(given) < 3:
        required = "a file, or --inertia, --gamma and --omega of a body"
        told = "both" if file is not None else f"{len(given)} of these options"
        raise InvalidInput(("FILE",), required, told)
    # numbers stay as they are written, so that none is rounded
    body = zip(("inertia", "gamma", "Omega"), (text.split(",") for text in given))
    problem = {"system": "veselova-so3", **dict(body), "normalize": True}
    return {"problem": problem, "times": _times(times or "0:20:201")}


def _times(text: str) -> Any:
    parts = text.split(":")
    if len(parts) == 1:
        return text.split(",")
    if len(parts) != 3 or not parts[2].isdecimal():
        required = "START:STOP:COUNT, COUNT a positive whole number, or times with commas"
        raise InvalidInput(("--times",), required, text)
    return {"start": parts[0], "stop": parts[1], "count": int(parts[2])}
