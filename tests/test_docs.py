"""What the documents print works as printed."""

from __future__ import annotations

import json
import os
import pkgutil
import re
import shlex
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from conftest import PATIENCE, Server, command_line
from veselova import __version__
from veselova.motion_page import BUNDLE

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()
#: What the build of the guide makes of examples/gallery is no page of the repository.
PAGES = [
    "README.md",
    *sorted(
        str(path.relative_to(ROOT))
        for path in (ROOT / "docs").rglob("*.md")
        if "gallery" not in path.relative_to(ROOT).parts
    ),
]
#: Numbers whose size alone is promised: roundings, which differ from one processor to another.
ROUNDING = 1e-6


def blocks(text: str, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def numbers(text: str) -> list[float]:
    return [float(number) for number in re.findall(NUMBER, text)]


def require_bundle(text: str) -> None:
    """Skip what makes pages that play motions, where the explorer could not be built: no Node."""
    if any(part in text for part in ("to_html", ".html", ".view(")) and not BUNDLE.exists():
        pytest.skip("needs the explorer, built by explorer/build.py")


NUMBER = r"(?<![\w.])-?\d+(?:\.\d*)?(?:e[-+]?\d+)?"


def assert_same_output(shown: str, printed: str) -> None:
    """Assert that words are the same, numbers equal to six digits, and of one size where they are
    roundings or bounds of errors.
    """
    assert re.sub(NUMBER, "#", shown).split() == re.sub(NUMBER, "#", printed).split()
    for match, new in zip(re.finditer(NUMBER, shown), numbers(printed), strict=True):
        old = float(match[0])
        if 0 < abs(old) < ROUNDING or shown[: match.start()].endswith('_error": '):
            assert abs(new) < 30 * abs(old)
        else:
            assert new == pytest.approx(old, rel=1e-5)


#: A block of Python or of curl, and the output that is shown below it.
SHOWN = r"^```(python|sh)\n(.*?)^```(?:\n\n```(?:text|json)\n(.*?)^```)?"


@pytest.mark.daily(2)
@pytest.mark.parametrize(
    "page", [page for page in PAGES if "```python" in (ROOT / page).read_text()]
)
def test_the_code_of_the_pages_runs_and_prints_what_they_show(
    page: str,
    server: Server,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    text = (ROOT / page).read_text()
    require_bundle("".join(blocks(text, "python")))
    scope: dict[str, Any] = {"__name__": "__main__"}
    for language, source, shown in re.findall(SHOWN, text, re.MULTILINE | re.DOTALL):
        source = source.replace("http://127.0.0.1:8000", server.url)
        if language == "python":
            exec(source, scope)
            printed = capsys.readouterr().out
        elif shown:
            printed = output_of(["bash", "-c", source])
        if shown:
            assert_same_output(shown, printed)


def output_of(command: list[str]) -> str:
    """Return what a command prints; it has to succeed."""
    answer = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)
    assert answer.returncode == 0, answer.stderr
    return answer.stdout


#: Language → the interpreter, its arguments, and what loads the packages that the page names.
LANGUAGES = {
    "js": (["node", "--input-type=module", "-e"], "0"),
    "r": (["Rscript", "-e"], "library(httr2); library(jsonlite)"),
    "julia": (["julia", "-e"], "using HTTP, JSON"),
}


@pytest.mark.parametrize("language", LANGUAGES)
def test_clients_in_other_languages_print_what_the_page_shows(
    language: str, server: Server
) -> None:
    command, packages = LANGUAGES[language]
    if shutil.which(command[0]) is None:
        pytest.skip(f"needs {command[0]} in PATH")
    if subprocess.run([*command, packages], capture_output=True, timeout=PATIENCE).returncode:
        pytest.skip(f"needs the packages of {language} that the page names")
    page = (ROOT / "docs" / "clients.md").read_text()
    ((source, shown),) = re.findall(
        rf"^```{language}\n(.*?)^```\n\n```text\n(.*?)^```", page, re.MULTILINE | re.DOTALL
    )
    source = source.replace("http://127.0.0.1:8000", server.url)
    assert_same_output(shown, output_of([*command, source]))


COMMANDS = [
    line
    for block in blocks((ROOT / "docs" / "command-line.md").read_text(), "sh")
    for line in block.splitlines()
]


def test_the_commands_of_the_readme_are_those_of_the_page() -> None:
    shown = [line for block in blocks(README, "sh") for line in block.splitlines()]
    assert {line for line in shown if line.startswith("veselova ")} <= {*COMMANDS}


@pytest.mark.parametrize("command", COMMANDS[:-1])
def test_the_commands_of_the_page_run(command: str, tmp_path: Path) -> None:
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    assert COMMANDS[-1] == "veselova serve"
    require_bundle(command)
    command, _, target = command.partition(" > ")
    words = shlex.split(command)
    assert words[0] == "veselova"
    answer = command_line(*words[1:], cwd=tmp_path, XDG_STATE_HOME=str(tmp_path))
    assert answer.returncode == 0, answer.stderr
    assert not target or json.loads(answer.stdout)
    for option in ("--plot", "--output", "--animate"):
        if option in words:
            assert (tmp_path / words[words.index(option) + 1]).exists()


def test_the_request_of_the_page_is_answered(server: Server) -> None:
    page = (ROOT / "docs" / "http.md").read_text()
    body = re.search(r"-d '(\{.*?\})'$", page, re.MULTILINE | re.DOTALL)
    assert body
    response = server.ask(
        "POST", "/v1/trajectories", content=body[1], headers={"content-type": "application/json"}
    )
    assert response.status_code == 200
    assert list(response.json()["series"]) == ["q", "frame"]


@pytest.mark.parametrize(
    "name",
    [*PAGES, "ARCHITECTURE.md", "CONTRIBUTING.md", "CONVENTIONS.md", "CHANGELOG.md", "SECURITY.md"],
)
def test_links_and_named_files_exist(name: str) -> None:
    text = (ROOT / name).read_text()
    # A target has a suffix; θ[ε;δ](z) is a formula.
    for target in re.findall(r"\]\(([^)#:]+\.\w+)(?:#[^)]*)?\)", text):
        assert ((ROOT / name).parent / target).exists(), target
    for target in re.findall(r"`((?:tests|benchmarks|examples|docs|src)/[\w/.]+\.\w+)`", text):
        assert (ROOT / target).exists(), target


#: Characters of a line of code, so that no page scrolls sideways.
CODE_WIDTH = 76


@pytest.mark.parametrize("name", [*PAGES, "examples/gallery"])
def test_code_is_narrow(name: str) -> None:
    text = "" if (ROOT / name).is_dir() else (ROOT / name).read_text()
    found = re.findall(r"^```\w.*\n((?s:.*?))^```$", text, re.MULTILINE)
    found += [path.read_text() for path in (ROOT / name).glob("*.py")]
    wide = [line for code in found for line in code.splitlines() if len(line) > CODE_WIDTH]
    assert not wide


def test_printed_numbers_are_those_of_the_table() -> None:
    page = (ROOT / "docs" / "paper.md").read_text()
    cited = r"\(`?([^()\s`]+?)`?\) \[(\d\.\d+)\]"
    above, table = page.split("## Labels and printed numbers")
    found = {label.replace("\\", ""): number for label, number in re.findall(cited, table)}
    assert found["mom"] == "2.8"  # the number that the source itself writes out
    assert found["4.5"] == "5.11"
    assert len(found) == len({*found.values()}) > 90
    texts = [path.read_text() for path in (ROOT / "src" / "veselova").rglob("*.py")]
    printed = [
        pair for text in texts for pair in re.findall(r"\(([^()\s]+),\s+printed\s+([\d.]+)\)", text)
    ]
    for label, number in [*re.findall(cited, above), *printed]:
        assert found[label.replace("\\", "")] == number


def test_functions_that_the_page_of_the_paper_names_exist() -> None:
    page = (ROOT / "docs" / "paper.md").read_text()
    found = re.findall(r"`(a|m|paper)\.([a-z_\d.]+[a-z_\d])((?:\.[A-Z]\w*(?:\.\w+)?)?)`", page)
    assert len(found) > 80
    parts = {"a": "veselova.analytic", "m": "veselova.mechanics", "paper": "paper"}
    for part, path, member in found:
        assert pkgutil.resolve_name(f"{parts[part]}.{path}{member}") is not None


def test_named_tests_exist() -> None:
    files = [*(ROOT / "tests").rglob("test_*.py")]
    known = {path.stem for path in files}
    known.update(re.findall(r"def (test_\w+)\(", "".join(path.read_text() for path in files)))
    for page in ("errata", "paper"):
        named = re.findall(r"\btest_\w+", (ROOT / "docs" / f"{page}.md").read_text())
        assert set(named) <= known, set(named) - known


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
