"""Does the service answer while all its workers are busy, and does its memory stay as it is?

    python benchmarks/load.py [SECONDS [CONNECTIONS]]
    python benchmarks/load.py requests [NUMBER]

Starts a server with two workers. For SECONDS (60), CONNECTIONS (64) connections POST small motions,
each of a body of its own, one after the other, while another asks for /healthz fifty times a
second. Then four times as many connections as may wait are
opened at once: those beyond get 503 and none is left without an answer. Printed: answers by status,
requests per second, quantiles of both, and the memory of the server's process before, at half time
and after.

With ``requests`` a server of one worker is asked by two connections until it has answered NUMBER
(100 000) of them, each for a body of its own, one of four solved in closed form; printed is the
memory of both processes after 10, 100, 1000 … requests.
"""

from __future__ import annotations

import asyncio
import json
import os
import random
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import httpx2


class Connection:
    """One kept-alive HTTP/1.1 connection, as thin as it can be: the load and the server share the
    processors.
    """

    def __init__(self, port: int) -> None:
        self._port = port

    async def __aenter__(self) -> Connection:
        self._reader, self._writer = await asyncio.open_connection("127.0.0.1", self._port)
        return self

    async def __aexit__(self, *_: object) -> None:
        self._writer.close()

    async def ask(self, request: bytes) -> tuple[int, float]:
        """Return the status of an answer and the seconds it took."""
        began = time.perf_counter()
        self._writer.write(request)
        header = await self._reader.readuntil(b"\r\n\r\n")
        lines = header.decode("latin-1").lower().split("\r\n")
        length = next(
            int(line.split(":")[1]) for line in lines if line.startswith("content-length:")
        )
        await self._reader.readexactly(length)
        return int(lines[0].split()[1]), time.perf_counter() - began


def motion(draw: random.Random, engine: str = "analytic") -> bytes:
    """Return a request for a small motion of a body of its own."""
    problem = {
        "system": "veselova",
        "A": [3, 2, 1 + draw.random()],
        "q": [1, 1, 1],
        "q_dot": [draw.random(), 0.2, -0.5],
    }
    times = [0, 1, 2] if engine == "analytic" else [0, 0.1]
    body = json.dumps(
        {
            "problem": {**problem, "normalize": True},
            "times": times,
            "engine": engine,
            "budget_s": 30,
        }
    ).encode()
    return (
        b"POST /v1/trajectories HTTP/1.1\r\nHost: x\r\nContent-Type: "
        b"application/json\r\nContent-Length: %d\r\n\r\n" % len(body) + body
    )


HEALTH = b"GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n"


async def small_requests(
    port: int, until: float, seed: int, seen: Counter[int], taken: list[float]
) -> None:
    draw = random.Random(seed)
    async with Connection(port) as connection:
        while time.perf_counter() < until:
            status, seconds = await connection.ask(motion(draw))
            seen[status] += 1
            taken.append(seconds)


async def health(port: int, until: float, taken: list[float]) -> None:
    async with Connection(port) as connection:
        while time.perf_counter() < until:
            status, seconds = await connection.ask(HEALTH)
            assert status == 200
            taken.append(seconds)
            await asyncio.sleep(max(0.0, 0.02 - seconds))


async def burst(port: int, count: int) -> Counter[int]:
    """Return the answers by status to so many requests at once."""

    async def one(seed: int) -> int:
        async with Connection(port) as connection:
            return (await connection.ask(motion(random.Random(seed))))[0]

    return Counter(
        await asyncio.wait_for(asyncio.gather(*(one(10_000 + i) for i in range(count))), 120)
    )


def quantiles(taken: list[float]) -> str:
    ordered = sorted(taken)
    return ", ".join(
        f"{name} {1000 * ordered[int(q * (len(ordered) - 1))]:.1f} ms"
        for name, q in (("p50", 0.5), ("p99", 0.99), ("max", 1))
    )


def megabytes(pid: int) -> float:
    line = next(
        line
        for line in Path(f"/proc/{pid}/status").read_text().splitlines()
        if line.startswith("VmRSS")
    )
    return int(line.split()[1]) / 1024


async def measure(port: int, pid: int, seconds: float, connections: int, waiting: int) -> None:
    seen, small, healthy = Counter[int](), list[float](), list[float]()
    print(f"memory before: {megabytes(pid):.0f} MB")
    until = time.perf_counter() + seconds
    loads = [small_requests(port, until, seed, seen, small) for seed in range(connections)]
    tasks = asyncio.gather(health(port, until, healthy), *loads)
    await asyncio.sleep(seconds / 2)
    print(f"memory at half time: {megabytes(pid):.0f} MB after {sum(seen.values())} requests")
    await tasks
    print(f"memory after: {megabytes(pid):.0f} MB after {sum(seen.values())} requests")
    print(
        f"small motions: {dict(seen)}, {sum(seen.values()) / seconds:.0f} per second, "
        f"{quantiles(small)}"
    )
    print(f"/healthz meanwhile: {quantiles(healthy)}")
    print(f"{4 * waiting} at once where {waiting} may wait: {dict(await burst(port, 4 * waiting))}")


async def count(port: int, pid: int, number: int) -> None:
    """Print the memory of a server and its worker each time that ten times as many requests have
    been answered.
    """
    answered, seen, began = 0, Counter[int](), time.perf_counter()

    async def ask(draw: random.Random) -> None:
        nonlocal answered
        async with Connection(port) as connection:
            while answered < number:
                answered += 1
                mark = answered
                engine = "analytic" if mark % 4 == 0 else "numeric"
                seen[(await connection.ask(motion(draw, engine)))[0]] += 1
                if mark >= 10 and str(mark).strip("0") == "1":
                    worker = int(Path(f"/proc/{pid}/task/{pid}/children").read_text().split()[-1])
                    print(
                        f"{mark} requests: server {megabytes(pid):.0f} MB, worker "
                        f"{megabytes(worker):.0f} MB",
                        flush=True,
                    )

    await asyncio.gather(*(ask(random.Random(seed)) for seed in range(2)))
    print(f"{dict(seen)}, {number / (time.perf_counter() - began):.0f} per second")


def main() -> None:
    counting = sys.argv[1:2] == ["requests"]
    number = int(sys.argv[2]) if counting and len(sys.argv) > 2 else 100_000
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 and not counting else 60.0
    connections = int(sys.argv[2]) if len(sys.argv) > 2 and not counting else 64
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    with tempfile.TemporaryDirectory() as folder:
        limits = {
            "VESELOVA_WORKERS": "1" if counting else "2",
            "VESELOVA_MAX_WAITING": str(connections),
            "VESELOVA_DATA_DIR": folder,
            "VESELOVA_LOG_LEVEL": "warning",
        }
        command = [sys.executable, "-m", "veselova", "serve", "--port", str(port)]
        process = subprocess.Popen(command, env={**os.environ, **limits})
        try:
            while True:
                try:
                    if httpx2.get(f"http://127.0.0.1:{port}/readyz").status_code == 200:
                        break
                except httpx2.TransportError:
                    pass
                time.sleep(0.05)
            asyncio.run(
                count(port, process.pid, number)
                if counting
                else measure(port, process.pid, seconds, connections, connections)
            )
        finally:
            process.send_signal(signal.SIGTERM)
            process.wait(30)


if __name__ == "__main__":
    main()
