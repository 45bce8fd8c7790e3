"""nginx with the configuration of the repository, before a server."""

from __future__ import annotations

import os
import shutil
import socket
import ssl
import subprocess
import time
import timeit
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx2
import pytest
import trustme

from conftest import PATIENCE, free_port, running_server, wait_until
from hostile import GOOD

CONFIGURATION = Path(__file__).parent.parent.parent / "nginx.conf"
NGINX = shutil.which("nginx", path=f"{os.environ.get('PATH', '')}:/usr/sbin")

pytestmark = pytest.mark.skipif(NGINX is None, reason="needs nginx: apt-get install nginx")

HEAD = (
    b"POST /v1/tori HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
    b"Content-Length: 1000\r\n\r\n"
)


@dataclass
class Proxy:
    """nginx on a port of loopback."""

    port: int
    trusted: ssl.SSLContext

    def client(self, address: str) -> httpx2.Client:
        """Return a client whose address is one of loopback."""
        transport = httpx2.HTTPTransport(verify=self.trusted, local_address=address)
        base = f"https://localhost:{self.port}"
        return httpx2.Client(base_url=base, transport=transport, timeout=PATIENCE)

    def connect(self, address: str) -> ssl.SSLSocket:
        """Return a connection from an address of loopback."""
        plain = socket.create_connection(("127.0.0.1", self.port), PATIENCE, (address, 0))
        return self.trusted.wrap_socket(plain, server_hostname="localhost")


def write_configuration(folder: Path, port: int, service: int) -> Path:
    """Write the configuration with ports of this machine, and return its file."""
    text = CONFIGURATION.read_text()
    for stated, here in (
        ("veselova:8000", f"127.0.0.1:{service}"),
        ("listen 443 ssl", f"listen 127.0.0.1:{port} ssl"),
        ("/certificates", str(folder)),
    ):
        assert stated in text
        text = text.replace(stated, here)
    kinds = ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
    files = "".join(f"    {kind}_temp_path {folder}/{kind};\n" for kind in kinds)
    file = folder / "nginx.conf"
    file.write_text(text.replace("http {\n", f"http {{\n{files}"))
    return file


@contextmanager
def nginx(folder: Path, service: int) -> Iterator[Proxy]:
    authority, port = trustme.CA(), free_port()
    certificate = authority.issue_cert("localhost")
    certificate.cert_chain_pems[0].write_to_path(folder / "server.pem")
    certificate.private_key_pem.write_to_path(folder / "server.key")
    trusted = ssl.create_default_context()
    authority.configure_trust(trusted)
    file = write_configuration(folder, port, service)
    user = "user root; " if os.geteuid() == 0 else ""
    fixed = f"{user}daemon off; pid {folder}/nginx.pid;"
    with subprocess.Popen([str(NGINX), "-c", str(file), "-g", fixed]) as process:
        try:
            # Written once it listens.
            wait_until(lambda: (folder / "nginx.pid").exists() or process.poll() is not None)
            assert process.poll() is None
            yield Proxy(port, trusted)
        finally:
            process.terminate()


@pytest.fixture(scope="module")
def proxy(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Proxy]:
    folder = tmp_path_factory.mktemp("proxy")
    with (
        running_server(folder, "--behind-proxy", "--forwarded-allow-ips", "127.0.0.1") as server,
        nginx(folder, int(server.url.rpartition(":")[2])) as found,
    ):
        yield found


def seconds(client: httpx2.Client) -> float:
    """Return how long a small request takes, the quickest of five."""

    def once() -> None:
        assert client.post("/v1/tori", json={"problem": GOOD["problem"]}).status_code == 200

    return min(timeit.repeat(once, number=1))


@pytest.mark.parametrize("sent", [HEAD[:30], HEAD + b'{"problem":'], ids=["head", "body"])
def test_200_slow_requests_do_not_hold_up_another(proxy: Proxy, sent: bytes) -> None:
    with proxy.client("127.0.0.2") as client, ExitStack() as stack:
        alone = seconds(client)
        for k in range(200):
            slow = stack.enter_context(proxy.connect(f"127.0.1.{k // 20 + 1}"))
            slow.sendall(sent)
        assert seconds(client) < alone + 5


@pytest.mark.daily(4)
def test_requests_that_stop_are_ended(proxy: Proxy) -> None:
    began = time.monotonic()
    with ExitStack() as stack:
        stopped = []
        for sent in (b"", HEAD[:30], HEAD + b"{"):
            stopped.append(stack.enter_context(proxy.connect("127.0.0.3")))
            stopped[-1].sendall(sent)
        for slow in stopped:
            answer = slow.recv(1000)
            assert answer == b"" or answer.startswith(b"HTTP/1.1 408 ")
    assert time.monotonic() - began < 30


def is_problem_of(answer: httpx2.Response, status: int, code: str) -> None:
    assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["type"] == f"urn:veselova:problem:{code}"


def test_a_body_that_is_too_large_gets_413(proxy: Proxy) -> None:
    with proxy.client("127.0.0.4") as client:
        large: dict[str, Any] = {"content": b" " * 1_100_000}
        answer = client.post("/v1/tori", headers={"content-type": "application/json"}, **large)
        is_problem_of(answer, 413, "body-too-large")


def test_a_client_over_its_rate_gets_429_and_others_do_not(proxy: Proxy) -> None:
    with proxy.client("127.0.0.5") as often, proxy.client("127.0.0.6") as seldom:
        found = [often.get("/healthz") for _ in range(300)]
        refused = [answer for answer in found if answer.status_code != 200]
        assert refused
        for answer in refused:
            is_problem_of(answer, 429, "rate-limited")
            assert answer.headers["retry-after"] == "1"
        assert seldom.get("/healthz").status_code == 200


def test_a_service_that_is_away_may_be_asked_again(tmp_path: Path) -> None:
    with nginx(tmp_path, free_port()) as found, found.client("127.0.0.8") as client:
        answer = client.post("/v1/tori", json={"problem": GOOD["problem"]})
        is_problem_of(answer, 503, "overloaded")
        assert answer.headers["retry-after"] == "2"


def test_events_of_a_job_arrive_while_it_runs(proxy: Proxy) -> None:
    sweep = {
        "problem": GOOD["problem"],
        "vary": {"/A/0": {"start": 3, "stop": 4, "count": 200_000}},
    }
    with proxy.client("127.0.0.7") as client:
        job = f"/v1/jobs/{client.post('/v1/sweeps', json=sweep).json()['id']}"
        with client.stream("GET", f"{job}/events") as events:
            lines = events.iter_lines()
            assert next(line for line in lines if line.startswith("data: "))
        assert client.get(job).json()["state"] in ("queued", "running")
        client.delete(job, params={"remove": True})
