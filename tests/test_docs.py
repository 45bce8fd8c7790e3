"""What the documents print works as printed."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from conftest import PATIENCE, Server, slow
from veselova import __version__

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()


def blocks(text: str, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def test_the_python_of_the_readme_runs(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    scope: dict[str, Any] = {}
    sources = blocks(README, "python")
    assert len(sources) == 6
    for source in sources:
        exec(source.replace("http://127.0.0.1:8000", server.url), scope)
    assert scope["comparison"].agrees
    assert scope["torus"].n == 4
    assert (scope["dataset"].outcome == "solved").all()
    assert scope["certified"].certified
    assert scope["geodesic"].quadrics.shape == (1,)
    assert scope["body"].system == "veselova-so3"


COMMANDS = next(block for block in blocks(README, "sh") if "veselova demo" in block).splitlines()


@pytest.mark.parametrize(
    "command", [slow(line) if "bench" in line else line for line in COMMANDS[:-1]]
)
def test_the_commands_of_the_readme_run(command: str, tmp_path: Path) -> None:
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    environment = {**os.environ, "XDG_STATE_HOME": str(tmp_path)}
    assert COMMANDS[-1] == "veselova serve"
    words = shlex.split(command)
    assert words[0] == "veselova"
    answer = subprocess.run(
        [sys.executable, "-m", *words],
        cwd=tmp_path,
        capture_output=True,
        timeout=PATIENCE,
        env=environment,
    )
    assert answer.returncode == 0, answer.stderr
    for option in ("--plot", "--output"):
        if option in words:
            assert (tmp_path / words[words.index(option) + 1]).exists()


def test_the_request_of_the_readme_is_answered(server: Server) -> None:
    body = re.search(r"-d '(\{.*?\})'$", README, re.MULTILINE | re.DOTALL)
    assert body
    response = server.ask(
        "POST", "/v1/trajectories", content=body[1], headers={"content-type": "application/json"}
    )
    assert response.status_code == 200
    assert list(response.json()["series"]) == ["q", "frame"]


@pytest.mark.parametrize(
    "name",
    [
        "README.md",
        "ARCHITECTURE.md",
        "CONVENTIONS.md",
        "CHANGELOG.md",
        "SECURITY.md",
        "docs/container.md",
        "docs/service.md",
        "docs/accuracy.md",
        "docs/performance.md",
    ],
)
def test_links_and_named_files_exist(name: str) -> None:
    text = (ROOT / name).read_text()
    prose = re.sub(r"`[^`\n]*`", "", text)  # a code span holds formulas, never links
    for target in re.findall(r"\]\(([^)#:]+)\)", prose):
        assert ((ROOT / name).parent / target).exists(), target
    for target in re.findall(r"`((?:tests|benchmarks|examples|docs|src)/[\w/.]+\.\w+)`", text):
        assert (ROOT / target).exists(), target


def test_named_tests_exist() -> None:
    sources = "".join(path.read_text() for path in (ROOT / "tests").rglob("test_*.py"))
    for name in re.findall(r"`(test_\w+)`", (ROOT / "docs" / "errata.md").read_text()):
        assert f"def {name}(" in sources


def test_one_version_stands_everywhere() -> None:
    assert f"version: {__version__}" in (ROOT / "CITATION.cff").read_text()
    assert f"## [{__version__}] - " in (ROOT / "CHANGELOG.md").read_text()


def test_no_lock_file_names_an_address() -> None:
    for lock in ROOT.glob("requirements*.lock"):
        text = lock.read_text()
        assert "://" not in text
        assert all(
            "==" in line for line in text.splitlines() if line and not line.startswith((" ", "#"))
        )


def test_continuous_integration_runs_the_check_of_the_readme() -> None:
    assert "exec ./check" in (ROOT / ".ci" / "run").read_text()
    assert "`./check`" in README
    for script in ("run", "check", ".ci/run", ".ci/lock"):
        assert os.access(ROOT / script, os.X_OK)


def test_the_example_is_a_request_for_four_hundred_times_and_more() -> None:
    times = json.loads((ROOT / "examples" / "body4.json").read_text())["times"]
    assert times["count"] >= 400
    assert times["stop"] - times["start"] >= 50
