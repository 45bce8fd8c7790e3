"""Fixtures shared by the tests."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx2
import numpy as np
import pytest
from hypothesis import settings

os.environ.setdefault("MPLBACKEND", "agg")
settings.register_profile("default", deadline=None, derandomize=True)
settings.load_profile("default")


@pytest.fixture
def rng() -> np.random.Generator:
    """A generator with a fixed seed: every run sees the same random input."""
    return np.random.default_rng(20240517)


@dataclass
class Server:
    """A real ``veselova serve`` in a process of its own."""

    process: subprocess.Popen[bytes]
    url: str
    log: Path

    def workers(self) -> list[int]:
        """Return the process ids of the worker processes."""
        children = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text().split()
        return [int(child) for child in children]

    def wait_ready(self, path: str = "/readyz") -> None:
        """Wait until a worker is warm and all parts are there, or by another path for less."""
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline:
            try:
                if httpx2.get(f"{self.url}{path}").status_code == 200:
                    return
            except httpx2.TransportError:
                pass
            assert self.process.poll() is None, self.log.read_text()
            time.sleep(0.05)
        raise AssertionError(f"not ready in time: {self.log.read_text()}")


def free_port() -> int:
    """Return a port that nothing listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@contextmanager
def running_server(folder: Path, *arguments: str, awaited: str = "/readyz", **limits: str) -> Iterator[Server]:
    """Run a server with arguments of its command and settings from the environment, once it answers at a path, and end it."""
    port = free_port()
    limits.setdefault("data_dir", str(folder / "data"))
    environment = {**os.environ, **{f"VESELOVA_{name.upper()}": value for name, value in limits.items()}}
    log = folder / "server.log"
    with log.open("wb") as stream:
        command = [sys.executable, "-m", "veselova", "serve", "--port", str(port), *arguments]
        process = subprocess.Popen(command, stdout=stream, stderr=subprocess.STDOUT, env=environment)
        server = Server(process, f"http://127.0.0.1:{port}", log)
        try:
            server.wait_ready(awaited)
            yield server
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGTERM)
                process.wait(20)


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """One server for all tests that do not harm it."""
    with running_server(tmp_path_factory.mktemp("server")) as running:
        yield running
