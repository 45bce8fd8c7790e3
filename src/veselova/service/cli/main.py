"""The command line. Exit status: 0 solved, 1 could not be solved, 2 bad input."""

from __future__ import annotations

import os
import re
import signal
import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from veselova.service.cli import body_options, files, server_commands
from veselova.service.cli.output_encoding import transliterate_output
from veselova.version import __version__

__all__ = ["main"]

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["--help", "-h"]},
)


def _path(text: str) -> Path:
    """Return the path that an option names; shells expand no ~ behind an equals sign."""
    from veselova.mechanics.core.folders import expand_home

    return expand_home(text)


_File = Annotated[
    str,
    typer.Argument(metavar="FILE", help="JSON body of the HTTP request; - reads standard input"),
]
_Json = Annotated[bool, typer.Option("--json", help="print the JSON answer of the HTTP API")]
_Output = Annotated[
    Path | None,
    typer.Option(
        parser=_path,
        metavar="PATH",
        help="write the motion (the analytic one of two) to a file: .npz, .csv, .parquet, .arrow "
        "or .json",
    ),
]
_Plot = Annotated[
    Path | None,
    typer.Option(
        parser=_path, metavar="PATH", help="draw the motion into a picture (.png, .pdf, .svg)"
    ),
]
_Animate = Annotated[
    Path | None,
    typer.Option(
        parser=_path,
        metavar="PATH",
        help="write the motion as a film (.mp4, .gif) or as a page that plays (.html)",
    ),
]
_Method = Annotated[str | None, typer.Option(help="method of the numeric engine: dop853 or taylor")]


def main() -> None:
    """Run the command line; errors are one sentence on standard error."""
    # As process 1 of a container the default action of SIGTERM would be to ignore it, and 143 is
    # what a shell expects.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    if sys.stdout is None or sys.stderr is None:  # started with a closed stream
        raise SystemExit(1)
    transliterate_output()
    with _report_errors():
        app()


@contextmanager
def _report_errors() -> Iterator[None]:
    from veselova.mechanics.core.errors import InvalidInput, VeselovaError
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
    """Keep the interpreter from failing once more when it flushes what could not be written."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _limits(request: Any) -> AbstractContextManager[None]:
    """Stop the work after the ``budget_s`` that a file states, never without one, and show its
    progress on a terminal.
    """
    from veselova.mechanics.core.budget import limits

    return limits(request.budget_s if "budget_s" in request.model_fields_set else None, None)


def _fail(message: str, status: int) -> None:
    # What a file says is not to steer a terminal.
    print("veselova: " + re.sub(r"[^\n]", _printable, message), file=sys.stderr)
    raise SystemExit(status)


def _printable(letter: re.Match[str]) -> str:
    text = letter.group()
    return text if text.isprintable() else text.encode("unicode_escape").decode()


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
def demo(method: _Method = None, plot: _Plot = None) -> None:
    """Solve a four-dimensional body with both engines and show how they agree."""
    from veselova.service.api.examples import BODY4

    _compare({**BODY4, "method": method}, False, None, plot)


@app.command()
def solve(
    file: body_options.File = None,
    json: _Json = False,
    output: _Output = None,
    plot: _Plot = None,
    animate: _Animate = None,
    inertia: body_options.Inertia = None,
    gamma: body_options.Gamma = None,
    omega: body_options.Omega = None,
    times: body_options.Times = None,
) -> None:
    """Solve a motion with one engine, or those of many starts."""
    from veselova.mechanics.core.budget import limits
    from veselova.service.api.json_documents import trajectory_document
    from veselova.service.api.request_models import TrajectoryRequest, read_request
    from veselova.service.cli import ensemble_command
    from veselova.service.cli.console import print_json, print_trajectory, terminal
    from veselova.service.workers.tasks import solve_request

    document = body_options.read(file, inertia, gamma, omega, times)
    if isinstance(document, dict) and "starts" in document:
        ensemble_command.run(document, json, output, plot or animate, _limits)
        return
    request = read_request(TrajectoryRequest, document)
    files.check_files(output, plot)
    files.check_file("--animate", animate, files.FILMS)
    with limits(None, None):  # motion and film share one line of progress
        with _limits(request):
            trajectory = solve_request(request)
        files.warn_of_moments(request)
        if output:
            files.write_motion(trajectory, output, request.outputs)
        if plot:
            files.draw(trajectory, plot)
        if animate:
            files.film(trajectory, animate)
    if json:
        print_json(trajectory_document(trajectory, request.outputs))
    else:
        print_trajectory(terminal(), trajectory)
        files.say_written(output, plot, animate)


@app.command()
def compare(
    file: body_options.File = None,
    json: _Json = False,
    output: _Output = None,
    plot: _Plot = None,
    method: _Method = None,
    inertia: body_options.Inertia = None,
    gamma: body_options.Gamma = None,
    omega: body_options.Omega = None,
    times: body_options.Times = None,
) -> None:
    """Solve a motion with both engines and show how they agree."""
    document = body_options.read(file, inertia, gamma, omega, times)
    if method is not None and isinstance(document, dict):
        document = {**document, "method": method}
    _compare(document, json, output, plot)


def _compare(document: Any, json: bool, output: Path | None, plot: Path | None) -> None:
    from veselova.service.api.json_documents import comparison_document
    from veselova.service.api.request_models import ComparisonRequest, read_request
    from veselova.service.cli.console import print_comparison, print_json, terminal
    from veselova.service.workers.tasks import compare_request

    if isinstance(document, dict):
        # one file serves solve and compare
        document = {name: value for name, value in document.items() if name != "engine"}
    request = read_request(ComparisonRequest, document)
    files.check_files(output, plot)
    with _limits(request):
        comparison = compare_request(request)
    files.warn_of_moments(request)
    if output:
        files.write_motion(comparison.first, output, request.outputs)
    if plot:
        files.draw(comparison, plot)
    if json:
        print_json(comparison_document(comparison, request.outputs))
    else:
        print_comparison(terminal(), comparison)
        files.say_written(output, plot)


@app.command()
def torus(
    file: body_options.File = None,
    json: _Json = False,
    inertia: body_options.Inertia = None,
    gamma: body_options.Gamma = None,
    omega: body_options.Omega = None,
    times: body_options.Times = None,
) -> None:
    """Describe the invariant torus of a motion: curve, periods, frequencies, phases."""
    from veselova.service.api.request_models import TorusRequest, read_request
    from veselova.service.cli.console import print_json, print_torus, terminal
    from veselova.service.workers.tasks import torus_request

    document = files.without_motion(body_options.read(file, inertia, gamma, omega, times))
    request = read_request(TorusRequest, document)
    with _limits(request):
        answer = torus_request(request)
    files.warn_of_moments(request)
    if json:
        print_json(answer.as_dict())
    else:
        print_torus(terminal(), answer, request.problem.problem_class)


@app.command("closed-form")
def closed_form(
    file: _File,
    output: Annotated[
        Path | None,
        typer.Option(parser=_path, metavar="PATH", help="write the document to a .json file"),
    ] = None,
    json: _Json = False,
) -> None:
    """Give a motion in closed form as data: a document that any language can evaluate."""
    from veselova.service.api.request_models import read_request
    from veselova.service.api.toolkit_requests import ClosedFormRequest
    from veselova.service.cli.console import print_json
    from veselova.service.workers.tasks import closed_form_request

    document = files.without_motion(files.read_document(file), but=("digits",))
    request = read_request(ClosedFormRequest, document)
    files.check_file("--output", output, (".json",))
    with _limits(request):
        answer = closed_form_request(request)
    if output:
        output.write_text(answer.to_json() + "\n", encoding="utf-8")
    if json or not output:
        print_json(answer.document)
    else:
        print(f"{answer}: {output}")


@app.command()
def curve(file: _File, json: _Json = False) -> None:
    """Compute periods, Riemann matrix and Abel–Jacobi images of a hyperelliptic curve."""
    from veselova.service.api.request_models import read_request
    from veselova.service.api.toolkit_requests import CurveRequest
    from veselova.service.cli.console import print_json, terminal
    from veselova.service.cli.toolkit_console import print_curve
    from veselova.service.workers.tasks import curve_document

    request = read_request(CurveRequest, files.read_document(file))
    with _limits(request):
        document = curve_document(request)
    print_json(document) if json else print_curve(terminal(), document)


@app.command()
def theta(file: _File, json: _Json = False) -> None:
    """Evaluate Riemann theta functions, with characteristics and derivatives."""
    from veselova.service.api.request_models import read_request
    from veselova.service.api.toolkit_requests import ThetaRequest
    from veselova.service.cli.console import print_json, terminal
    from veselova.service.cli.toolkit_console import print_theta
    from veselova.service.workers.tasks import theta_document

    request = read_request(ThetaRequest, files.read_document(file))
    with _limits(request):
        document = theta_document(request)
    print_json(document) if json else print_theta(terminal(), document)


@app.command()
def sweep(
    file: _File,
    json: _Json = False,
    output: Annotated[
        Path | None,
        typer.Option(
            parser=_path,
            metavar="PATH",
            help="write the table to a file: .parquet, .csv, .nc (NetCDF) or .zarr",
        ),
    ] = None,
    folder: Annotated[
        Path | None,
        typer.Option(
            parser=_path,
            metavar="FOLDER",
            help="where what is done is kept, so that a second start goes on from there",
        ),
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, help="processes; all processors when left out")
    ] = None,
) -> None:
    """Solve many problems: all combinations of some numbers, or random ones; interrupted, it goes
    on where it was.
    """
    from veselova.service.cli.sweep_command import run

    run(files.read_document(file), json, output, folder, workers)


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
        typer.Option(
            parser=_path, metavar="FOLDER", help="write page and examples as a static site instead"
        ),
    ] = None,
) -> None:
    """Show motions in the browser: body, ball, sphere, geodesic, torus and curve, at any time."""
    from veselova.service.cli.explore import explore as run
    from veselova.service.cli.explore import export as write

    document = None if file is None else files.read_document(file)
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
