"""The package as it is built and installed: the same files everywhere, every import declared, the
core by itself.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

from conftest import interpreter
from loading import load_file
from test_architecture import imports

ROOT = Path(__file__).parent.parent
SOURCE = ROOT / "src" / "veselova"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
EXTRAS = PROJECT["optional-dependencies"]

#: An unpacked sdist is no repository: it has neither links nor history.
in_the_repository = pytest.mark.skipif(not (ROOT / ".git").exists(), reason="needs the repository")


def _name(requirement: str) -> str:
    return re.split(r"[\[<>=!~; ]", requirement)[0].lower().replace("_", "-")


def _libraries(extra: str | None) -> set[str]:
    """Return the libraries that the core installs, or the core with an extra."""
    found = {_name(entry) for entry in PROJECT["dependencies"]}
    for entry in EXTRAS[extra] if extra else ():
        if _name(entry) == "veselova":
            for other in entry[entry.index("[") + 1 : entry.index("]")].split(","):
                found |= _libraries(other.strip())
        else:
            found.add(_name(entry))
    return found


def _files(folder: Path) -> set[str]:
    paths = (
        path for path in folder.rglob("*") if path.is_file() and "__pycache__" not in path.parts
    )
    return {str(path.relative_to(folder)) for path in paths}


def _third_party(path: Path) -> set[str]:
    """Return the packages of others that a file imports anywhere but under TYPE_CHECKING."""
    names = {name.split(".")[0] for name in imports(path)}
    return names - set(sys.stdlib_module_names) - {"veselova", "__future__"}


@pytest.fixture(scope="module")
def sdist(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of an unpacked sdist."""
    from hatchling.builders.sdist import SdistBuilder

    folder = tmp_path_factory.mktemp("sdist")
    (archive,) = SdistBuilder(str(ROOT)).build(directory=str(folder))
    with tarfile.open(archive) as files:
        files.extractall(folder, filter="data")
    return next(path for path in folder.iterdir() if path.is_dir())


@pytest.fixture(scope="module")
def wheel(sdist: Path) -> Path:
    """Return the wheel that is made of the sdist, as ``python -m build`` makes it."""
    from hatchling.builders.wheel import WheelBuilder

    (path,) = WheelBuilder(str(sdist)).build(directory=str(sdist.parent), versions=["standard"])
    return Path(path)


@in_the_repository
def test_the_sdist_is_the_repository(sdist: Path) -> None:
    listed = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.split("\0")
    tracked = {name for name in listed if name and (ROOT / name).is_file()}
    assert _files(sdist) - {"PKG-INFO"} >= tracked
    assert all(os.access(sdist / name, os.X_OK) for name in ("run", "check", ".ci/run", ".ci/lock"))


def test_the_wheel_made_of_the_sdist_has_every_file_of_the_source(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as files:
        names = {name for name in files.namelist() if name.startswith("veselova/")}
        texts = {name: files.read(name) for name in names}
    assert names == {f"veselova/{name}" for name in _files(SOURCE)}
    assert all(text == (SOURCE.parent / name).read_bytes() for name, text in texts.items())
    assert {name.split("/")[1] for name in names} >= {
        "analytic",
        "numeric",
        "service",
        "mechanics",
        "migrations",
    }


def _description(wheel: Path) -> str:
    with zipfile.ZipFile(wheel) as files:
        (name,) = (name for name in files.namelist() if name.endswith(".dist-info/METADATA"))
        return files.read(name).decode()


_RELATIVE = re.compile(r"\]\((?![a-z]+:|#)")


def test_the_readme_of_a_package_has_no_relative_link(wheel: Path) -> None:
    metadata = _description(wheel)
    assert "Description-Content-Type: text/markdown" in metadata
    assert "(Ω,γ) = 0" in metadata
    assert not _RELATIVE.search(metadata)
    assert "docs/python.md goes on from here" in metadata


def test_links_of_the_readme_lead_to_the_tag_where_the_repository_is_known() -> None:
    module = load_file(ROOT / ".ci" / "readme.py")
    text = (ROOT / "README.md").read_text()
    found = module.standalone(text, "https://example.org/us/veselova/", "1.2")
    assert not _RELATIVE.search(found)
    base = "https://example.org/us/veselova"
    assert f"[docs/python.md]({base}/blob/v1.2/docs/python.md)" in found
    assert f"]({base}/raw/v1.2/docs/explorer.png)" in found
    links = re.findall(re.escape(base) + r"/(?:blob|raw)/v1\.2/([\w./-]+)", found)
    assert len(links) > 20
    assert all((ROOT / name).is_file() for name in links)
    assert "arxiv.org" in found
    assert "docs/explorer.png" not in module.standalone(text, "", "1.2")


#: Folder of the source → the extra that brings what it imports at module level; None is the core.
CHAPTERS = {
    "": None,
    "mechanics": None,
    "analytic": None,
    "numeric": None,
    "service": "service",
    "migrations": "service",
}


@pytest.mark.daily(3)
@pytest.mark.parametrize("folder", sorted(CHAPTERS))
def test_every_library_that_is_imported_is_declared(folder: str) -> None:
    distributions = packages_distributions()
    # What is imported at a call may be of any extra, or is named by the error that says that it is
    # missing.
    declared = _libraries(CHAPTERS[folder]) | _libraries("all")
    for path in sorted((SOURCE / folder).rglob("*.py")):
        for module in _third_party(path):
            names = {_name(name) for name in distributions.get(module, [module])}
            assert names & declared, (
                f"{path.name} imports {module}, which no extra of pyproject.toml declares"
            )


def test_the_core_is_the_two_engines_alone() -> None:
    assert _libraries(None) == {"mpmath", "numba", "numpy", "orjson", "python-flint", "scipy"}
    assert set(EXTRAS) == {
        "all",
        "client",
        "docs",
        "fast",
        "film",
        "notebook",
        "plot",
        "service",
        "sweeps",
        "telemetry",
        "test",
    }
    assert "matplotlib" in _libraries("notebook") & _libraries("film")
    assert _libraries("all") == set.union(
        *(_libraries(extra) for extra in EXTRAS if extra not in ("all", "docs", "test"))
    )


#: Run by the interpreter of an environment in which libraries seem not to be installed.
_WITHOUT = """
import sys
class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {missing!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
sys.meta_path.insert(0, Missing())
"""


def _without(extra: str | None, statement: str) -> subprocess.CompletedProcess[str]:
    """Run a statement where nothing is installed but the core, with an extra."""
    kept = _libraries(extra)
    everything = packages_distributions()
    missing = {
        module for module, names in everything.items() if not {_name(name) for name in names} & kept
    }
    # What the libraries that are kept need themselves stays.
    declared = _libraries("all")
    missing = {
        module for module in missing if {_name(name) for name in everything[module]} & declared
    }
    source = _WITHOUT.format(missing=missing) + statement
    return interpreter("-c", source)


BODY = "problem = vs.Veselova([3, 2, 1], [0.6, 0, 0.8], [0.8, 1, -0.6])\n"


@pytest.mark.daily(3)
def test_the_core_solves_by_both_engines() -> None:
    statement = f"""import veselova as vs
{BODY}
trajectory = vs.solve(problem, [0, 1, 1e6])
trajectory.to_csv("{os.devnull}")
many = vs.solve(problem, ["0.1"], digits=30).decimals
print(vs.compare(problem, [0, 1]).agrees, vs.torus(problem).n, many.strings("q"))
"""
    answer = _without(None, statement)
    assert answer.returncode == 0, answer.stderr
    assert answer.stdout.startswith("True 3 ")


@pytest.mark.daily(4)
@pytest.mark.parametrize(
    ("statement", "library", "advice"),
    [
        ("vs.Client()", "", "[client]"),
        ("vs.AsyncClient()", "", "[client]"),
        ("vs.sweep(problem, {'/A/0': [3, 4]})", "", "[sweeps]"),
        ("vs.solve(problem, [1]).plot()", "matplotlib", "matplotlib"),
        ("vs.solve(problem, [1]).view()", "anywidget", "[notebook]"),
        ("vs.solve(problem, [1]).to_xarray()", "xarray", "xarray"),
        ("vs.solve(problem, [1]).to_parquet('motion.parquet')", "pyarrow", "pyarrow"),
        ("vs.solve(problem, [1], 'numeric', 'taylor')", "heyoka", "heyoka"),
    ],
)
def test_a_missing_library_is_named_with_what_installs_it(
    statement: str, library: str, advice: str, tmp_path: Path
) -> None:
    caught = f"""import os, veselova as vs
os.chdir({str(tmp_path)!r})
{BODY}
try:
    {statement}
except vs.BackendMissing as error:
    print(error.library, "|", error)
"""
    answer = _without(None, caught)
    assert answer.returncode == 0, answer.stderr
    name, message = answer.stdout.strip().split(" | ")
    assert library in name
    assert "pip install" in message
    assert advice in message


def test_the_command_line_says_what_it_needs() -> None:
    for extra in (None, "client"):
        answer = _without(
            extra, "sys.argv = ['veselova', 'demo']\nfrom veselova.__main__ import main\nmain()"
        )
        assert answer.returncode == 1
        assert answer.stderr.startswith("veselova: the command line needs ")
        assert f"pip install '{ROOT}[service]'" in answer.stderr
        assert "Traceback" not in answer.stderr


@pytest.mark.daily(3)
def test_the_client_needs_its_own_extra_alone() -> None:
    answer = _without("client", "import veselova as vs\nvs.Client().close()\nprint('made')")
    assert answer.stdout.strip() == "made", answer.stderr


@pytest.mark.daily(3)
def test_the_server_needs_no_sweeps() -> None:
    statement = (
        "from veselova.service.http.app import create_app\nfrom "
        "veselova.service.api.settings import Settings\nprint(create_app)"
    )
    answer = _without("service", statement)
    assert answer.returncode == 0, answer.stderr


#: The environment of processes that are to see what they have installed, and nothing else.
_CLEAN = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}


def _pip(environment: Path, *arguments: str) -> None:
    command = [environment / "bin" / "python", "-m", "pip", "install", "--quiet", *arguments]
    subprocess.run(command, check=True, timeout=900, env=_CLEAN)


@pytest.mark.slow
def test_the_wheel_works_in_an_empty_environment(wheel: Path, tmp_path: Path) -> None:
    environment = tmp_path / "environment"
    subprocess.run([sys.executable, "-m", "venv", environment], check=True, timeout=120)
    python = environment / "bin" / "python"

    def run(*command: str | Path) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            command, cwd=tmp_path, env=_CLEAN, capture_output=True, text=True, timeout=300
        )

    _pip(environment, str(wheel))
    solved = run(
        python, "-c", f"import veselova as vs\n{BODY}print(vs.compare(problem, range(5)).agrees)"
    )
    assert solved.stdout.strip() == "True", solved.stderr
    installed = run(python, "-m", "pip", "list", "--format=freeze").stdout.splitlines()
    names, theirs = {_name(line) for line in installed}, {"pip", "setuptools", "llvmlite"}
    assert names - theirs - {"veselova"} == _libraries(None)
    refused = run(environment / "bin" / "veselova", "demo").stderr
    advised = re.search(r"pip install '(.*)'", refused)
    assert advised, refused
    assert advised[1] == "veselova[service]"
    _pip(environment, advised[1])
    demo = run(environment / "bin" / "veselova", "demo")
    assert demo.returncode == 0, demo.stderr


def _locked(name: str) -> set[str]:
    return {
        package.lower()
        for package in re.findall(r"^([\w.-]+)==", (ROOT / name).read_text(), re.MULTILINE)
    }


def test_the_container_has_no_package_under_the_gpl() -> None:
    tables = load_file(ROOT / "docs" / "_extensions" / "guide_tables.py")
    rows = dict(re.findall(r"^\| ([\w.-]+) \| (.+?) \|$", tables.licences(), re.MULTILINE)[1:])
    assert _locked("requirements.lock") <= {name.lower() for name in rows}
    for package, licence in rows.items():
        # The container is given away: the GPL would bind what it is combined with.
        assert licence != "not stated", package
        assert not re.search(r"\bA?GPL", licence), package


def test_the_container_takes_a_base_by_digest_and_every_hook_of_the_build() -> None:
    source = (ROOT / "Dockerfile").read_text()
    assert re.findall(r"^FROM (\S+)", source, re.MULTILINE) == ["${BASE}", "${BASE}"]
    assert re.search(r"^ARG BASE=python:[\w.-]+@sha256:[0-9a-f]{64}$", source, re.MULTILINE)
    for hook in re.findall(r'(?m)^path = "([^/]+)', (ROOT / "pyproject.toml").read_text()):
        assert f"COPY {hook}" in source
