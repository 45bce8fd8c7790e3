"""What the command line prints where little fits or can be encoded, and the doors to it."""

from __future__ import annotations

import io
import json
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import veselova as vs
from veselova.mechanics.core import budget, progress
from veselova.service.api.examples import BODY4, PROBLEMS, example_request
from veselova.service.api.problem_models import SYSTEMS
from veselova.service.cli import commands
from veselova.service.cli.console import print_document, print_trajectory
from veselova.service.cli.main import main

EXAMPLES = Path(__file__).parent.parent.parent / "examples"


def call(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    """Run a command in this process; return its exit status and what it printed."""
    before, sys.argv = sys.argv, ["veselova", *arguments]
    try:
        main()
    except SystemExit as ending:
        printed = capsys.readouterr()
        return int(ending.code or 0), printed.out, printed.err
    finally:
        sys.argv = before
    raise AssertionError("the command line ends by SystemExit")


@pytest.mark.parametrize("encoding", ["ascii", "iso-8859-1"])
@pytest.mark.parametrize(
    "arguments",
    [
        ["solve", str(EXAMPLES / "ball.json")],
        ["torus", str(EXAMPLES / "body4.json"), "--json"],
        ["torus", str(EXAMPLES / "body3.json")],
        ["--help"],
    ],
    ids=" ".join,
)
def test_any_encoding_of_the_output_serves(
    arguments: list[str],
    encoding: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    out, fault = (io.TextIOWrapper(io.BytesIO(), encoding=encoding) for _ in range(2))
    monkeypatch.setattr(sys, "stdout", out)
    monkeypatch.setattr(sys, "stderr", fault)
    status, _, _ = call(capsys, *arguments)
    out.flush()
    written = out.buffer.getvalue()
    assert status == ("body3" in arguments[-1])
    if "--json" in arguments:
        json.loads(written)
    elif arguments[0] == "solve":
        assert b"(?,?) = 0, energy" in written


@pytest.mark.parametrize("n", [2, 3, 5, 8])
def test_errors_are_whole_in_80_columns(
    n: int, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    rng = np.random.default_rng(n)
    body = vs.Veselova(np.exp(rng.normal(size=n)), *rng.normal(size=(2, n)), normalize=True)
    for digits in (15, 50) if n == 3 else (15,):
        motion = vs.solve(body, [0.0, 100 + 1 / 3], digits=digits)
        print_trajectory(motion)
        bounds = motion.error if motion.decimals is None else motion.decimals.error
        lines = capsys.readouterr().out.splitlines()
        assert max(map(len, lines)) <= 80
        head = next(i for i, line in enumerate(lines) if line.split()[0] == "t")
        for i, line in enumerate(lines[head + 1 : head + 3]):
            assert line.split()[-1] == f"{bounds[i]:.1e}"
    found = vs.torus(body)
    print_document(found.as_dict())
    printed = capsys.readouterr().out
    assert ("…" in printed) is (n == 8)
    assert f"{found.phases[0]:.12g}" in printed
    assert max(map(len, printed[printed.index("periods") :].splitlines())) <= 80


def test_wide_tables_keep_80_columns_and_exponents(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    body = vs.EllipsoidGeodesic(["1e29", "2e29", "3e29"], [1, 1, 1], [1, -1, 0.2], normalize=True)
    motion = vs.solve(body, [0])
    print_trajectory(motion)
    printed = capsys.readouterr().out
    assert f"{motion.X[0, 0]:.9e}" in printed
    print_document({"matrix": -np.exp(-9 * np.arange(36.0)).reshape(6, 6), "none": None})
    printed += capsys.readouterr().out
    assert "none: none" in printed
    assert f"{-np.exp(-9 * 34.0):.5g}" in printed
    assert max(map(len, printed.splitlines())) <= 80


@pytest.mark.parametrize("system", PROBLEMS)
def test_examples_of_all_systems_run(
    system: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status, text, _ = call(capsys, "example", system)
    assert (status, json.loads(text)) == (0, example_request(system))
    file = tmp_path / "my.json"
    file.write_text(json.dumps({**json.loads(text), "times": [0, "0.5"]}))
    status, text, _ = call(capsys, "solve", str(file), "--json")
    assert (status, len(json.loads(text)["error"])) == (0, 2)


def test_examples_have_one_source() -> None:
    assert set(PROBLEMS) == set(SYSTEMS)
    files = ("ball", "body3", "body4", "chaplygin", "geodesic", "lr4")
    for problem in (
        json.loads((EXAMPLES / f"{name}.json").read_text())["problem"] for name in files
    ):
        assert problem == example_request(problem["system"])["problem"]
    presets = json.loads((EXAMPLES.parent / "explorer" / "src" / "presets.json").read_text())
    stated = {preset["name"]: preset["problem"] for preset in presets}
    for name, system in (("four", "veselova"), ("chaos", "lr")):
        preset, example = (
            json.dumps({**problem, "normalize": True}, sort_keys=True).replace('"', "")
            for problem in (stated[name], example_request(system)["problem"])
        )
        assert preset == example


@pytest.mark.parametrize("command", ["solve", "compare", "sweep"])
def test_a_command_has_one_line_of_progress_which_is_removed(
    command: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def film(*_: object) -> None:
        for _frame in budget.iterate(range(3), "film"):
            time.sleep(0.11)  # longer than between two reports

    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setattr(progress, "_PATIENCE_S", 0)
    monkeypatch.setattr(commands, "_film", film)
    document = {"problem": {**PROBLEMS["lr"], "system": "lr"}, "times": [0, 3]}
    arguments = {"solve": ["--animate", str(tmp_path / "x.gif")]}
    if command == "sweep":
        document = {**BODY4, "times": [0, 1], "vary": {"/A/0": [3, 4]}}
        arguments[command] = ["--folder", str(tmp_path)]
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(json.dumps(document).encode())))
    status, _, shown = call(capsys, command, "-", *arguments.get(command, []))
    lines = shown.split("\r")
    assert status == 0
    assert all(line.startswith("veselova: ") for line in lines[1:-2]), lines
    assert (lines[0], lines[-2].strip(), lines[-1]) == ("", "", "")
    if command == "solve":
        assert "film" in lines[-3]
        assert "film" not in lines[1]


def test_a_body_in_a_potential_is_not_sent_to_integrate(
    capsys: pytest.CaptureFixture[str],
) -> None:
    for command in ("torus", "closed-form"):
        status, _, fault = call(capsys, command, str(EXAMPLES / "body3.json"))
        assert status == 1
        assert "potential" in fault
        assert "torus" in fault
        assert "integrate" not in fault


def test_refusals_name_the_input(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "half.json").write_text('{"problem": {')
    fault = call(capsys, "solve", str(tmp_path / "half.json"))[2]
    assert fault.startswith(f"veselova: {tmp_path / 'half.json'}: required one JSON document")


def test_short_help_and_no_keys(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("VESELOVA_DATA_DIR", str(tmp_path / "state"))
    for words in ([], ["solve"], ["keys"], ["keys", "create"]):
        status, text, _ = call(capsys, *words, "-h")
        assert (status, "Usage" in text) == (0, True)
    assert call(capsys, "keys", "list")[1].startswith("There is no key")
    for name in ("Ada", "Sofja Wassiljewna Kowalewskaja in Stockholm", 70 * "x"):
        assert call(capsys, "keys", "create", name, "--expires", "2999-12-31")[0] == 0
    listed = call(capsys, "keys", "list")[1]
    assert "  solve  valid until 2999-12-31  Ada\n" in listed
    assert "Kowalewskaja in Stockholm" in listed
