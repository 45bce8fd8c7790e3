"""Whether a process that this one starts would run into the same call again."""

from __future__ import annotations

import ast
import sys
import threading
from pathlib import Path
from types import FrameType

__all__ = ["unguarded"]


def unguarded() -> bool:
    """Return whether the main script is in a statement that is not below ``if __name__ ==
    "__main__":``.

    A new process runs the script of the old one first. Notebooks, interactive sessions and ``python
    -c`` have no script.
    """
    main = sys.modules.get("__main__")
    path = getattr(main, "__file__", None)
    frame = sys._current_frames().get(threading.main_thread().ident or 0)
    while frame is not None and not _is_of_script(frame, main):
        frame = frame.f_back
    if path is None or frame is None:
        return False
    try:
        statements = ast.parse(Path(path).read_bytes()).body
    except (OSError, SyntaxError, ValueError):  # no file of Python: an archive, or compiled
        return False
    at_work = [
        node
        for node in statements
        if node.lineno <= frame.f_lineno <= (node.end_lineno or node.lineno)
    ]
    return bool(at_work) and not any(
        isinstance(node, ast.If) and _is_guard(node.test) for node in at_work
    )


def _is_of_script(frame: FrameType, main: object) -> bool:
    return frame.f_code.co_name == "<module>" and frame.f_globals is vars(main)


def _is_guard(test: ast.expr) -> bool:
    """Return whether a condition asks for the name of the main script."""
    names = {node.id for node in ast.walk(test) if isinstance(node, ast.Name)}
    return "__name__" in names and any(
        isinstance(node, ast.Constant) and node.value == "__main__" for node in ast.walk(test)
    )
