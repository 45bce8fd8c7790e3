"""How many instructions does the processor need from a problem to its first attitude, and to one
more at t = 10⁶?

    python benchmarks/instructions.py [n ...]
    python benchmarks/instructions.py calls [n ...]

"calls" takes callgrind instead, and tells how many calls of NumPy's universal functions there are,
and what they take of it all. Needs valgrind. What other processes do on the machine changes times,
but hardly these counts: two runs agree to a percent. So they tell versions apart where times do
not. A process solves ten random problems (as in setup.py) once, then 0 or 2 times more with nothing
kept of the solutions before; the difference of the two counts belongs to the solutions alone. Takes
two minutes for n = 2 and 3 together, three for n = 4, and more beyond.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

from draws import random_problem
from veselova import Veselova, solve

PROBLEMS, ROUNDS = 10, 2

#: Counts instructions without a model of the caches, and leaves no file.
COUNTED = ["valgrind", "--tool=cachegrind", "--cache-sim=no", "--cachegrind-out-file=/dev/null"]

#: What a call of a universal function goes through, operators too.
UNIVERSAL = "ufunc_generic_fastcall"


def work(what: str, n: int, rounds: int) -> None:
    """Do what is counted: once, and so many rounds more."""
    rng = np.random.default_rng(n)
    problems = [random_problem(rng, n, 5.0) for _ in range(PROBLEMS)]
    kept = [solve(problem, [1e6]) for problem in problems]
    for k in range(rounds):
        for problem, trajectory in zip(problems, kept, strict=True):
            if what == "first":
                solve(Veselova(problem.A, problem.q, problem.q_dot), [1.0])
            else:
                trajectory.at([1e6 - 1 - k])


def instructions(what: str, n: int, rounds: int) -> int:
    """Return the instructions of a whole process."""
    command = [*COUNTED, sys.executable, __file__, "work", what, str(n), str(rounds)]
    environment = {**os.environ, "PYTHONHASHSEED": "0"}
    report = subprocess.run(
        command, env=environment, capture_output=True, text=True, check=True
    ).stderr
    found = re.search(r"I\s+refs:\s+([\d,]+)", report)
    assert found, report
    return int(found[1].replace(",", ""))


def each(what: str, n: int) -> float:
    """Return the millions of instructions of one solution or one attitude."""
    return (instructions(what, n, ROUNDS) - instructions(what, n, 0)) / (ROUNDS * PROBLEMS) / 1e6


def universal(what: str, n: int, rounds: int) -> tuple[int, int]:
    """Return the calls of universal functions in a whole process, and the
    instructions within them.
    """
    names, called, calls, within = dict[str, str](), "", 0, 0
    with tempfile.NamedTemporaryFile("r") as profile:
        command = [
            "valgrind",
            "--tool=callgrind",
            f"--callgrind-out-file={profile.name}",
            sys.executable,
            __file__,
            "work",
        ]
        environment = {**os.environ, "PYTHONHASHSEED": "0"}
        subprocess.run(
            [*command, what, str(n), str(rounds)], env=environment, capture_output=True, check=True
        )
        lines = iter(profile)
        for line in lines:
            if found := re.match(r"(c?)fn=\((\d+)\)(?: (.*))?", line):
                names.setdefault(found[2], found[3])  # a name stands where it is met first
                called = names[found[2]] if found[1] else called
            elif line.startswith("calls=") and called == UNIVERSAL:
                calls += int(line[6:].split()[0])
                # the cost of the calls is on the line after them
                within += int(next(lines).split()[1])
    return calls, within


def each_universal(what: str, n: int) -> str:
    """Return the calls in one solution or one attitude, and the millions of instructions within
    them.
    """
    some, none = universal(what, n, ROUNDS), universal(what, n, 0)
    calls, within = ((x - y) / (ROUNDS * PROBLEMS) for x, y in zip(some, none, strict=True))
    return f"{calls:.0f} calls, {within / 1e6:.2f} million"


def main(sizes: list[int]) -> None:
    print("| n | first attitude | attitude at t = 10⁶, set up |\n|---|---|---|")
    for n in sizes:
        print(
            f"| {n} | {each('first', n):.1f} million | {each('later', n):.2f} million |", flush=True
        )


if __name__ == "__main__":
    if sys.argv[1:2] == ["work"]:
        work(sys.argv[2], int(sys.argv[3]), int(sys.argv[4]))
    elif sys.argv[1:2] == ["calls"]:
        for n in sys.argv[2:] or ["3"]:
            first, later = (each_universal(what, int(n)) for what in ("first", "later"))
            print(f"n = {n}: first attitude {first}; attitude at t = 10⁶ {later}", flush=True)
    else:
        main([int(n) for n in sys.argv[1:]] or [2, 3, 4, 5, 6])
