"""``veselova serve``: settings, the address, and uvicorn around the application."""

from __future__ import annotations

import gc
import ipaddress
import logging
import os
import signal
import socket
import sys

from pydantic import ValidationError

from veselova.mechanics.core.errors import InvalidInput
from veselova.service.api.settings import Settings

__all__ = ["GRACE_S", "serve", "settings_of_environment"]

#: Seconds that requests in flight get after SIGTERM: what containers give before they kill.
GRACE_S = 10

#: New objects before the collector looks at them: a body has half a million.
_OBJECTS = 50_000

_LOG = logging.getLogger("veselova.service")

#: The key that a client of this environment shows; no setting of the server.
_OF_THE_CLIENT = {"VESELOVA_API_KEY"}


def serve(
    host: str,
    port: int,
    settings_only: bool = False,
    forwarded_allow_ips: str | None = None,
    behind_proxy: bool = False,
    **stated: str | None,
) -> None:
    """Serve the HTTP API until SIGINT or SIGTERM, or print the settings; raises InvalidInput for an
    address or a setting.

    ``forwarded_allow_ips``: the proxies whose X-Forwarded-For is believed (uvicorn's option), none
    when left out. ``behind_proxy``: whether a proxy keeps slow and frequent clients away.
    ``stated`` are settings that go before those of the environment.
    """
    # Until uvicorn takes it: leaving by SystemExit ends what has been started.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    _drain_when_hung_up()
    # The matrices are small: without this every process starts two threads for each further
    # processor, and none of them helps.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.umask(0o077)  # what the server and its workers write is this account's alone
    first = {name: value for name, value in stated.items() if value is not None}
    limits = settings_of_environment().model_copy(update=first)
    if settings_only:
        for name, value in limits.model_dump().items():
            print(f"VESELOVA_{name.upper()}={value}  # {Settings.model_fields[name].description}")
        return
    import uvicorn

    from veselova.analytic.kernel.compiler import prepare
    from veselova.service.access.database import database_url
    from veselova.service.access.middleware import requires_keys
    from veselova.service.http.app import create_app
    from veselova.service.observability.logs import configure_logging

    database_url(limits)  # refused before anything is started
    loopback = _bindable(host, port)
    configure_logging(limits)
    prepare()  # a worker would be ended by the budget of its request
    app = create_app(limits, loopback=loopback)
    _collect_rarely()
    if not loopback and not behind_proxy:
        _LOG.warning(
            "%s is no loopback address: TLS, time limits and rates are those of a proxy, such "
            "as nginx in compose.yaml; --behind-proxy says that there is one",
            host,
        )
    if not loopback and not requires_keys(limits, loopback):
        _LOG.warning(
            "clients need no key although %s is no loopback address: whoever reaches it can "
            "use the service",
            host,
        )
    uvicorn.run(
        app,
        host=host,
        port=port,
        log_config=None,
        access_log=False,
        server_header=False,
        http="h11",
        ws="none",
        proxy_headers=forwarded_allow_ips is not None,
        forwarded_allow_ips=forwarded_allow_ips,
        timeout_graceful_shutdown=GRACE_S,
    )


def _collect_rarely() -> None:
    """Let the collector of garbage come seldom: it would look through all lists of a body several
    times while that is read, and keep others waiting.
    """
    gc.freeze()
    gc.set_threshold(_OBJECTS)


def _drain_when_hung_up() -> None:
    """Take the end of the terminal (SIGHUP) for SIGTERM, unless it is to be ignored (nohup)."""
    if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        signal.signal(signal.SIGHUP, lambda *_: os.kill(os.getpid(), signal.SIGTERM))


def settings_of_environment() -> Settings:
    """Return the settings of the environment; raises InvalidInput for one that is not valid."""
    known = {f"VESELOVA_{name.upper()}" for name in Settings.model_fields} | _OF_THE_CLIENT
    for name in sorted(os.environ):
        if name.startswith("VESELOVA_") and name not in known:
            print(
                f"veselova: {name} is not one of its settings (veselova serve --settings "
                "lists them)",
                file=sys.stderr,
            )
    try:
        return Settings()
    except ValidationError as error:
        item = error.errors()[0]
        name = f"VESELOVA_{str(item['loc'][0]).upper()}"
        required = item["msg"].removeprefix("Value error, ").removeprefix("required ")
        raise InvalidInput(
            (name,), required[:1].lower() + required[1:], str(item["input"])
        ) from None


def _bindable(host: str, port: int) -> bool:
    """Return whether an address is one of loopback.

    An address that cannot be bound is refused in the words of the other refusals, before anything
    is started.
    """
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    except socket.gaierror as error:
        raise InvalidInput(
            ("--host",), "an address of this machine", f"{host} ({error.strerror})"
        ) from None
    family, kind, protocol, _, address = found[0]
    with socket.socket(family, kind, protocol) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(address)
        except OSError as error:
            raise InvalidInput(
                ("--port",), "an address and a port to bind", f"{host}:{port} ({error.strerror})"
            ) from None
    return all(
        ipaddress.ip_address(str(entry[4][0]).partition("%")[0]).is_loopback for entry in found
    )
