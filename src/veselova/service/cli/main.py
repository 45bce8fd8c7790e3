"""The command line. Exit status: 0 solved, 1 could not be solved, 2 bad input."""

from __future__ import annotations

import io
import os
import re
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from veselova.mechanics.core.errors import InvalidInput, VeselovaError
from veselova.mechanics.core.folders import expand_home
from veselova.service.cli import server_commands
from veselova.version import __version__

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["--help", "-h"]},
)


def _path(help: str, metavar: str = "PATH") -> Any:  # noqa: A002
    """Return an option that names a path; shells expand no ~ behind an equals sign."""
    return typer.Option(parser=expand_home, metavar=metavar, help=help)


File = Annotated[
    str,
    typer.Argument(metavar="FILE", help="JSON body of the HTTP request; - reads standard input"),
]
Json = Annotated[bool, typer.Option("--json", help="print the JSON answer of the HTTP API")]
Output = Annotated[
    Path | None,
    _path("write the motion (the analytic one of two): .npz, .csv, .parquet, .arrow or .json"),
]
Plot = Annotated[Path | None, _path("draw the motion into a picture (.png, .pdf, .svg)")]
Method = Annotated[str | None, typer.Option(help="method of the numeric engine: dop853 or taylor")]


def main() -> None:
    """Run the command line; errors are one sentence on standard error."""
    # As process 1 of a container the default action of SIGTERM would be to ignore it, and 143 is
    # what a shell expects.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    if sys.stdout is None or sys.stderr is None:  # started with a closed stream
        raise SystemExit(1)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # of an encoding that lacks γ
            stream.reconfigure(errors="replace")
    with _report_errors():
        app()


@contextmanager
def _report_errors() -> Iterator[None]:
    from veselova.service.api.problem_details import Refused

    try:
        yield
    except InvalidInput as error:
        _fail(str(error), 2)
    except Refused as error:
        _fail(str(error), 1 if error.code == "over-budget" else 2)
    except VeselovaError as error:
        _fail(str(error), 1)
    except BrokenPipeError:  # the reader of our output has gone, as in `veselova solve … | head`
        sys.stderr.close()
        raise SystemExit(1) from None
    except OSError as error:
        _give_up_output()
        _fail(f"writing {error.filename or 'the answer'} failed: {error.strerror or error}", 1)
    except MemoryError:
        _fail("not enough memory for so many times and so large a body", 1)
    except KeyboardInterrupt:
        _fail("interrupted", 130)


def _give_up_output() -> None:
    """Prevent a second failure when the interpreter flushes its output at the end."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _fail(message: str, status: int) -> None:
    # What a file says is not to steer a terminal.
    print("veselova: " + re.sub(r"[^\n]", _printable, message), file=sys.stderr)
    raise SystemExit(status)


def _printable(letter: re.Match[str]) -> str:
    text = letter.group()
    return text if text.isprintable() else text.encode("unicode_escape").decode()


def _read(file: str) -> Any:
    """Return the decoded JSON of a file, or of standard input for ``-``; raises InvalidInput."""
    from veselova.service.api.problem_details import loads

    if file == "-" and sys.stdin is None:
        raise InvalidInput(("FILE",), "an open standard input", "a closed one")
    path = expand_home(file, "FILE")
    try:
        text = sys.stdin.buffer.read() if file == "-" else path.read_bytes()
    except OSError as error:
        raise InvalidInput(("FILE",), "a readable file", f"{file} ({error.strerror})") from None
    return loads(text, "standard input" if file == "-" else file)


@app.callback(invoke_without_command=True)
def _root(
    version: Annotated[bool, typer.Option("--version", help="print the version")] = False,
) -> None:
    """Motions of an n-dimensional rigid body under the Veselova constraint: in theta functions, and
    by integration.
    """
    if version:
        print(__version__)
        raise typer.Exit


@app.command()
def demo(method: Method = None, plot: Plot = None) -> None:
    """Solve a four-dimensional body with both engines and show how they agree."""
    from veselova.service.api.examples import BODY4
    from veselova.service.cli import commands

    commands.compare({**BODY4, "method": method}, False, None, plot)


@app.command()
def solve(
    file: File,
    json: Json = False,
    output: Output = None,
    plot: Plot = None,
    animate: Annotated[
        Path | None,
        _path("write the motion as a film (.mp4, .gif) or as a page that plays (.html)"),
    ] = None,
) -> None:
    """Solve a motion with one engine, or those of many starts."""
    from veselova.service.cli import commands

    document = _read(file)
    if isinstance(document, dict) and "starts" in document:
        commands.solve_many(document, json, output, plot or animate)
    else:
        commands.solve(document, json, output, plot, animate)


@app.command()
def compare(
    file: File,
    json: Json = False,
    output: Output = None,
    plot: Plot = None,
    method: Method = None,
) -> None:
    """Solve a motion with both engines and show how they agree."""
    from veselova.service.cli import commands

    document = _read(file)
    if method is not None and isinstance(document, dict):
        document = {**document, "method": method}
    commands.compare(document, json, output, plot)


@app.command()
def torus(file: File, json: Json = False) -> None:
    """Describe the invariant torus of a motion: curve, periods, frequencies, phases."""
    from veselova.service.cli import commands

    commands.answer("torus", commands.without_motion(_read(file)), json)


@app.command("closed-form")
def closed_form(
    file: File,
    output: Annotated[Path | None, _path("write the document to a .json file")] = None,
    json: Json = False,
) -> None:
    """Write a motion in closed form as data: a document that any language can evaluate."""
    from veselova.service.cli import commands

    commands.closed_form(_read(file), json, output)


@app.command()
def curve(file: File, json: Json = False) -> None:
    """Compute periods, Riemann matrix and Abel–Jacobi images of a hyperelliptic curve."""
    from veselova.service.cli import commands

    commands.answer("curve", _read(file), json)


@app.command()
def theta(file: File, json: Json = False) -> None:
    """Evaluate Riemann theta functions, with characteristics and derivatives."""
    from veselova.service.cli import commands

    commands.answer("theta", _read(file), json)


@app.command()
def geodesic(file: File, json: Json = False) -> None:
    """Find the shortest ways between points of an ellipsoid, follow geodesics, measure polygons."""
    from veselova.service.cli import commands

    commands.answer("geodesic", _read(file), json)


@app.command()
def sweep(
    file: File,
    json: Json = False,
    output: Annotated[
        Path | None,
        _path("write the table to a file: .parquet, .csv or .nc (NetCDF)"),
    ] = None,
    folder: Annotated[
        Path | None,
        _path("where what is done is kept, and a second start goes on", "FOLDER"),
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, help="processes; all processors when left out")
    ] = None,
) -> None:
    """Solve many problems: all combinations of some numbers, or random ones; an interrupted sweep
    resumes.
    """
    from veselova.service.cli import commands

    commands.sweep(_read(file), json, output, folder, workers)


@app.command()
def explore(
    file: Annotated[
        str | None,
        typer.Argument(metavar="FILE", help="JSON body of the HTTP request whose motion is shown"),
    ] = None,
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="port of loopback; 0 takes a free one")
    ] = 0,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="open the page, or print its address")
    ] = True,
    export: Annotated[
        Path | None,
        _path("write page and examples as a static site instead", "FOLDER"),
    ] = None,
) -> None:
    """Show motions in the browser: body, ball, sphere, geodesic, torus and curve, at any time."""
    from veselova.service.cli.explore import explore as run
    from veselova.service.cli.explore import export as write

    document = None if file is None else _read(file)
    if export is not None:
        write(export, document)
    else:
        run(document, port, browser)


@app.command()
def example(
    system: Annotated[str, typer.Argument(metavar="SYSTEM", help="veselova, neumann, lr, …")],
) -> None:
    """Print a request of a system that runs: veselova example SYSTEM > my.json."""
    from json import dumps

    from veselova.service.api.examples import example_request

    print(dumps(example_request(system), indent=2))


app.command()(server_commands.serve)
app.add_typer(server_commands.keys, name="keys")
