"""A body in space stated by options, where no file states the problem."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from veselova.service.cli import files

__all__ = ["File", "Gamma", "Inertia", "Omega", "Times", "read"]

File = Annotated[
    str | None,
    typer.Argument(
        metavar="FILE",
        help="JSON body of the HTTP request; - reads standard input; or state a body by options",
    ),
]
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
    from veselova.mechanics.core.errors import InvalidInput

    stated = {"--inertia": inertia, "--gamma": gamma, "--omega": omega}
    given = ", ".join(name for name, text in {**stated, "--times": times}.items() if text)
    if file is not None:
        if given:
            raise InvalidInput(("FILE",), "a file or options of a body, not both", given)
        return files.read_document(file)
    if None in stated.values():
        required = "a file, or --inertia, --gamma and --omega of a body"
        raise InvalidInput(("FILE",), required, given or "neither")
    body = {"inertia": inertia, "gamma": gamma, "Omega": omega}
    lists = {name: _numbers(text or "") for name, text in body.items()}
    return {
        "problem": {"system": "veselova-so3", **lists, "normalize": True},
        "times": _times(times or "0:20:201"),
    }


def _numbers(text: str) -> list[str]:
    """Return numbers as they are written, so that none is rounded."""
    return [number.strip() for number in text.split(",")]


def _times(text: str) -> Any:
    from veselova.mechanics.core.errors import InvalidInput

    if ":" not in text:
        return _numbers(text)
    parts = text.split(":")
    if len(parts) != 3 or not parts[2].strip().isdecimal():
        required = "START:STOP:COUNT, COUNT a positive whole number, or times with commas"
        raise InvalidInput(("--times",), required, text)
    start, stop, count = (part.strip() for part in parts)
    return {"start": start, "stop": stop, "count": int(count)}
