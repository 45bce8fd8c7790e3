"""The house rules that a machine can hold: who imports whom, how large a room is,
what is public.
"""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import veselova

ROOT = Path(veselova.__file__).parent
REPOSITORY = Path(__file__).parent.parent
FILES = sorted(ROOT.rglob("*.py"))

#: Part → what its modules may import at module level, besides the standard library.
ALLOWED = {
    "mechanics": {"numpy", "scipy", "veselova.mechanics", "veselova.version"},
    "analytic": {
        "numpy",
        "scipy",
        "flint",
        "veselova.mechanics",
        "veselova.analytic",
        "veselova.tunings",
        "veselova.version",
    },
    "numeric": {
        "numpy",
        "scipy",
        "veselova.mechanics",
        "veselova.numeric",
        "veselova.tunings",
        "veselova.version",
    },
}

#: What may be imported inside a function, because the library is optional or slow to load.
ALLOWED_LATER = {
    # Decimals turn into numbers of the last two on request.
    "mechanics": {
        "imageio_ffmpeg",
        "matplotlib",
        "mpl_toolkits",
        "orjson",
        "pandas",
        "pyarrow",
        "xarray",
        "mpmath",
        "flint",
    },
    "analytic": {"numba"},
    "numeric": {"heyoka"},
}


def _imports(tree: ast.AST, path: Path) -> list[str]:
    names = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names.append(_source(node, path))
    return names


def _source(node: ast.ImportFrom, path: Path) -> str:
    """Return the module that names are imported from, by its full name."""
    package = path.relative_to(ROOT.parent).parent.parts
    above = package[: len(package) + 1 - node.level] if node.level else ()
    return ".".join([*above, *filter(None, [node.module])])


def _split_imports(path: Path) -> tuple[list[str], list[str]]:
    """Return the imports at module level (type-checking ones left out) and those
    inside functions.
    """
    tree = ast.parse(path.read_text())
    inner = [
        name
        for node in ast.walk(tree)
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))
        for name in _imports(node, path)
    ]
    checking = [
        name
        for node in tree.body
        if isinstance(node, ast.If)
        and isinstance(node.test, ast.Name)
        and node.test.id == "TYPE_CHECKING"
        for name in _imports(node, path)
    ]
    outer = _imports(tree, path)
    for name in inner + checking:
        outer.remove(name)
    return outer, inner


def _permitted(name: str, allowed: set[str]) -> bool:
    top = name.split(".")[0]
    if top != "veselova":
        return top in sys.stdlib_module_names or top in allowed
    return any(name == entry or name.startswith(entry + ".") for entry in allowed)


@pytest.mark.parametrize("part", sorted(ALLOWED))
def test_each_part_imports_only_what_it_may(part: str) -> None:
    for path in sorted((ROOT / part).rglob("*.py")):
        outer, inner = _split_imports(path)
        for name in outer:
            assert _permitted(name, ALLOWED[part]), f"{path.name} imports {name}"
        for name in inner:
            assert _permitted(name, ALLOWED[part] | ALLOWED_LATER[part]), (
                f"{path.name} imports {name}"
            )


#: Chapter → the chapters of its part that it may import at module level.
CHAPTERS = {
    "analytic": {
        "arithmetic": set(),
        "kernel": set(),
        "numerics": {"arithmetic"},
        "spectrum": {"arithmetic"},
        "theta": {"arithmetic"},
        "closed": {"arithmetic", "kernel", "spectrum", "theta"},
        "curve": {"arithmetic", "numerics", "spectrum"},
        "attitude": {"arithmetic", "curve", "spectrum"},
        "time_map": {"arithmetic", "attitude", "curve", "numerics", "spectrum"},
        "motion": {
            "arithmetic",
            "attitude",
            "closed",
            "curve",
            "kernel",
            "spectrum",
            "theta",
            "time_map",
        },
        "separable": {
            "arithmetic",
            "attitude",
            "curve",
            "motion",
            "numerics",
            "spectrum",
            "time_map",
        },
    },
    "mechanics": {
        "core": set(),
        "geometry": {"core"},
        "results": {"core", "geometry"},
        "bodies": {"core", "geometry"},
        "groups": {"bodies", "core", "geometry"},
        "potentials": {"core", "geometry", "groups"},
        "flows": {"bodies", "core", "geometry", "groups", "potentials"},
        "systems": {"bodies", "core", "flows", "geometry", "groups", "potentials"},
    },
    "service": {
        "api": set(),
        "observability": {"api"},
        "client": {"api"},
        "workers": {"api", "observability"},
        "access": {"api", "observability"},
        "answers": {"api", "observability", "workers"},
        "sweeps": {"access", "api", "workers"},
        "http": {"access", "answers", "api", "observability", "sweeps", "workers"},
        "cli": {"api", "http", "workers"},
    },
}


@pytest.mark.parametrize("part", sorted(CHAPTERS))
def test_each_chapter_imports_only_earlier_ones(part: str) -> None:
    chapters = CHAPTERS[part]
    folders = {
        path.name
        for path in (ROOT / part).iterdir()
        if path.is_dir() and path.name != "__pycache__"
    }
    assert folders == set(chapters)
    for number, (chapter, allowed) in enumerate(chapters.items()):
        assert allowed <= set(list(chapters)[:number]), f"{chapter} imports a later chapter"
        for path in sorted((ROOT / part / chapter).glob("*.py")):
            for name in _split_imports(path)[0]:
                words = name.split(".")
                if words[:2] == ["veselova", part] and len(words) > 2 and words[2] in chapters:
                    assert words[2] in allowed | {chapter}, f"{chapter}/{path.name} imports {name}"


#: File → what stands above it and is asked for when a method is called, by name or inside it.
UPWARD = {
    "analytic/kernel/__main__.py": {
        "veselova.analytic.closed.by_theta",
        "veselova.analytic.closed.document",
        "veselova.analytic.closed.many",
        "veselova.analytic.closed.motion",
        "veselova.analytic.closed.torus",
    },
}


def _asked_by_name(tree: ast.AST) -> list[str]:
    """Return the modules whose names are given to ``import_module``."""
    return [
        node.args[0].value
        for node in ast.walk(tree)
        if isinstance(node, ast.Call)
        and ast.unparse(node.func).endswith("import_module")
        and isinstance(node.args[0], ast.Constant)
    ]


def _stands_above(name: str, part: str, chapter: str) -> bool:
    words = name.split(".")
    if words[:2] != ["veselova", part]:
        return words[0] == "veselova" and not _permitted(name, ALLOWED[part])
    order = list(CHAPTERS.get(part, {}))
    later = order[order.index(chapter) :] if chapter in order else []
    return len(words) > 2 and words[2] in later and words[2] != chapter


def test_what_is_asked_for_upwards_is_listed() -> None:
    found: dict[str, set[str]] = {}
    for part in ALLOWED:
        for path in (ROOT / part).rglob("*.py"):
            tree = ast.parse(path.read_text())
            names = {*_split_imports(path)[1], *_asked_by_name(tree)}
            chapter = path.parent.name
            if above := {name for name in names if _stands_above(name, part, chapter)}:
                found[path.relative_to(ROOT).as_posix()] = above
    assert found == UPWARD


@pytest.mark.parametrize(
    ("library", "rooms"),
    [
        ("mpmath", set()),
        (
            "flint",
            {
                "arithmetic/balls.py",
                "closed/area.py",
                "closed/spectrum.py",
                "kernel/arithmetic_of_arb.py",
                "separable/curve.py",
                "spectrum/polynomials.py",
                "theta/lattice.py",
                "theta/many_digits.py",
                "theta/siegel_reduction.py",
                "theta/siegel_terms.py",
                "theta/siegel_theta.py",
            },
        ),
    ],
)
def test_few_files_touch_precision(library: str, rooms: set[str]) -> None:
    engine = sorted((ROOT / "analytic").rglob("*.py"))
    users = set()
    for path in FILES:
        outer, inner = _split_imports(path)
        names = [*outer, *inner] if path in engine else outer
        if library in {name.split(".")[0] for name in names}:
            users.add(path)
    assert users == {ROOT / "analytic" / room for room in rooms}
    assert not [
        path for path in FILES if path not in users and f"{library}.mp." in path.read_text()
    ]


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
    answer = subprocess.run(
        [sys.executable, "-c", f"{statement}; {check}"], capture_output=True, text=True, check=True
    )
    assert answer.stdout.strip() == "[]"


def _loaded_by(statement: str) -> set[str]:
    """Return the modules of no standard library that a statement loads, those of other packages by
    their first names.
    """
    check = (
        "import sys; print(*[m for m in sys.modules if m.startswith('veselova.')], "
        "*{m.split('.')[0] for m in sys.modules})"
    )
    answer = subprocess.run(
        [sys.executable, "-c", f"{statement}\n{check}"], capture_output=True, text=True, check=True
    )
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


def _module(path: Path) -> str:
    return ".".join(path.relative_to(ROOT.parent).with_suffix("").parts).removesuffix(".__init__")


def _imported_files(path: Path, modules: set[str]) -> set[str]:
    """Return the modules of the package that a file imports anywhere, under TYPE_CHECKING and
    inside functions too.
    """
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            source = _source(node, path)
            full = {f"{source}.{alias.name}" for alias in node.names}
            found |= full & modules or {source}
    return found & modules - {_module(path)}


def test_the_kernel_needs_nothing_but_arrays_and_balls() -> None:
    # It is executed over another arithmetic too: whatever else it imported would be shared.
    for path in (ROOT / "analytic" / "kernel").glob("[!_]*.py"):
        own = {"numpy", "numba", "flint"} if "arithmetic" in path.name else {"numpy", "numba"}
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and node.level == 0:
                folders = {"veselova.mechanics.core.folders"} if path.name == "compiler.py" else ()
                assert not (node.module or "").startswith("veselova") or node.module in folders
        for name in {*_split_imports(path)[0], *_split_imports(path)[1]}:
            allowed = own | {"veselova.analytic.kernel", "veselova.mechanics.core.folders"}
            assert _permitted(name, allowed), f"{path.name}: {name}"


def test_no_file_imports_itself_by_way_of_others() -> None:
    modules = {_module(path) for path in FILES}
    remaining = {_module(path): _imported_files(path, modules) for path in FILES}
    # A file that imports none of those left is in no circle.
    while leaves := [name for name, imports in remaining.items() if not imports & set(remaining)]:
        for name in leaves:
            del remaining[name]
    assert not remaining


#: Words that are no terms of numerical analysis, mechanics or HTTP, and so name nothing here.
PRIVATE = """
    bells clock crossings counts_as_one delivery displaced drawn_apart enclosed filling
    fourier_clock grown guarded hidden horizon left_by noted panel_clock pieces settled steepness
    stretch survey track turned twofold waves whole_file widened around_zero at_most along_axes
"""

#: Names that a contract fixes: a field of closed-form documents; an alias of ``time_map``.
CONTRACTS = {"closed_form_schema.py": {"waves"}, "solve.py": {"clock"}}


def test_no_name_is_a_private_word() -> None:
    private = set(PRIVATE.split())
    for path in FILES:
        names = set()
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
                names.add(node.name)
            elif isinstance(node, ast.arg):
                names.add(node.arg)
            elif isinstance(node, ast.Attribute):
                names.add(node.attr)
            elif isinstance(node, ast.Name):
                names.add(node.id)
        found = {name for name in names if name.strip("_").lower() in private}
        found -= CONTRACTS.get(path.name, set())
        assert not found, f"{path.name} names {sorted(found)}"


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


def test_tunings_stand_in_one_file_beside_what_measures_them() -> None:
    path = ROOT / "tunings.py"
    lines = path.read_text().splitlines()
    code = {other: other.read_text() for other in FILES if other != path}
    assert not [other for other, text in code.items() if "#: Tuning" in text]
    scripts: set[str] = set()
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.Assign):
            assert _kind(lines, node).startswith("Tuning: ")
            name = ast.unparse(node.targets[0])
            assert any(
                f"    {name},\n" in text or f"import {name}" in text or f", {name}" in text
                for text in code.values()
            ), f"nothing reads {name}"
            headings = [line for line in lines[: node.lineno] if line.startswith("# ---")]
            script = next(word for word in headings[-1].split() if word.startswith("benchmarks/"))
            scripts.add(script)
            if script.endswith("/tunings.py"):
                assert f'"{name}": ' in (REPOSITORY / script).read_text(), name
    assert all((REPOSITORY / script).is_file() for script in scripts)
