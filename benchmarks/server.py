"""How much memory does an idle server hold, and what does a request cost beyond the solve?

    python benchmarks/server.py [REQUESTS]

Starts a server with one worker, then POSTs REQUESTS (200) different bodies of
three and of four dimensions one after the other, q at 100 times, and of four dimensions the frame
at 1000. The time of a request is that of its client: from the first byte sent on a connection that
is kept open on loopback to the last byte received. The client looks for the end of the answer and
no more (Python's own takes a tenth of it all to read the headers). Beyond the engine's own seconds,
stated in every
answer, come the problem, the integrals of motion and the text, with a server or without: this
process makes the same problems, solves them and writes the same answers itself. What requests take
more than that is the overhead of the service, which has in it HTTP, validation, the way to the
worker and back. /healthz is HTTP and nothing else.

The peer is the least that a FastAPI service can be: one route that reads a model and hands it to a
ProcessPoolExecutor of one process, which makes the same answer; it has no limits, budgets,
log or counters. Ten requests of ours, ten of its own and ten answers without a server take turns.
"""

from __future__ import annotations

import asyncio
import json
import os
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import httpx2
import uvicorn
from fastapi import FastAPI, Response
from pydantic import BaseModel

from veselova.service.api.examples import BODY4_PROBLEM
from veselova.service.api.settings import Settings
from veselova.service.workers.answers import render
from veselova.service.workers.tasks import warm_up

#: Requests of one kind before the turn of the next.
_BLOCK = 10

BODY3_PROBLEM = {
    "system": "veselova",
    "A": [3, 2, 1],
    "q": [1, 1, 1],
    "q_dot": [0.3, -0.7, 0.4],
    "normalize": True,
}


def resident_megabytes(pid: int) -> float:
    line = next(
        line
        for line in Path(f"/proc/{pid}/status").read_text().splitlines()
        if line.startswith("VmRSS")
    )
    return float(line.split()[1]) / 1024


def bodies(base: dict[str, Any], count: int, outputs: list[str], requests: int) -> Iterator[bytes]:
    """Yield requests for bodies of which no two are the same."""
    for k in range(requests):
        problem = {**base, "A": [3 + (k + 1) / (requests + 1), *base["A"][1:]]}
        yield json.dumps(
            {
                "problem": problem,
                "times": {"start": 0, "stop": 10, "count": count},
                "outputs": outputs,
            }
        ).encode()


class Connection:
    """One connection that is kept open, as thin as it can be."""

    def __init__(self, port: int) -> None:
        self._socket = socket.create_connection(("127.0.0.1", port))
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def __enter__(self) -> Connection:
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()

    def ask(self, method: str, path: str, body: bytes = b"") -> tuple[float, bytes]:
        """Return the seconds of one request and the body of its answer."""
        fields = (
            b"Host: localhost\r\nContent-Type: application/json\r\nContent-Length: %d\r\n\r\n"
            % len(body)
        )
        request, answer, end, size = (
            f"{method} {path} HTTP/1.1\r\n".encode() + fields + body,
            b"",
            0,
            0,
        )
        began = time.perf_counter()
        self._socket.sendall(request)
        while not end or len(answer) < end + size:
            answer += self._socket.recv(1 << 20)
            if not end and b"\r\n\r\n" in answer:
                end = answer.index(b"\r\n\r\n") + 4
                size = int(answer[:end].lower().split(b"content-length:")[1].split(b"\r\n")[0])
        seconds = time.perf_counter() - began
        assert answer.startswith(b"HTTP/1.1 200 "), answer
        return seconds, answer[end:]


def quantiles(taken: list[float]) -> str:
    ordered = sorted(taken)
    tenth, ninth = (ordered[int(q * (len(ordered) - 1))] for q in (0.1, 0.9))
    return (
        f"{1e3 * statistics.median(taken):.2f} ms (a tenth below {1e3 * tenth:.2f}, a tenth "
        f"above {1e3 * ninth:.2f})"
    )


def measure(
    ours: int, bare: int, base: dict[str, Any], count: int, outputs: list[str], requests: int
) -> None:
    """Print what a request costs beyond the solve; the servers listen at these ports."""
    asked = list(bodies(base, count, outputs, requests))
    whole, beyond, here, peer, size = [], [], [], [], 0
    with Connection(ours) as connection, Connection(bare) as other:
        for first in range(0, requests, _BLOCK):
            block = asked[first : first + _BLOCK]
            answers = [connection.ask("POST", "/v1/trajectories", body) for body in block]
            others = [other.ask("POST", "/v1/trajectories", body) for body in block]
            made = [without_http(json.loads(body)) for body in block]
            for (seconds, answer), (bare_seconds, of_bare), (alone, content) in zip(
                answers, others, made, strict=True
            ):
                assert (
                    without_provenance(of_bare)
                    == without_provenance(answer)
                    == without_provenance(content)
                )
                whole.append(seconds)
                beyond.append(seconds - solve_seconds(answer))
                peer.append(bare_seconds - solve_seconds(of_bare))
                here.append(alone - solve_seconds(content))
                size = len(content)
    overhead = statistics.median(beyond) - statistics.median(here)
    print(
        f"{outputs[0]} at {count} times, n = {len(base['A'])}, {size / 1e3:.0f} kB: whole "
        f"request {quantiles(whole)},"
    )
    print(
        f"  beyond the engine's own seconds {quantiles(beyond)}, without a server "
        f"{quantiles(here)}: {1e3 * overhead:.2f} more;"
    )
    print(
        f"  of bare FastAPI {quantiles(peer)}: ours over its "
        f"{statistics.median(beyond) / statistics.median(peer):.2f}"
    )


def solve_seconds(answer: bytes) -> float:
    """Return the seconds that an answer says the engine took."""
    return float(json.loads(answer)["provenance"]["seconds"])


def without_provenance(answer: bytes) -> dict[str, Any]:
    return {name: value for name, value in json.loads(answer).items() if name != "provenance"}


def without_http(request: dict[str, Any]) -> tuple[float, bytes]:
    """Return the seconds of the same answer in this process, and the answer: the problem, the
    solve, the integrals, the text.
    """
    began = time.perf_counter()
    body = json.dumps(request).encode()
    delivery = render("trajectory", body, "json", Path(os.devnull), Settings())
    seconds = time.perf_counter() - began
    assert delivery.body is not None
    return seconds, delivery.body


class Request(BaseModel):
    """What the bare service reads."""

    problem: dict[str, Any]
    times: dict[str, Any]
    outputs: list[str]


def serve_bare(port: int) -> None:
    """Serve the same answers with FastAPI, a process pool and nothing else."""
    application = FastAPI()
    pool = ProcessPoolExecutor(1, get_context("spawn"), warm_up)

    @application.post("/v1/trajectories")
    async def answer(request: Request) -> Response:
        _, body = await asyncio.get_running_loop().run_in_executor(
            pool, without_http, request.model_dump()
        )
        return Response(body, media_type="application/json")

    @application.get("/readyz")
    async def ready() -> None:
        await asyncio.get_running_loop().run_in_executor(pool, warm_up)

    # uvicorn raises it again: the pool is to end before this process
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    try:
        uvicorn.run(application, port=port, log_level="error", http="h11", loop="asyncio")
    finally:
        pool.shutdown(cancel_futures=True)


@contextmanager
def serving(command: list[str], port: int, environment: dict[str, str]) -> Iterator[int]:
    """Run a server until the end of the block; its process stands for it once it is ready."""
    process = subprocess.Popen(
        command, env=environment, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL
    )
    try:
        while not is_ready(port):
            assert process.poll() is None, "the server has ended"
            time.sleep(0.02)
        yield process.pid
    finally:
        process.send_signal(signal.SIGTERM)
        process.wait(20)


def is_ready(port: int) -> bool:
    try:
        return httpx2.get(f"http://127.0.0.1:{port}/readyz", timeout=60).status_code == 200
    except httpx2.TransportError:
        return False


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def main() -> None:
    requests = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    port, other = free_port(), free_port()
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "VESELOVA_WORKERS": "1", "VESELOVA_DATA_DIR": folder}
        began = time.perf_counter()
        with serving(
            [sys.executable, "-m", "veselova", "serve", "--port", str(port)], port, environment
        ) as pid:
            print(f"ready after {time.perf_counter() - began:.2f} s")
            worker = int(Path(f"/proc/{pid}/task/{pid}/children").read_text().split()[-1])
            server_size, worker_size = resident_megabytes(pid), resident_megabytes(worker)
            total = server_size + worker_size
            print(
                f"idle: server {server_size:.0f} MB + one warm worker {worker_size:.0f} MB = "
                f"{total:.0f} MB"
            )

            warm_up()
            with Connection(port) as connection:
                print(
                    "/healthz: "
                    f"{quantiles([connection.ask('GET', '/healthz')[0] for _ in range(requests)])}"
                )
            with serving([sys.executable, __file__, "bare", str(other)], other, environment):
                for base, count, outputs in (
                    (BODY3_PROBLEM, 100, ["q"]),
                    (BODY4_PROBLEM, 100, ["q"]),
                    (BODY4_PROBLEM, 1000, ["frame"]),
                ):
                    measure(port, other, base, count, outputs, requests)


if __name__ == "__main__":
    if sys.argv[1:2] == ["bare"]:
        serve_bare(int(sys.argv[2]))
    else:
        main()
