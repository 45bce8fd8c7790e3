"""A Dask cluster of two workers behind TLS: scheduler, workers and server show certificates of one
authority, and nobody else gets in.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import pytest
import trustme
from dask import config
from test_sweeps import BASE

from conftest import free_port
from veselova.service.api.request_models import read_request
from veselova.service.api.settings import Settings
from veselova.service.api.sweep_request import SweepRequest
from veselova.service.cli.local_sweep import run_sweep


def certificates(folder: Path) -> None:
    """Write the certificates of a cluster with an authority of its own."""
    folder.mkdir()
    authority = trustme.CA()
    node = authority.issue_cert("localhost", "127.0.0.1")
    authority.cert_pem.write_to_path(str(folder / "ca.pem"))
    node.cert_chain_pems[0].write_to_path(str(folder / "node.pem"))
    node.private_key_pem.write_to_path(str(folder / "node.key"))


def dask_settings(files: Path) -> Any:
    """Return a context in which Dask's own settings name the certificates of a folder."""
    tls = "distributed.comm.tls"
    return config.set(
        {
            f"{tls}.ca-file": f"{files}/ca.pem",
            f"{tls}.client.cert": f"{files}/node.pem",
            f"{tls}.client.key": f"{files}/node.key",
        }
    )


@contextmanager
def dask(*arguments: str) -> Iterator[subprocess.Popen[bytes]]:
    process = subprocess.Popen(
        [sys.executable, "-m", "dask", *arguments],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        yield process
    finally:
        process.terminate()
        process.wait(20)


@pytest.fixture(scope="module")
def cluster(
    tmp_path_factory: pytest.TempPathFactory,
) -> Iterator[tuple[dict[str, Any], list[subprocess.Popen[bytes]]]]:
    """The settings with which a scheduler and two workers behind TLS are reached, and these."""
    folder = tmp_path_factory.mktemp("cluster")
    files = folder / "tls"
    certificates(files)
    options = ["--tls-ca-file", f"{files}/ca.pem", "--tls-cert", f"{files}/node.pem"]
    options += ["--tls-key", f"{files}/node.key", "--no-dashboard"]
    port = str(free_port())
    address = f"tls://127.0.0.1:{port}"
    worker = [
        "worker",
        address,
        "--nthreads",
        "1",
        "--no-nanny",
        "--host",
        "127.0.0.1",
        "--local-directory",
        str(folder),
        *options,
    ]
    with ExitStack() as stack:
        stack.enter_context(
            dask("scheduler", "--protocol", "tls", "--host", "127.0.0.1", "--port", port, *options)
        )
        workers = [stack.enter_context(dask(*worker)) for _ in range(2)]
        with dask_settings(files):
            yield {"dask_scheduler": address}, workers


@pytest.mark.daily(4)
def test_a_cluster_behind_tls_that_loses_a_worker_gives_the_bytes_of_this_process(
    cluster: tuple[dict[str, Any], list[subprocess.Popen[bytes]]],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("veselova.service.api.sweep_request._CHUNK_ROWS", 5)
    vary = {"/A/0": [2, 3], "/q_dot": {"normal": [0, 1]}}
    sweep = read_request(
        SweepRequest, {"problem": BASE, "vary": vary, "samples": 20, "times": [0, 1]}
    )
    settings, workers = cluster

    def kill_one(done: float, total: float) -> None:
        if 0 < done < total and workers[0].poll() is None:
            workers[0].kill()

    job, here = run_sweep(sweep, Settings(data_dir=tmp_path / "here"), lambda done, total: None)
    _, there = run_sweep(sweep, Settings(data_dir=tmp_path / "there", **settings), kill_one)
    assert workers[0].poll() is not None
    assert there.result_path(job.id).read_bytes() == here.result_path(job.id).read_bytes()
