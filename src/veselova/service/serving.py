"""``veselova serve``: settings, the address, and uvicorn around the application."""

from __future__ import annotations

import os
import signal
import socket
import sys

from pydantic import ValidationError

from veselova.mechanics.errors import InvalidInput
from veselova.service.cluster import require_scheduler
from veselova.service.settings import Settings

__all__ = ["serve"]


def serve(host: str, port: int, settings_only: bool) -> None:
    """Serve the HTTP API until SIGINT or SIGTERM, or print the settings; raises InvalidInput for an address or a setting."""
    # uvicorn sends itself the signal again when it has shut down; leaving by SystemExit lets the loop kill the workers first.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    # The matrices are small: without this every process starts two threads for each further processor, and none of them helps.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    limits = _settings()
    if settings_only:
        for name, value in limits.model_dump().items():
            print(f"VESELOVA_{name.upper()}={value}  # {Settings.model_fields[name].description}")
        return
    _require_addresses(limits)
    _require_free(host, port)
    import uvicorn

    from veselova.service.app import create_app

    uvicorn.run(create_app(limits), host=host, port=port, log_level="info", timeout_graceful_shutdown=limits.shutdown_grace_s)


def _settings() -> Settings:
    known = {f"VESELOVA_{name.upper()}" for name in Settings.model_fields}
    for name in sorted(os.environ):
        if name.startswith("VESELOVA_") and name not in known:
            print(f"veselova: {name} is not one of its settings (veselova serve --settings lists them)", file=sys.stderr)
    try:
        return Settings()
    except ValidationError as error:
        item = error.errors()[0]
        name = f"VESELOVA_{str(item['loc'][0]).upper()}"
        raise InvalidInput((name,), item["msg"][:1].lower() + item["msg"][1:], str(item["input"])) from None


def _require_addresses(limits: Settings) -> None:
    """Refuse addresses of a scheduler or a database that cannot be followed, where sweeps are installed."""
    require_scheduler(limits)
    try:
        from veselova.service.database import database_url
    except ImportError:
        return
    database_url(limits)


def _require_free(host: str, port: int) -> None:
    """Refuse an address that cannot be bound in the words of the other refusals, before anything is started."""
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
    except socket.gaierror as error:
        raise InvalidInput(("--host",), "an address of this machine", f"{host} ({error.strerror})") from None
    with socket.socket(family, kind, protocol) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(address)
        except OSError as error:
            raise InvalidInput(("--port",), "an address and a port to bind", f"{host}:{port} ({error.strerror})") from None
