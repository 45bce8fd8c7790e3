"""Tables of the reference that come from the program: settings, codes of refusals, options of the
command line, licences. A page has a comment ``<!-- generated: NAME -->`` in their place.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from importlib.metadata import PackageMetadata, PackageNotFoundError, metadata
from pathlib import Path
from typing import Any

import click
import typer

from veselova.service.api.problem_details import REFUSALS
from veselova.service.api.settings import Settings
from veselova.service.cli.main import app as command_line

_PLACE = re.compile(r"^<!-- generated: (\w+) -->$", re.MULTILINE)

#: Settings whose default belongs to the machine or the account.
_OF_THE_MACHINE = {"data_dir": "~/.local/state/veselova"}


def _table(head: list[str], rows: Iterator[list[str]] | list[list[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(
        "| " + " | ".join(" ".join(cell.replace("|", "\\|").split()) for cell in line) + " |"
        for line in lines
    )


def _code(text: object) -> str:
    return f"`{text}`" if str(text) else ""


def settings() -> str:
    """Return the table of all settings."""
    rows = []
    for name, field in Settings.model_fields.items():
        default = field.default
        if name in _OF_THE_MACHINE:
            default = _OF_THE_MACHINE[name]
        elif field.default_factory is not None:
            default = "auto"
        elif hasattr(default, "get_secret_value"):
            default = default.get_secret_value()
        elif default is None:
            default = ""
        rows.append([f"`VESELOVA_{name.upper()}`", _code(default), field.description or ""])
    return _table(["variable", "default", "meaning"], rows)


def problems() -> str:
    """Return the table of the codes of problem documents."""
    ordered = sorted(REFUSALS.items(), key=lambda entry: (entry[1][0], entry[0]))
    rows = [[str(status), f"`{code}`", title] for code, (status, title) in ordered]
    return _table(["status", "code", "title"], rows)


def _commands(command: click.Command, name: str) -> Iterator[tuple[str, click.Command]]:
    for part, further in getattr(command, "commands", {}).items():
        yield from _commands(further, f"{name} {part}")
    if not getattr(command, "commands", {}):
        yield name, command


def options() -> str:
    """Return all commands, each with its arguments and options."""
    parts = []
    for name, command in _commands(typer.main.get_command(command_line), "veselova"):
        rows = []
        for parameter in command.params:
            names = [*parameter.opts, *parameter.secondary_opts]
            named = parameter.param_type_name == "argument"
            shown = parameter.name.upper() if named else ", ".join(names)
            default = parameter.default if isinstance(parameter.default, (str, int)) else ""
            hidden = isinstance(parameter.default, bool)
            meaning = getattr(parameter, "help", None) or ""
            rows.append([f"`{shown}`", "" if hidden else _code(default), meaning])
        parts.append(f"### `{name}`\n\n{' '.join((command.help or '').split())}")
        if rows:
            parts.append(_table(["option", "default", "meaning"], rows))
    return "\n\n".join(parts)


def licences() -> str:
    """Return the licences that the packages of ``requirements.lock`` state in their metadata."""
    lock = Path(__file__).parents[2] / "requirements.lock"
    rows = []
    for package in re.findall(r"^([\w.-]+)==", lock.read_text(), re.MULTILINE):
        try:
            rows.append([package, _licence(metadata(package))])
        except PackageNotFoundError:
            rows.append([package, "not listed: for another platform or Python"])
    return _table(["package", "licence"], rows)


def _licence(about: PackageMetadata) -> str:
    """Return the expression, else the classifiers, else the first line of the text."""
    classified = [
        each.rsplit(" :: ", 1)[-1]
        for each in about.get_all("Classifier") or []
        if each.startswith("License ::") and not each.endswith("OSI Approved")
    ]
    stated = about.get("License-Expression") or "; ".join(classified)
    return str(stated or about.get("License") or "not stated").strip().splitlines()[0]


_TABLES = {"settings": settings, "problems": problems, "options": options, "licences": licences}


def _fill(app: Any, name: str, source: list[str]) -> None:
    def table(place: re.Match[str]) -> str:
        # the page is made anew where the program has changed
        app.env.note_dependency(str(Path(app.srcdir) / "src" / "veselova" / "version.py"))
        app.env.note_reread()
        return _TABLES[place[1]]()

    source[0] = _PLACE.sub(table, source[0])


def setup(app: Any) -> dict[str, bool]:
    """Connect the tables to Sphinx."""
    app.connect("source-read", _fill)
    return {"parallel_read_safe": True}
