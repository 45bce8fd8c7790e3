"""The house rules that a machine can hold: who imports whom, how large a room is,
what is public.
"""

from __future__ import annotations

import ast
import re
import sys
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import veselova
from conftest import interpreter

ROOT = Path(veselova.__file__).parent
REPOSITORY = Path(__file__).parent.parent
FILES = sorted(ROOT.rglob("*.py"))

#: Part → the libraries and the other parts that its files may import, besides the standard library.
PARTS = {
    "mechanics": (
        "flint imageio_ffmpeg matplotlib mpl_toolkits mpmath numpy orjson pandas pyarrow scipy "
        "xarray",
        "mechanics version",
    ),
    "analytic": ("flint numba numpy scipy", "mechanics analytic tunings version"),
    "numeric": ("heyoka numpy scipy", "mechanics numeric tunings version"),
}

#: Part → its chapters, lowest first: each may import those before it.
CHAPTERS = {
    "analytic": "arithmetic kernel geodesics theta curve time_map closed digits separable",
    "mechanics": "core geometry results bodies groups potentials flows systems",
    "service": "api observability client workers access sweeps http cli",
}

#: What compiles the kernel solves a motion of every kind: by ``closed`` and ``curve``.
UPWARD = {"veselova.analytic.kernel.__main__": ("veselova.analytic.c", "veselova.geodesics")}


def _module(path: Path) -> str:
    return ".".join(path.relative_to(ROOT.parent).with_suffix("").parts).removesuffix(".__init__")


@cache
def imports(path: Path, *, later: bool = True) -> set[str]:
    """Return the modules that a file imports, but those under TYPE_CHECKING: at its top, and inside
    functions and by ``import_module`` with ``later``.
    """
    tree, names = ast.parse(path.read_text()), set()
    skipped = {
        node
        for block in ast.walk(tree)
        if (isinstance(block, ast.If) and ast.unparse(block.test) == "TYPE_CHECKING")
        or (not later and isinstance(block, (ast.FunctionDef, ast.AsyncFunctionDef)))
        for node in ast.walk(block)
    }
    for node in ast.walk(tree):
        if node in skipped:
            continue
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            package = path.relative_to(ROOT.parent).parent.parts
            above = package[: len(package) + 1 - node.level] if node.level else ()
            source = ".".join([*above, *filter(None, [node.module])])
            names |= {source, *(f"{source}.{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith("import_module"):
            names |= {arg.value for arg in node.args[:1] if isinstance(arg, ast.Constant)}
    return names


@pytest.mark.parametrize("part", PARTS)
def test_each_part_imports_only_what_it_may(part: str) -> None:
    libraries, parts = (set(names.split()) for names in PARTS[part])
    for path in (ROOT / part).rglob("*.py"):
        for name in imports(path):
            top, *rest = name.split(".")
            own = top == "veselova" and (not rest or rest[0] in parts)
            known = top in libraries or top in sys.stdlib_module_names
            upward = name.startswith(UPWARD.get(_module(path), " "))
            assert own or known or upward, f"{path} imports {name}"


@pytest.mark.parametrize("part", CHAPTERS)
def test_each_chapter_imports_only_earlier_ones(part: str) -> None:
    chapters = CHAPTERS[part].split()
    assert {path.parent.name for path in (ROOT / part).glob("*/*.py")} == set(chapters)
    for number, chapter in enumerate(chapters):
        for path in (ROOT / part / chapter).glob("*.py"):
            for name in imports(path, later=part != "service"):
                place, _, found = name.removeprefix("veselova.").partition(".")
                if place == part and found.split(".")[0] in chapters[number + 1 :]:
                    assert name.startswith(UPWARD.get(_module(path), " ")), f"{path} imports {name}"


def test_no_file_imports_itself_by_way_of_others() -> None:
    modules = {_module(path) for path in FILES}
    remaining = {_module(path): imports(path) & modules - {_module(path)} for path in FILES}
    # A file that imports none of those left is in no circle.
    while leaves := [name for name, imports in remaining.items() if not imports & set(remaining)]:
        for name in leaves:
            del remaining[name]
    assert not remaining


def test_the_kernel_needs_nothing_but_arrays_and_balls() -> None:
    """It is executed over another arithmetic too: whatever else it imported would be shared."""
    known = {"numpy", "numba", "flint", *sys.stdlib_module_names}
    for path in (ROOT / "analytic" / "kernel").glob("[!_]*.py"):
        for name in imports(path):
            if name.startswith("veselova"):
                assert name.startswith(("veselova.analytic.kernel", "veselova.mechanics.core.fold"))
            else:
                assert name.split(".")[0] in known, f"{path.name} imports {name}"


def test_compiled_text_without_counts_of_references_calls_none_that_makes_arrays() -> None:
    files = [*ROOT.glob("analytic/kernel/[!_]*.py"), *ROOT.glob("analytic/geodesics/*.py")]
    text = "".join(path.read_text() + "\n\n\n" for path in files)
    making = set(re.findall(r"^@jit_making\ndef (\w+)", text, re.M))
    for name, body in re.findall(r"^@jit(?:_sum)?\ndef (\w+)(.*?)\n\n\n", text, re.M | re.S):
        assert not making & set(re.findall(r"(\w+)\(", body)), name


def test_files_fit_on_a_few_screens_and_functions_do_one_thing() -> None:
    for path in FILES:
        tree = ast.parse(path.read_text())
        imports = [node for node in tree.body if isinstance(node, (ast.Import, ast.ImportFrom))]
        lines = path.read_text().count("\n") - sum(map(_lines, imports))
        assert lines <= 400, f"{path.relative_to(ROOT)} has {lines} lines besides its imports"
        for node in ast.walk(tree):
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
                docstring = node.body[0] if ast.get_docstring(node) else None
                lines = _lines(node) - (0 if docstring is None else _lines(docstring))
                assert lines <= 60, f"{path.name}: {node.name} is too long"


def _lines(node: ast.stmt) -> int:
    return (node.end_lineno or 0) - node.lineno + 1


def test_folders_are_at_most_three_deep() -> None:
    assert all(len(path.relative_to(ROOT).parts) <= 3 for path in FILES)


def test_the_parts_stand_at_the_front_door() -> None:
    for part in ("analytic", "numeric", "service"):
        link = REPOSITORY / part
        assert link.is_symlink()
        assert link.resolve() == (ROOT / part).resolve()


def test_every_public_name_exists_and_is_documented() -> None:
    assert veselova.__all__ == ["__version__", *sorted(veselova.__all__[1:])]
    for name in veselova.__all__:
        value = getattr(veselova, name)
        assert name == "__version__" or value.__doc__, name
    assert dir(veselova) == sorted(veselova.__all__)
    with pytest.raises(AttributeError):
        _ = veselova.no_such_name  # type: ignore[attr-defined]


def test_the_example_of_help_runs_as_printed() -> None:
    lines = str(veselova.__doc__).splitlines()
    names: dict[str, Any] = {}
    exec("\n".join(line.removeprefix("    ") for line in lines if line.startswith("    ")), names)
    assert names["trajectory"].frame.shape == (3, 4, 4)
    assert names["trajectory"].error.shape == (3,)


def test_every_module_and_public_function_has_a_docstring() -> None:
    for path in FILES:
        tree = ast.parse(path.read_text())
        assert ast.get_docstring(tree), path
        for node in tree.body:
            if isinstance(node, (ast.FunctionDef, ast.ClassDef)) and not node.name.startswith("_"):
                assert ast.get_docstring(node), f"{path.name}: {node.name}"


@pytest.mark.parametrize(
    "statement",
    [
        "import veselova; veselova.Client; veselova.AsyncClient",
        "import veselova.service.api.request_models",
    ],
)
def test_client_and_schemas_load_neither_engine(statement: str) -> None:
    engines = "('veselova.analytic', 'veselova.numeric', 'scipy', 'mpmath')"
    check = f"import sys; print([m for m in sys.modules if m.startswith({engines})])"
    assert interpreter("-c", f"{statement}; {check}", check=True).stdout.strip() == "[]"


def _loaded_by(statement: str) -> set[str]:
    """Return the modules of no standard library that a statement loads, those of other packages by
    their first names.
    """
    check = (
        "import sys; print(*[m for m in sys.modules if m.startswith('veselova.')], "
        "*{m.split('.')[0] for m in sys.modules})"
    )
    answer = interpreter("-c", f"{statement}\n{check}", check=True)
    return set(answer.stdout.splitlines()[-1].split()) - set(sys.stdlib_module_names)


def test_importing_the_package_loads_no_part_and_no_library() -> None:
    bare = _loaded_by("pass")  # what the environment loads into every process
    assert _loaded_by("import veselova; dir(veselova)") - bare == {"veselova", "veselova.version"}


def test_a_problem_loads_neither_scipy_nor_what_draws() -> None:
    loaded = _loaded_by("import veselova; veselova.Veselova([3, 2, 1], [1, 0, 0], [0, 1, 1])")
    assert "numpy" in loaded
    assert not loaded & {
        "scipy",
        "mpmath",
        "flint",
        "heyoka",
        "matplotlib",
        "pydantic",
        "veselova.engines",
    }


def test_a_first_answer_loads_no_integrator_and_no_mpmath() -> None:
    statement = "import veselova as vs; p = vs.Veselova([3, 2, 1], [0.6, 0, 0.8], [0, 1, 0])"
    loaded = _loaded_by(f"{statement}; vs.solve(p, [0, 1])")
    assert "veselova.analytic.solve" in loaded
    # numba looks for scipy, and takes none of it
    assert not loaded & {"scipy.integrate", "mpmath", "heyoka", "matplotlib", "pydantic"}


@pytest.mark.parametrize("command", [[], ["solve"]])
def test_help_loads_no_more_than_the_command_line(command: list[str]) -> None:
    statement = (
        f"import sys; sys.argv = ['veselova', *{command}, '--help']\nfrom "
        "veselova.service.cli import main as cli\n"
    )
    loaded = _loaded_by(statement + "try:\n    cli.main()\nexcept SystemExit:\n    pass")
    assert "typer" in loaded
    mechanics = {name for name in loaded if name.startswith("veselova.mechanics.")}
    assert mechanics == {f"veselova.mechanics.core{name}" for name in ("", ".errors", ".folders")}
    libraries = {
        "numpy",
        "scipy",
        "mpmath",
        "matplotlib",
        "starlette",
        "fastapi",
        "httpx2",
        "sqlalchemy",
        "distributed",
    }
    assert not loaded & (libraries | {"veselova.analytic", "veselova.numeric", "veselova.engines"})


#: What the comment of a constant begins with; CONVENTIONS.md says what each means.
KINDS = ("Derived: ", "Calibrated: ", "Budget: ", "Method: ")


def _is_number(node: ast.expr | None) -> bool:
    if isinstance(node, ast.UnaryOp):
        return _is_number(node.operand)
    if isinstance(node, ast.BinOp):
        return _is_number(node.left) and _is_number(node.right)
    return isinstance(node, ast.Constant) and type(node.value) in (int, float)


def _kind(lines: list[str], node: ast.stmt) -> str:
    """Return the first line of the comment of a constant."""
    place = node.lineno - 2
    while not lines[place].startswith("#:"):  # constants with one comment stand together
        assert lines[place].strip(), f"line {node.lineno} has no comment"
        place -= 1
    while lines[place - 1].startswith("#:"):
        place -= 1
    return lines[place].removeprefix("#: ")


def test_constants_of_the_engines_say_of_what_kind_they_are() -> None:
    for path in FILES:
        if not {"analytic", "numeric"} & set(path.parts):
            continue
        lines = path.read_text().splitlines()
        for node in ast.parse(path.read_text()).body:
            if isinstance(node, (ast.Assign, ast.AnnAssign)) and _is_number(node.value):
                assert _kind(lines, node).startswith(KINDS), f"{path.name}:{node.lineno}"
