"""What ``vs.solve(problem, [7.0])`` enters, and how long its text takes to compile.

    python benchmarks/path.py      two minutes

Functions and files of the package that one solve of a new body enters, n = 4, once a process is
warm; seconds to import and solve in a new process, with machine code at hand, the median of five;
seconds to compile all of the text, into an empty folder.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from types import FrameType
from typing import Any

import veselova as vs

HERE = str(Path(vs.__file__).parent)
FIRST = """
import veselova as vs
vs.solve(vs.Veselova([3, 2, 1.5, 1], [0.5] * 4, [0.3, -0.3, 0.1, -0.1]), [7.0])
"""


def entered(speed: float) -> set[tuple[str, str]]:
    """Return the files and functions that the solution of one problem enters."""
    problem = vs.Veselova([3, 2, 1.5, 1], [0.5] * 4, [0.3, -0.3, speed, -speed])
    found = set[tuple[str, str]]()

    def note(frame: FrameType, event: str, _: Any) -> None:
        code = frame.f_code
        if event == "call" and code.co_filename.startswith(HERE):
            found.add((code.co_filename, code.co_qualname))

    sys.setprofile(note)
    vs.solve(problem, [7.0])
    sys.setprofile(None)
    return found


def seconds(*arguments: str, **environment: str) -> float:
    """Return how long a new Python takes."""
    began = time.perf_counter()
    command = [sys.executable, *arguments]
    subprocess.run(command, env=os.environ | environment, stderr=subprocess.DEVNULL, check=True)
    return time.perf_counter() - began


def main() -> None:
    entered(0.1)
    found = entered(0.2)
    print(f"solve enters {len(found)} functions in {len({file for file, _ in found})} files")
    first = statistics.median(seconds("-c", FIRST) for _ in range(5))
    print(f"import and first solve in a new process: {first:.2f} s")
    with tempfile.TemporaryDirectory() as folder:
        spent = seconds("-m", "veselova.analytic.kernel", NUMBA_CACHE_DIR=folder)
    print(f"compiling: {spent:.0f} s")


if __name__ == "__main__":
    main()
