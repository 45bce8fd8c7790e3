"""What an installation takes: packages and megabytes of the core and of every extra.

    python benchmarks/install_size.py [EXTRA …]

Each is installed from this folder into an environment of its own, with the newest versions that the
index has. Counted are the packages besides pip, and the bytes of their files without compiled
``__pycache__``. The core must have at most 10 packages and 280 MB.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

#: What the core may take.
MOST_PACKAGES = 10
MOST_MEGABYTES = 280.0

#: What is measured where no extra is named: the empty name is the core.
EXTRAS = ("", "plot", "client", "service", "sweeps", "fast", "all")


def measure(extra: str, folder: Path) -> tuple[int, float]:
    """Return the number of packages and the megabytes of an installation."""
    environment = folder / (extra or "core")
    subprocess.run([sys.executable, "-m", "venv", environment], check=True)
    python = environment / "bin" / "python"
    requirement = f"{ROOT}[{extra}]" if extra else str(ROOT)
    settings = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    command = [str(python), "-m", "pip", "install", "--quiet", "--no-compile", requirement]
    subprocess.run(command, check=True, env=settings)
    (packages,) = environment.glob("lib/python*/site-packages")
    names = [path.name for path in packages.glob("*.dist-info") if not _is_tool(path.name)]
    files = [
        path
        for path in packages.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
        if not _is_tool(path.relative_to(packages).parts[0])
    ]
    return len(names), sum(path.stat().st_size for path in files) / 1e6


def _is_tool(name: str) -> bool:
    """Return whether an entry of site-packages belongs to what every environment has."""
    return name.split("-")[0] in ("pip", "setuptools", "pkg_resources", "_distutils_hack")


def main() -> None:
    """Print the table, and end with status 1 where the core takes more than it may."""
    chosen = [name.removeprefix("core") for name in sys.argv[1:]] or list(EXTRAS)
    print("| installed | packages | megabytes |\n|---|---|---|")
    failed = False
    with tempfile.TemporaryDirectory() as folder:
        for extra in chosen:
            count, megabytes = measure(extra, Path(folder))
            print(
                f"| {f'`{extra}`' if extra else 'core'} | {count} | {megabytes:.0f} |", flush=True
            )
            too_much = count > MOST_PACKAGES or megabytes > MOST_MEGABYTES
            failed |= not extra and too_much
    if failed:
        sys.exit(f"the core takes more than {MOST_PACKAGES} packages or {MOST_MEGABYTES:.0f} MB")


if __name__ == "__main__":
    main()
