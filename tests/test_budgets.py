"""How much there is: lines of code, files and words, part by part; ``python tests/test_budgets.py``
prints the table.

Lines of code are those without docstrings, comments and blank ones. A budget is what there may be
now, and only ever gets smaller, down to the goal beside it.
"""

from __future__ import annotations

import ast
import io
import tokenize
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
SOURCE = ROOT / "src" / "veselova"
EXPLORER = ROOT / "explorer" / "src"

BLANK = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENDMARKER,
}


@cache
def code_lines(path: Path) -> int:
    """Return the lines of a file of Python that hold code."""
    text = path.read_text()
    documented: set[int] = set()
    for node in ast.walk(ast.parse(text)):
        kinds = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
        if isinstance(node, kinds) and ast.get_docstring(node, clean=False) is not None:
            first = node.body[0]
            documented |= set(range(first.lineno, (first.end_lineno or 0) + 1))
    lines: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in BLANK:
            lines |= set(range(token.start[0], token.end[0] + 1))
    return len(lines - documented)


def script_lines(path: Path) -> int:
    """Return the lines of a file of TypeScript that hold code; comments fill their lines."""
    count, comment = 0, False
    for line in map(str.strip, path.read_text().splitlines()):
        comment = comment or line.startswith("/*")
        count += bool(line) and not comment and not line.startswith("//")
        comment = comment and "*/" not in line
    return count


def words(path: Path) -> int:
    """Return the words of a document."""
    return len(path.read_text().split())


def total(count: Callable[[Path], int], paths: Iterable[Path]) -> int:
    """Return the sum over files."""
    return sum(map(count, paths))


def python(folder: Path) -> int:
    return total(code_lines, folder.rglob("*.py"))


#: What is counted: how much there is, the budget and the goal.
TABLE: dict[str, tuple[Callable[[], int], int, int]] = {
    "mechanics, lines": (lambda: python(SOURCE / "mechanics"), 8_419, 8_500),
    "analytic, lines": (lambda: python(SOURCE / "analytic"), 10_485, 7_000),
    "numeric, lines": (lambda: python(SOURCE / "numeric"), 372, 450),
    "service, lines": (lambda: python(SOURCE / "service"), 5_468, 5_500),
    "top level, lines": (lambda: total(code_lines, SOURCE.glob("*.py")), 1_300, 1_300),
    "package, lines": (lambda: python(SOURCE), 26_048, 23_000),
    "package, files": (lambda: len([*SOURCE.rglob("*.py")]), 230, 230),
    "tests, lines": (lambda: python(ROOT / "tests"), 18_000, 18_000),
    "explorer, lines": (lambda: total(script_lines, EXPLORER.rglob("*.ts")), 4_769, 4_800),
    "docs, words": (
        lambda: total(words, [*(ROOT / "docs").glob("*.md"), *(ROOT / "docs").glob("reference/*")]),
        30_000,
        30_000,
    ),
    "README, words": (lambda: words(ROOT / "README.md"), 900, 900),
    "ARCHITECTURE, words": (lambda: words(ROOT / "ARCHITECTURE.md"), 900, 900),
    "CHANGELOG, words": (lambda: words(ROOT / "CHANGELOG.md"), 1_200, 1_200),
}


def row(name: str) -> str:
    count, budget, goal = TABLE[name]
    return f"{name:20} {count():7,} {budget:7,} {goal:7,}"


@pytest.mark.parametrize("name", TABLE)
def test_there_is_no_more_than_the_budget(name: str) -> None:
    count, budget, _ = TABLE[name]
    assert count() <= budget, f"\n{'':20}   there  budget    goal\n{row(name)}"


if __name__ == "__main__":
    print(f"{'':20}   there  budget    goal", *map(row, TABLE), sep="\n")
