"""Pages show the pictures that their code saves: the code of a page runs when the guide is built.

A block of Python that calls ``savefig("NAME.png")`` is followed by the picture it has made.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

_BLOCK = re.compile(r"^```python\n(.*?)^```\n", re.MULTILINE | re.DOTALL)
_SAVED = re.compile(r'savefig\("([\w-]+\.png)"\)')


def _run(code: str, root: Path, folder: Path) -> None:
    with tempfile.TemporaryDirectory() as work:
        environment = {
            **os.environ,
            "PYTHONPATH": str(root / "src"),
            "MPLBACKEND": "Agg",
            "MPLCONFIGDIR": work,
            "XDG_STATE_HOME": work,
        }
        subprocess.run(
            [sys.executable, "-c", code],
            cwd=work,
            env=environment,
            check=True,
            stdout=subprocess.DEVNULL,
        )
        folder.mkdir(parents=True, exist_ok=True)
        for name in _SAVED.findall(code):
            (folder / name).write_bytes((Path(work) / name).read_bytes())


def _show(app: Any, page: str, source: list[str]) -> None:
    blocks = [match[1] for match in _BLOCK.finditer(source[0])]
    if not page.startswith("docs/") or not any(_SAVED.search(block) for block in blocks):
        return
    root = Path(app.srcdir)
    folder = root / "build" / "guide" / "pictures" / page
    code = 'import matplotlib\nmatplotlib.rcParams["savefig.dpi"] = 150\n' + "\n".join(blocks)
    _run(code, root, folder)

    def followed(block: re.Match[str]) -> str:
        names = _SAVED.findall(block[1])
        pictures = [
            f"![The picture that this code draws]({_address(folder / name, root)})"
            for name in names
        ]
        return block[0] + "".join(f"\n{picture}\n" for picture in pictures)

    source[0] = _BLOCK.sub(followed, source[0])


def _address(path: Path, root: Path) -> str:
    return "/" + path.relative_to(root).as_posix()


def setup(app: Any) -> dict[str, bool]:
    """Connect the pictures to Sphinx."""
    app.connect("source-read", _show)
    return {"parallel_read_safe": True}
