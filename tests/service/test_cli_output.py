"""What the command line prints where little fits or can be encoded, and the doors to it."""

from __future__ import annotations

import json
import time
from pathlib import Path

import numpy as np
import pytest

import veselova as vs
from conftest import command_line
from veselova.mechanics.core import budget
from veselova.service.api.examples import BODY4, PROBLEMS, example_request
from veselova.service.api.problem_models import SYSTEMS
from veselova.service.cli import commands
from veselova.service.cli.console import print_document, print_trajectory

EXAMPLES = Path(__file__).parent.parent.parent / "examples"


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
def test_any_encoding_of_the_output_serves(arguments: list[str], encoding: str) -> None:
    answer = command_line(*arguments, encoding=encoding)
    assert answer.returncode == ("body3" in arguments[-1])
    if "--json" in arguments:
        json.loads(answer.stdout)
    elif arguments[0] == "solve":
        assert "(?,?) = 0, energy" in answer.stdout


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


@pytest.mark.parametrize("system", PROBLEMS)
def test_examples_of_all_systems_run(system: str) -> None:
    example = json.loads(command_line("example", system).stdout)
    assert example == example_request(system)
    solved = command_line("solve", "-", "--json", stdin={**example, "times": [0, "0.5"]})
    assert len(json.loads(solved.stdout)["error"]) == 2


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
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def film(*_: object) -> None:
        for _frame in budget.iterate(range(3), "film"):
            time.sleep(0.11)  # longer than between two reports

    monkeypatch.setattr(budget, "_PATIENCE_S", 0)
    monkeypatch.setattr(commands, "_film", film)
    document = {"problem": {**PROBLEMS["lr"], "system": "lr"}, "times": [0, 3]}
    options = {"solve": ["--animate", tmp_path / "x.gif"], "sweep": ["--folder", tmp_path]}
    if command == "sweep":
        document = {**BODY4, "times": [0, 1], "vary": {"/A/0": [3, 4]}}
    answer = command_line(command, "-", *options.get(command, []), stdin=document, terminal=True)
    lines = answer.stderr.split("\r")
    assert answer.returncode == 0
    assert all(line.startswith("veselova: ") for line in lines[1:-2]), lines
    assert (lines[0], lines[-2].strip(), lines[-1]) == ("", "", "")
    if command == "solve":
        assert "film" in lines[-3]
        assert "film" not in lines[1]


def test_a_body_in_a_potential_is_not_sent_to_integrate() -> None:
    for command in ("torus", "closed-form"):
        answer = command_line(command, EXAMPLES / "body3.json")
        assert answer.returncode == 1
        assert "potential" in answer.stderr
        assert "torus" in answer.stderr
        assert "integrate" not in answer.stderr


def test_short_help_and_no_keys(tmp_path: Path) -> None:
    def call(*words: str) -> str:
        answer = command_line(*words, VESELOVA_DATA_DIR=str(tmp_path / "state"))
        assert answer.returncode == 0, answer.stderr
        return answer.stdout

    for words in ([], ["solve"], ["keys"], ["keys", "create"]):
        assert "Usage" in call(*words, "-h")
    assert call("keys", "list").startswith("There is no key")
    for name in ("Ada", "Sofja Wassiljewna Kowalewskaja in Stockholm", 70 * "x"):
        call("keys", "create", name, "--expires", "2999-12-31")
    listed = call("keys", "list")
    assert "  solve  valid until 2999-12-31  Ada\n" in listed
    assert "Kowalewskaja in Stockholm" in listed


def test_wide_tables_keep_80_columns_and_exponents(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    body = vs.EllipsoidGeodesic(["1e29", "2e29", "3e29"], [1, 1, 1], [1, -1, 0.2], normalize=True)
    motion = vs.solve(body, [0])
    print_trajectory(motion)
    print_document({"matrix": -np.exp(-9 * np.arange(36.0)).reshape(6, 6), "none": None})
    printed = capsys.readouterr().out
    expected = f"{motion.X[0, 0]:.9e}", f"{-np.exp(-9 * 34.0):.5g}", "none: none"
    assert all(words in printed for words in expected), printed
    assert max(map(len, printed.splitlines())) <= 80
