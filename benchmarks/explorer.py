"""How long does the server take from a slider to the new motion?

    python benchmarks/explorer.py [STEPS]

Starts a server with one worker. For every example of the explorer that has a
closed form, the first number of A, or of the inertia, takes STEPS (20) other values, one after the
other, as a slider gives them. For each the requests are those of the page: the torus, then the
closed form. Two times are printed. The first is what the page waits for, the median of the client's
times. The second is the processor time of server and worker, the mean of all steps, which other
work on the machine hardly changes.
"""

from __future__ import annotations

import json
import os
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx2

PRESETS = Path(__file__).resolve().parent.parent / "explorer" / "src" / "presets.json"

#: The way of a slider, relative.
_REACH = 0.05

_TICK = os.sysconf("SC_CLK_TCK")


@contextmanager
def serving(folder: str) -> Iterator[tuple[httpx2.Client, int]]:
    """Run a server with one worker; return a client of it, and its process."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    command = [sys.executable, "-m", "veselova", "serve", "--port", str(port)]
    environment = {**os.environ, "VESELOVA_DATA_DIR": folder, "VESELOVA_WORKERS": "1"}
    server = subprocess.Popen(command, env=environment, stderr=subprocess.DEVNULL)
    try:
        with httpx2.Client(base_url=f"http://127.0.0.1:{port}", timeout=120) as client:
            while not _ready(client):
                time.sleep(0.1)
            yield client, server.pid
    finally:
        server.terminate()
        server.wait()


def _ready(client: httpx2.Client) -> bool:
    try:
        return client.get("/readyz").status_code == 200
    except httpx2.TransportError:
        return False


def processor_seconds(process: int) -> float:
    """Return the processor time that a process and its children have taken so far."""
    children = Path(f"/proc/{process}/task/{process}/children").read_text().split()
    fields = Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()
    own = (int(fields[11]) + int(fields[12])) / _TICK
    return own + sum(processor_seconds(int(child)) for child in children)


def step(problem: dict[str, Any], part: float) -> dict[str, Any]:
    """Return a problem whose first number of A, or of the inertia, has gone a part of the way."""
    name = "A" if "A" in problem else "inertia"
    first, *rest = problem[name]
    return {**problem, name: [f"{float(first) * (1 + _REACH * part):.12g}", *rest]}


def measure(
    client: httpx2.Client, process: int, problem: dict[str, Any], steps: int
) -> tuple[float, float] | None:
    """Return the median time of the client and the mean processor time, in seconds; None for a
    motion without a document.
    """
    times = []
    began = processor_seconds(process)
    for k in range(steps):
        body = {"problem": step(problem, (k + 1) / steps)}
        start = time.perf_counter()
        for path in ("/v1/tori", "/v1/closed-forms"):
            if client.post(path, json=body).status_code != 200:
                return None
        times.append(time.perf_counter() - start)
    return statistics.median(times), (processor_seconds(process) - began) / steps


def main() -> None:
    """Measure and print."""
    steps = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    print(f"{'example':>12} {'client, ms':>12} {'processor, ms':>14}")
    with tempfile.TemporaryDirectory() as folder, serving(folder) as (client, process):
        for preset in json.loads(PRESETS.read_text(encoding="utf-8")):
            problem = preset["problem"]
            if not isinstance(problem.get("A", problem.get("inertia")), list):
                continue
            measure(client, process, step(problem, 0.5), 2)  # what is loaded at first use
            found = measure(client, process, problem, steps)
            if found is not None:
                print(f"{preset['name']:>12} {1e3 * found[0]:12.0f} {1e3 * found[1]:14.0f}")


if __name__ == "__main__":
    main()
