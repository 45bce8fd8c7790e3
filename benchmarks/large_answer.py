"""How much memory does a large answer take in the server and in its worker, and how long does it
take in each format?

    python benchmarks/large_answer.py [times]      default 1000000; needs pyarrow for two of the
    formats

Starts a server with one worker, and downloads so many times of a four-dimensional
body, integrated, with all of its
series: in every format, and once as JSON in each content coding. Prints seconds, bytes, and the
peak resident memory of the server and of the worker (VmHWM, which only grows).
"""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import httpx2

from veselova.service.api.examples import BODY4_PROBLEM
from veselova.service.api.media_types import MEDIA_TYPES


def peak_megabytes(pid: int) -> float:
    line = next(
        line
        for line in Path(f"/proc/{pid}/status").read_text().splitlines()
        if line.startswith("VmHWM")
    )
    return float(line.split()[1]) / 1024


def worker_of(process: subprocess.Popen[bytes]) -> int:
    return int(Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()[-1])


def fetch(
    client: httpx2.Client, count: int, media_type: str, coding: str
) -> tuple[float, float, int]:
    """Return the seconds until the answer began and until it was there, and its bytes
    on the wire.
    """
    body = {
        "problem": BODY4_PROBLEM,
        "times": {"start": 0, "stop": 60, "count": count},
        "engine": "numeric",
        "budget_s": 60,
    }
    headers = {"content-type": "application/json", "accept": media_type, "accept-encoding": coding}
    began, size = time.perf_counter(), 0
    with client.stream(
        "POST", "/v1/trajectories", content=json.dumps(body), headers=headers
    ) as response:
        first = time.perf_counter() - began
        if response.status_code != 200:
            raise SystemExit(response.read().decode())
        for chunk in response.iter_raw():
            size += len(chunk)
    return first, time.perf_counter() - began, size


def main(count: int) -> None:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    with tempfile.TemporaryDirectory() as folder:
        settings = {
            "VESELOVA_WORKERS": "1",
            "VESELOVA_DATA_DIR": folder,
        }
        command = [sys.executable, "-m", "veselova", "serve", "--port", str(port)]
        process = subprocess.Popen(
            command,
            env={**os.environ, **settings},
            stderr=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
        )
        try:
            with httpx2.Client(base_url=f"http://127.0.0.1:{port}", timeout=120) as client:
                wait_ready(client)
                print(
                    f"idle: server {peak_megabytes(process.pid):.0f} MB, worker "
                    f"{peak_megabytes(worker_of(process)):.0f} MB"
                )
                print(
                    "format    coding     computed s   all s       bytes   server peak MB   "
                    "worker peak MB"
                )
                for name, coding in [
                    *((name, "identity") for name in MEDIA_TYPES),
                    ("json", "gzip"),
                ]:
                    first, whole, size = fetch(client, count, MEDIA_TYPES[name], coding)
                    memory = (
                        f"{peak_megabytes(process.pid):14.0f}   "
                        f"{peak_megabytes(worker_of(process)):14.0f}"
                    )
                    print(
                        f"{name:8}  {coding:8}   {first:10.1f}   {whole:5.1f}   {size:9d}   "
                        f"{memory}",
                        flush=True,
                    )
        finally:
            process.send_signal(signal.SIGTERM)
            process.wait(30)


def wait_ready(client: httpx2.Client) -> None:
    for _ in range(1200):
        try:
            if client.get("/readyz").status_code == 200:
                return
        except httpx2.TransportError:
            pass
        time.sleep(0.05)
    raise SystemExit("the server does not become ready")


if __name__ == "__main__":
    main(int(float(sys.argv[1])) if len(sys.argv) > 1 else 1_000_000)
