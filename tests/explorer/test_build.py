"""The build of the explorer: one at a time in a checkout."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from explorer_bundle import EXPLORER

from loading import load_file

#: A build in a folder of its own, whose npm writes when it begins and ends.
SCRIPT = """
import importlib.util, sys, time
from pathlib import Path

spec = importlib.util.spec_from_file_location("explorer_build", sys.argv[1])
build = importlib.util.module_from_spec(spec)
spec.loader.exec_module(build)
build.SOURCE = Path(sys.argv[2])
build.LOCK = build.SOURCE / "build-lock"
build.BUNDLE = build.SOURCE / "bundle"
build.find_node = lambda: ["node"]

def run(npm, *arguments, EXPLORER_OUTPUT=None):
    with (build.SOURCE / "log").open("a") as log:
        print(arguments[0], "begins", file=log, flush=True)
        time.sleep(0.4)
        print(arguments[0], "ends", file=log, flush=True)
    if EXPLORER_OUTPUT:
        (Path(EXPLORER_OUTPUT) / "explorer").mkdir(parents=True)

build._run = run
print(sys.argv[3], flush=True)
sys.stdin.readline()
sys.exit(build.build())
"""


def checkout(folder: Path) -> Path:
    """Make the files of a checkout that a build looks at."""
    (folder / "src").mkdir()
    (folder / "package-lock.json").write_text("{}")
    (folder / "package.json").write_text(json.dumps({"dependencies": {}}))
    (folder / "src" / "main.ts").write_text("export {};")
    (folder / "src" / "presets.json").write_text("[]")
    return folder


def test_two_builds_in_one_checkout_come_one_after_the_other(tmp_path: Path) -> None:
    folder = checkout(tmp_path)
    command = [sys.executable, "-c", SCRIPT, str(EXPLORER / "build.py"), str(folder)]
    processes = [
        subprocess.Popen(
            [*command, f"process {k}"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        for k in range(2)
    ]
    for process in processes:  # both have started
        assert process.stdout
        assert process.stdout.readline().startswith("process")
    for process in processes:
        assert process.stdin
        process.stdin.write("\n")
        process.stdin.flush()
    assert [process.wait(timeout=60) for process in processes] == [0, 0]
    for process in processes:
        process.communicate()
    # The second one found the bundle of the first.
    lines = (folder / "log").read_text().splitlines()
    assert lines == ["ci begins", "ci ends", "run begins", "run ends"]
    assert (folder / "bundle" / "built-from").exists()


def test_a_build_that_was_killed_holds_nothing_up(tmp_path: Path) -> None:
    folder = checkout(tmp_path)
    build = load_file(EXPLORER / "build.py")
    build.LOCK = folder / "build-lock"
    holder = subprocess.Popen(
        [
            sys.executable,
            "-c",
            "import importlib.util, sys, time\n"
            "from pathlib import Path\n"
            "spec = importlib.util.spec_from_file_location('explorer_build', sys.argv[1])\n"
            "build = importlib.util.module_from_spec(spec)\n"
            "spec.loader.exec_module(build)\n"
            "build.LOCK = Path(sys.argv[2])\n"
            "with build._alone():\n"
            "    print('held', flush=True)\n"
            "    time.sleep(60)\n",
            str(EXPLORER / "build.py"),
            str(build.LOCK),
        ],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert holder.stdout
    assert holder.stdout.readline() == "held\n"
    with build.LOCK.open("a+b") as file:
        assert not build._lock(file.fileno())
    holder.kill()
    holder.communicate()
    with build._alone():
        pass
