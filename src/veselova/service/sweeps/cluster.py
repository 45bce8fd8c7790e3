"""The Dask cluster that computes sweeps: worker processes of this machine, or a scheduler by its
address. One code path.
"""

from __future__ import annotations

import asyncio
import logging
import os
import signal
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from importlib import import_module
from typing import Any
from urllib.parse import urlsplit

import anyio.to_thread

from veselova.mechanics.core.errors import BackendMissing, InvalidInput
from veselova.mechanics.core.installation import install_extra
from veselova.service.api.settings import MEGABYTE, Settings
from veselova.service.sweeps.in_process_cluster import ThisProcess
from veselova.service.workers.signals import ignore_interrupt_in_children

__all__ = ["open_cluster", "require_scheduler"]

#: Seconds for a connection to the scheduler, and for the first worker to come up.
_CONNECT_S = 30

#: Seconds between two looks at whether workers of this machine are lost.
_LOOK_S = 5

_LOG = logging.getLogger("veselova.sweeps")

_LOOPBACK = ("127.0.0.1", "localhost", "::1")


#: Files of the certificates of a cluster: of its authority, of this server, and the private key.
_CERTIFICATES = ("ca.pem", "node.pem", "node.key")


def require_scheduler(settings: Settings) -> None:
    """Raise InvalidInput for a scheduler that is neither on loopback nor behind TLS, or for TLS
    without its files.
    """
    if not settings.dask_scheduler:
        return
    address = urlsplit(settings.dask_scheduler)
    if address.scheme not in ("tcp", "tls") or not address.hostname:
        raise InvalidInput(
            ("VESELOVA_DASK_SCHEDULER",),
            "an address tls://HOST:PORT",
            settings.dask_scheduler[:100],
        )
    if address.scheme == "tcp" and address.hostname not in _LOOPBACK:
        raise InvalidInput(
            ("VESELOVA_DASK_SCHEDULER",),
            "tls://, for whoever reaches a Dask cluster can run code on it",
            settings.dask_scheduler[:100],
        )
    if address.scheme == "tls":
        folder = settings.dask_certificates
        if folder is None or not all((folder / name).is_file() for name in _CERTIFICATES):
            required = f"a folder with {', '.join(_CERTIFICATES)}, for tls://"
            given = str(folder or "nothing")
            raise InvalidInput(("VESELOVA_DASK_CERTIFICATES",), required, given)


@asynccontextmanager
async def open_cluster(
    settings: Settings, processes: bool = True, niceness: int = 0
) -> AsyncIterator[Any]:
    """Give a Dask client in the running event loop; ``processes=False`` and no scheduler, a thread
    of this process.

    ``niceness``: how far the processes of this machine stand back behind others. Raises
    InvalidInput for an address that is refused, OSError where the scheduler cannot be reached.
    """
    require_scheduler(settings)
    if not processes and not settings.dask_scheduler:
        yield ThisProcess()
        return
    try:
        # It takes half a second to load, for which the server goes on answering.
        await anyio.to_thread.run_sync(import_module, "distributed")
        import dask
        from distributed import Client, LocalCluster
        from distributed.security import Security
    except ImportError:
        raise BackendMissing("distributed", "A sweep", install_extra("sweeps")) from None

    # Every start and stop of a worker would be told; what goes wrong comes back as an exception, or
    # as a lost chunk.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    if settings.dask_scheduler:
        security = None
        if (folder := settings.dask_certificates) is not None:
            ca, cert, key = (str(folder / name) for name in _CERTIFICATES)
            security = Security(
                tls_ca_file=ca, tls_client_cert=cert, tls_client_key=key, require_encryption=True
            )
        options = {
            "asynchronous": True,
            "security": security,
            "timeout": _CONNECT_S,
            "set_as_default": False,
        }
        async with Client(settings.dask_scheduler, **options) as client:
            yield client
        return
    with dask.config.set(_configuration(_preload(niceness))):
        starting = asyncio.ensure_future(LocalCluster(**_machine(settings)))
        try:
            with ignore_interrupt_in_children():
                cluster = await asyncio.shield(starting)
        except RuntimeError as error:
            raise OSError(f"no workers could be started: {error}") from error
        except asyncio.CancelledError:  # workers that are half started would outlive their cluster
            with suppress(RuntimeError):  # they were ended, too, as all processes of a service are
                async with await starting:
                    pass
            raise
        async with cluster, Client(cluster, asynchronous=True, set_as_default=False) as client:
            keeping = asyncio.create_task(_keep_workers(cluster))
            try:
                yield client
            finally:
                keeping.cancel()


async def _keep_workers(cluster: Any) -> None:
    """Replace, for ever, workers that have ended for good, which Dask leaves to whoever made the
    cluster.

    A nanny ends when a successor of its worker could not be started.
    """
    from distributed.core import Status

    while True:
        await asyncio.sleep(_LOOK_S)
        for name in [
            name
            for name, nanny in cluster.workers.items()
            if nanny.status in (Status.closed, Status.failed)
        ]:
            _LOG.warning("worker %s of the cluster has ended for good; another is started", name)
            del cluster.workers[name]
        cluster.scale(len(cluster.worker_spec))  # starts those that are not there


def _preload(niceness: int) -> list[str]:
    """Return what a worker runs once Dask is loaded; one that replaces another starts outside
    ``ignore_interrupt_in_children``.
    """
    code = ["import os, signal", "signal.signal(signal.SIGINT, signal.SIG_IGN)"]
    if hasattr(signal, "pthread_sigmask"):  # by which Dask ends it, and which a server has blocked
        code.append("signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGTERM])")
    if niceness and hasattr(os, "setpriority"):
        code.append(f"os.setpriority(os.PRIO_PROCESS, 0, {niceness})")
    return ["\n".join(code)]


def _configuration(preload: list[str]) -> dict[str, Any]:
    """Return what Dask is to do otherwise than by default."""
    return {
        # A worker at its limit is ended. Paused, as Dask would have it before that, it would never
        # go on.
        "distributed.worker.memory.target": False,
        "distributed.worker.memory.spill": False,
        "distributed.worker.memory.pause": False,
        "distributed.scheduler.allowed-failures": 2,
        # So long after a worker was lost Dask looks whether there is a successor. Where that one is
        # just being replaced itself, or takes long to start, its nanny would be closed, for good.
        "distributed.deploy.lost-worker-timeout": "1000 days",
        "distributed.comm.timeouts.connect": _CONNECT_S,
        # As often as Dask looks after itself by default, a cluster without work takes a seventh of
        # a processor.
        "distributed.admin.tick.interval": "1s",
        "distributed.admin.system-monitor.interval": "10s",
        "distributed.worker.memory.monitor-interval": "500ms",
        "distributed.admin.system-monitor.gil.enabled": False,
        "distributed.worker.profile.enabled": False,
        "distributed.worker.preload": preload,
        "distributed.nanny.pre-spawn-environ.OPENBLAS_NUM_THREADS": 1,
    }


def _machine(settings: Settings) -> dict[str, Any]:
    """Return the cluster of this machine, as LocalCluster takes it."""
    return {
        "n_workers": settings.sweep_workers,
        "threads_per_worker": 1,
        "processes": True,
        "memory_limit": settings.worker_memory_mb * MEGABYTE,
        "host": "127.0.0.1",
        # Dask serves pages of its own; they stay on this machine, at any free port.
        "scheduler_kwargs": {"dashboard": False, "dashboard_address": "127.0.0.1:0"},
        "worker_dashboard_address": "127.0.0.1:0",
        "asynchronous": True,
        "silence_logs": logging.CRITICAL,
    }
