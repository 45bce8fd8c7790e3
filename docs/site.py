"""Build the documentation, in the environment that ``docs/build`` makes."""

from __future__ import annotations

import hashlib
import os
import runpy
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

#: Where the service looks for the site; no commit has it.
BUNDLE = ROOT / "src" / "veselova" / "guide"

#: Sphinx works here, and goes on from what it did before.
WORK = ROOT / "build" / "guide"

#: What the site was built from is written here, so that it is built only when that changed.
STAMP = "built-from"

#: All that the site is made of: pages, examples, and docstrings.
INGREDIENTS = (
    "*.md",
    "docs/*",
    "docs/_*/*",
    "docs/reference/*",
    "examples/gallery/*",
    "src/veselova/**/*.py",
    "explorer/package-lock.json",
    "src/veselova/explorer/built-from",
    "requirements-docs.lock",
)


def fingerprint() -> str:
    """Return a hash of all that the site is made of."""
    digest = hashlib.sha256()
    for path in sorted({path for pattern in INGREDIENTS for path in ROOT.glob(pattern)}):
        if path.is_file() and "__pycache__" not in path.parts:
            digest.update(f"{path.relative_to(ROOT).as_posix()}\0".encode())
            digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


def is_built() -> bool:
    """Return whether the site is there, as its sources are now."""
    stamp = BUNDLE / STAMP
    return stamp.is_file() and stamp.read_text(encoding="utf-8") == fingerprint()


def prepare_katex() -> str:
    """Copy the style and the fonts of KaTeX, and return the Node that runs it."""
    build = runpy.run_path(str(ROOT / "explorer" / "build.py"))
    npm = build["find_node"]()
    if npm is None:
        sys.exit(f"The formulas need Node {build['OLDEST_NODE']} or newer in PATH.")
    source = ROOT / "explorer" / "node_modules" / "katex" / "dist"
    if not source.is_dir():
        subprocess.run(
            [*npm, "ci", "--no-audit", "--no-fund", "--ignore-scripts"],
            cwd=ROOT / "explorer",
            env={**os.environ, "PATH": f"{Path(npm[0]).parent}{os.pathsep}{os.environ['PATH']}"},
            stdout=subprocess.DEVNULL,
            check=True,
        )
    target = WORK / "static" / "katex"
    shutil.rmtree(target, ignore_errors=True)
    (target / "fonts").mkdir(parents=True)
    shutil.copy(source / "katex.min.css", target)
    for font in (source / "fonts").glob("*.woff2"):
        shutil.copy(font, target / "fonts")
    return str(npm[0])


def run_sphinx(builder: str, node: str) -> Path:
    """Run Sphinx, for which a warning is an error, and return the folder of what it made."""
    output = WORK / builder
    command = [sys.executable, "-m", "sphinx", "--builder", builder, "--fail-on-warning"]
    command += ["--keep-going", "--conf-dir", "docs"]
    command += ["--doctree-dir", str(WORK / "doctrees"), ".", str(output)]
    environment = {**os.environ, "KATEX_NODE": node, "OPENBLAS_NUM_THREADS": "1"}
    if answer := subprocess.run(command, cwd=ROOT, env=environment).returncode:
        sys.exit(answer)
    return output


def main() -> None:
    """Build the site unless it is there; with ``links``, look at the links instead."""
    if sys.argv[1:] == ["links"]:
        run_sphinx("linkcheck", prepare_katex())
        return
    if sys.argv[1:]:
        sys.exit("docs/build builds the site; docs/build links asks the sites that it links to.")
    if is_built():
        return
    sys.path.insert(0, str(ROOT / "src"))
    from veselova.motion_page import write_site

    wanted = fingerprint()
    made = run_sphinx("html", prepare_katex())
    with tempfile.TemporaryDirectory(dir=WORK) as folder:
        copy = Path(folder) / "guide"
        shutil.copytree(
            made,
            copy,
            ignore=shutil.ignore_patterns(".buildinfo", "_sources", "webpack-macros.html"),
        )
        # The explorer with its examples plays beside the guide, without a server.
        write_site(copy / "explorer")
        (copy / STAMP).write_text(wanted, encoding="utf-8")
        shutil.rmtree(BUNDLE, ignore_errors=True)
        shutil.move(copy, BUNDLE)
    print(f"The guide is built: {BUNDLE.relative_to(ROOT)}/index.html")


if __name__ == "__main__":
    main()
