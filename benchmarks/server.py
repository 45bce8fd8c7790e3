"""How much memory does an idle server hold, and what does a request cost beyond the solve?

    python benchmarks/server.py

Starts a server with one worker, then POSTs four-dimensional bodies, q at 100 times and the frame at 1000; time beyond the solve
is the time of the whole request, measured by the client on the same machine, less the seconds that the engine reports.
"""

from __future__ import annotations

import os
import signal
import socket
import statistics
import subprocess
import sys
import time
from pathlib import Path

import httpx2

from veselova.service.examples import BODY4_PROBLEM


def resident_megabytes(pid: int) -> float:
    line = next(line for line in Path(f"/proc/{pid}/status").read_text().splitlines() if line.startswith("VmRSS"))
    return float(line.split()[1]) / 1024


def compare(client: httpx2.Client, count: int, outputs: list[str]) -> None:
    """Print what a request costs beyond the solve; every body is another one, so that no answer comes from the cache."""
    beyond, whole = [], []
    for k in range(60):
        problem = {**BODY4_PROBLEM, "A": [3 + k / 100, 2, "1.5", 1]}
        body = {"problem": problem, "times": {"start": 0, "stop": 10, "count": count}, "outputs": outputs}
        began = time.perf_counter()
        response = client.post("/v1/trajectories", json=body)
        seconds = time.perf_counter() - began
        whole.append(seconds)
        beyond.append(seconds - response.json()["provenance"]["seconds"])
    size, request, rest = len(response.content) / 1e3, statistics.median(whole), statistics.median(beyond)
    print(f"{outputs[0]} at {count} times, n = 4: {size:.0f} kB, whole request {request * 1e3:.1f} ms (median of 60),")
    print(f"  beyond the solve {rest * 1e3:.1f} ms (largest {max(beyond) * 1e3:.1f} ms)")


def main() -> None:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    command = [sys.executable, "-m", "veselova", "serve", "--port", str(port)]
    environment = {**os.environ, "VESELOVA_WORKERS": "1"}
    process = subprocess.Popen(command, env=environment, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    url = f"http://127.0.0.1:{port}"
    try:
        with httpx2.Client(base_url=url, timeout=60) as client:
            began = time.perf_counter()
            while True:
                try:
                    if client.get("/readyz").status_code == 200:
                        break
                except httpx2.TransportError:
                    time.sleep(0.02)
            print(f"ready after {time.perf_counter() - began:.2f} s")
            worker = int(Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()[0])
            server_size, worker_size = resident_megabytes(process.pid), resident_megabytes(worker)
            total = server_size + worker_size
            print(f"idle: server {server_size:.0f} MB + one warm worker {worker_size:.0f} MB = {total:.0f} MB")

            for count, outputs in ((100, ["q"]), (1000, ["frame"])):
                compare(client, count, outputs)
    finally:
        process.send_signal(signal.SIGTERM)
        process.wait(20)


if __name__ == "__main__":
    main()
