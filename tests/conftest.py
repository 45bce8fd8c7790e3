"""Fixtures shared by the tests."""

from __future__ import annotations

import gc
import io
import json
import os
import signal
import socket
import ssl
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import chdir, contextmanager, redirect_stderr, redirect_stdout, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from zlib import crc32

import httpx2
import numpy as np
import pytest
from hypothesis import settings
from prometheus_client.parser import text_string_to_metric_families

from veselova.mechanics.core.folders import account_folder

os.environ.setdefault("MPLBACKEND", "agg")
settings.register_profile("default", deadline=None, derandomize=True)
settings.load_profile("default")

# Under nohup this process ignores the end of its terminal. So it goes on doing, but processes that
# it starts do not inherit it: what is handled here is left to the system there.
if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
    signal.signal(signal.SIGHUP, lambda *_: None)

#: Seconds that a test waits for what must come: only a failure takes them, however slow or busy the
#: machine is.
PATIENCE = 300.0

# Processes with a home of their own take the machine code that is there.
os.environ.setdefault("NUMBA_CACHE_DIR", str(account_folder("XDG_CACHE_HOME", ".cache")))

#: The authorities that a client trusts, read once: that takes as long as thirty requests.
_TLS = ssl.create_default_context()


#: The date, which decides random problems: all processes of a run have the same.
DAY = int(os.environ.setdefault("TESTS_DAY", f"{datetime.now(UTC):%Y%m%d}"))


def interpreter(*arguments: Any, **options: Any) -> subprocess.CompletedProcess[str]:
    """Run this interpreter in a process of its own."""
    options = {"capture_output": True, "text": True, "timeout": PATIENCE, **options}
    return subprocess.run([sys.executable, *map(str, arguments)], **options)


def command_line(
    *arguments: Any,
    stdin: Any = b"",
    cwd: Path | None = None,
    encoding: str = "utf-8",
    terminal: bool = False,
    **environment: str,
) -> subprocess.CompletedProcess[str]:
    """Run ``veselova …`` in this process, which has loaded already what it needs. A standard input
    that is not bytes is written as JSON.
    """
    from veselova.service.cli.main import main

    given = stdin if isinstance(stdin, bytes) else json.dumps(stdin).encode()
    out, err = (io.TextIOWrapper(io.BytesIO(), encoding, write_through=True) for _ in range(2))
    handler, status = signal.getsignal(signal.SIGTERM), 0
    with pytest.MonkeyPatch.context() as patched, chdir(cwd or "."):
        patched.setattr(err, "isatty", lambda: terminal)
        patched.setattr(sys, "argv", ["veselova", *map(str, arguments)])
        patched.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(given), "utf-8"))
        for name, value in environment.items():
            patched.setenv(name, value)
        try:
            with redirect_stdout(out), redirect_stderr(err):
                main()
        except SystemExit as ending:
            status = int(ending.code or 0)
        finally:
            signal.signal(signal.SIGTERM, handler)
    printed = (stream.buffer.getvalue().decode(encoding, "replace") for stream in (out, err))  # type: ignore[attr-defined]
    return subprocess.CompletedProcess(arguments, status, *printed)


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Say what decided random problems, and what was skipped for want of what."""
    terminalreporter.write_line(f"Random problems are those of TESTS_DAY={DAY}.")
    skipped = Counter(report.longrepr[2] for report in terminalreporter.stats.get("skipped", ()))
    for reason, count in skipped.items():
        terminalreporter.write_line(f"{count} skipped: {reason.removeprefix('Skipped: ')}")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave to --slow the dear tests whose day it is not; one that is named runs."""
    seen: Counter[str] = Counter()
    for item in items if not config.option.keyword else ():
        if marker := item.get_closest_marker("daily"):
            name = item.nodeid.partition("[")[0]
            if (crc32(name.encode()) + seen[name] - DAY) % marker.args[0]:
                item.add_marker(pytest.mark.slow)
            seen[name] += 1


def pytest_collection_finish() -> None:
    """Leave what is loaded by now out of later collections of garbage: each took 0.4 s for it."""
    gc.freeze()


def slow(*values: Any) -> Any:
    """Return a row of a parametrized test that runs only where all tests do (./check --slow)."""
    return pytest.param(*values, marks=pytest.mark.slow)


@pytest.fixture
def rng() -> np.random.Generator:
    """A generator with a fixed seed: every run sees the same random input."""
    return np.random.default_rng(20240517)


def workers_of(process: int) -> list[int]:
    """Return the process ids of the workers that a process has started."""
    found = []
    for path in Path(f"/proc/{process}/task").glob("*/children"):
        with suppress(FileNotFoundError):  # a thread or a process that has ended
            found += [
                int(child)
                for child in path.read_text().split()
                if "pebble_pool_worker" in Path(f"/proc/{child}/cmdline").read_text()
            ]
    return found


def processor_seconds(process: int) -> float:
    """Return the processor time that a process has taken, without that of those that it started."""
    fields = Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


@dataclass
class Server:
    """A real ``veselova serve`` in a process of its own."""

    process: subprocess.Popen[bytes]
    url: str
    log: Path

    def workers(self) -> list[int]:
        """Return the process ids of the worker processes."""
        return workers_of(self.process.pid)

    def interrupt(self) -> None:
        """Send the interrupt of a terminal, which goes to the server and all processes that it has
        started.
        """
        os.killpg(self.process.pid, signal.SIGINT)

    def ask(self, method: str, path: str, **options: Any) -> httpx2.Response:
        """Return the answer to a request."""
        options = {"timeout": PATIENCE, "verify": _TLS, **options}
        return httpx2.request(method, f"{self.url}{path}", **options)

    def get(self, path: str, **options: Any) -> httpx2.Response:
        """Return the answer to a GET."""
        return self.ask("GET", path, **options)

    def metrics(self) -> dict[tuple[str, ...], float]:
        """Return the numbers of /metrics, as ``samples`` does."""
        return samples(self.get("/metrics").text)

    def at_work(self) -> tuple[int, int]:
        """Return how many workers are busy and how many requests wait for one."""
        shown = self.metrics()
        return int(shown["veselova_workers_busy",]), int(shown["veselova_queue_length",])

    def wait_ready(self, path: str = "/readyz") -> None:
        """Wait until a worker is warm and all parts are there, or by another path for less."""

        def ready() -> bool:
            assert self.process.poll() is None, self.log.read_text()
            try:
                return self.get(path).status_code == 200
            except httpx2.TransportError:
                return False

        wait_until(ready)


def samples(text: str) -> dict[tuple[str, ...], float]:
    """Return the numbers in the text of /metrics: (name, value of every label in the order of label
    names) → number.
    """
    families = text_string_to_metric_families(text)
    return {
        (sample.name, *(sample.labels[label] for label in sorted(sample.labels))): sample.value
        for family in families
        for sample in family.samples
    }


def wait_until(condition: Callable[[], Any]) -> None:
    """Wait until a condition holds."""
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, "what was awaited did not come"
        time.sleep(0.02)


def free_port() -> int:
    """Return a port that nothing listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@contextmanager
def running_server(
    folder: Path, *arguments: str, awaited: str = "/readyz", **limits: str
) -> Iterator[Server]:
    """Run a server with arguments of its command and settings from the environment, of one worker
    unless they say otherwise, once it answers at a path, and end it.
    """
    port = free_port()
    limits.setdefault("workers", "1")
    limits.setdefault("data_dir", str(folder / "data"))
    environment = {
        **os.environ,
        **{f"VESELOVA_{name.upper()}": value for name, value in limits.items()},
    }
    log = folder / "server.log"
    with log.open("wb") as stream:
        command = [sys.executable, "-m", "veselova", "serve", "--port", str(port), *arguments]
        process = subprocess.Popen(
            command,
            stdout=stream,
            stderr=subprocess.STDOUT,
            env=environment,
            start_new_session=True,
        )
        server = Server(process, f"http://127.0.0.1:{port}", log)
        try:
            server.wait_ready(awaited)
            yield server
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGTERM)
                process.wait(PATIENCE)


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """One server for all tests that do not harm it."""
    with running_server(tmp_path_factory.mktemp("server"), workers="2") as running:
        yield running


@pytest.fixture(scope="session")
def postgresql() -> Iterator[str]:
    """Return the address of a server; skips the test where there is none."""
    from postgresql import postgresql_server

    with postgresql_server() as address:
        yield address


@pytest.fixture(params=["sqlite", "postgresql"])
def store(request: pytest.FixtureRequest, tmp_path: Path) -> Any:
    """Return settings with a folder and a database of their own."""
    from postgresql import settings_in

    return settings_in(tmp_path / "data?x=1", request)


@pytest.fixture(scope="module")
def bundle() -> Path:
    """Return the folder of the explorer's bundle; skips the test where it cannot be built."""
    from explorer_bundle import build_or_skip

    return build_or_skip()


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Return chromium, without a window; skips the test where playwright is missing."""
    from explorer_browser import running_browser

    with running_browser() as running:
        yield running


@pytest.fixture(scope="module")
def open_visit(browser: Any, server: Server) -> Iterator[Any]:
    """Return a page of the server that all tests share, for all tests of a file."""
    from explorer_browser import visiting

    with visiting(browser, server.url) as found:
        yield found


@pytest.fixture
def visit(open_visit: Any) -> Iterator[Any]:
    """Return a page of the server that all tests share; it is open already after the first test.

    Loading one takes the processor longer than most of what tests ask of it.
    """
    yield open_visit
    open_visit.check()
    if open_visit.page.locator("#play:text('Pause')").count():
        open_visit.page.click("#play")  # what plays takes a processor
