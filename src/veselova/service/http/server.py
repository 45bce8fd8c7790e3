"""``veselova serve``: settings, the address, and uvicorn around the application."""

from __future__ import annotations

import gc
import ipaddress
import logging
import os
import signal
import socket
import sys
from contextlib import suppress

from pydantic import ValidationError

from veselova.mechanics.core.errors import InvalidInput
from veselova.service.access.database import database_url
from veselova.service.api.settings import Settings

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

    ``forwarded_allow_ips``: the proxies whose X-Forwarded-For is trusted (uvicorn's option), none
    by default. ``behind_proxy``: whether a proxy has timeouts and rate limits. ``stated`` settings
    override those of the environment.
    """
    # Until uvicorn takes it: leaving by SystemExit ends what has been started.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:  # as under nohup
        signal.signal(signal.SIGHUP, lambda *_: os.kill(os.getpid(), signal.SIGTERM))
    # The matrices are small: without this every process starts two threads for each further
    # processor, and none of them helps.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.umask(0o077)  # what the server and its workers write is this account's alone
    first = {name: value for name, value in stated.items() if value is not None}
    limits = settings_of_environment().model_copy(update=first)
    if settings_only:
        _print(limits)
        return
    database_url(limits)  # refused before anything is started
    address = _bound(host, port)
    loopback = ipaddress.ip_address(address.partition("%")[0]).is_loopback
    import uvicorn

    from veselova.analytic.kernel.compiler import prepare
    from veselova.service.access.middleware import requires_keys
    from veselova.service.http.app import create_app
    from veselova.service.observability.logs import configure_logging

    configure_logging(limits)
    prepare()  # a worker would be ended by the budget of its request
    app = create_app(limits, loopback=loopback)
    # the collector of garbage would look through all lists of a body several times
    gc.freeze()
    gc.set_threshold(_OBJECTS)
    if not loopback:
        _warn(host, behind_proxy, requires_keys(limits, loopback))
    config = uvicorn.Config(
        app,
        host=address,
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
    server = uvicorn.Server(config)
    app.state.ending = lambda: server.should_exit
    with suppress(KeyboardInterrupt):
        server.run()
    if not server.started:
        sys.exit(3)


def _warn(host: str, behind_proxy: bool, keyed: bool) -> None:
    """Say what an address that others reach is not protected by."""
    if not behind_proxy:
        _LOG.warning(
            "%s is no loopback address: TLS, time limits and rates are those of a proxy, such "
            "as nginx in compose.yaml; --behind-proxy says that there is one",
            host,
        )
    if not keyed:
        _LOG.warning(
            "clients need no key although %s is no loopback address: whoever reaches it can "
            "use the service",
            host,
        )


def _print(limits: Settings) -> None:
    """Print the settings as lines of a file of environment variables."""
    for name, value in limits.model_dump().items():
        print(f"VESELOVA_{name.upper()}={value}  # {Settings.model_fields[name].description}")


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
        if item["type"] == "string_pattern_mismatch":
            required = str(Settings.model_fields[str(item["loc"][0])].description)
        raise InvalidInput(
            (name,), required[:1].lower() + required[1:], str(item["input"])
        ) from None


def _bound(host: str, port: int) -> str:
    """Return the address of this machine that a host stands for; raises InvalidInput, before
    anything is started, for one that cannot be bound.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        with socket.socket(family) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((host, port))
            return str(probe.getsockname()[0])
    except OSError as error:
        given = f"{host}:{port} ({error.strerror})"
        if isinstance(error, socket.gaierror):
            raise InvalidInput(("--host",), "an address of this machine", given) from None
        raise InvalidInput(("--port",), "an address and a port to bind", given) from None
