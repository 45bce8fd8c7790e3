"""The commands for operators of a server: ``veselova serve`` and ``veselova keys``."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import TYPE_CHECKING, Annotated

import orjson
import typer

from veselova.mechanics.core.errors import InvalidInput

if TYPE_CHECKING:
    from veselova.service.access.keys import Keys


_Json = Annotated[bool, typer.Option("--json", help="print JSON")]


def serve(
    host: Annotated[str, typer.Option(help="address to bind")] = "127.0.0.1",
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="port to bind; 0 takes a free one")
    ] = 8000,
    require_keys: Annotated[
        bool, typer.Option("--require-keys", help="ask clients for an API key on loopback too")
    ] = False,
    insecure: Annotated[
        bool, typer.Option("--insecure", help="ask for no API key, whatever the address")
    ] = False,
    forwarded_allow_ips: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESSES",
            help="proxies whose X-Forwarded-For is trusted, comma-separated",
        ),
    ] = None,
    behind_proxy: Annotated[
        bool,
        typer.Option(
            "--behind-proxy", help="a proxy has TLS, time limits and rate limits (compose.yaml)"
        ),
    ] = False,
    settings: Annotated[
        bool, typer.Option("--settings", help="print the limits, and the variables that set them")
    ] = False,
) -> None:
    """Serve the HTTP API until interrupted (limits: environment variables VESELOVA_…)."""
    from veselova.service.http.server import serve as run_server

    if require_keys and insecure:
        raise InvalidInput(("--insecure",), "one of --require-keys and --insecure", "both")
    keys = "required" if require_keys else "off" if insecure else None
    run_server(host, port, settings, forwarded_allow_ips, behind_proxy, keys=keys)


keys = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["--help", "-h"]},
    help="Create, list and revoke the API keys of the service.",
)


@keys.command()
def create(
    name: Annotated[str, typer.Argument(metavar="NAME", help="whose key it is")],
    scope: Annotated[str, typer.Option(help="read, solve (and read) or admin (all)")] = "solve",
    expires: Annotated[
        datetime | None, typer.Option(formats=["%Y-%m-%d"], help="never when left out")
    ] = None,
    same_owner_as: Annotated[
        str | None,
        typer.Option(
            metavar="ID", help="a key whose jobs and answers the new one sees, to take its place"
        ),
    ] = None,
    json: _Json = False,
) -> None:
    """Create an API key and print it; it is stored nowhere and cannot be shown again."""
    key, text = _keys().create(name, scope, expiry(expires), same_owner_as)
    if json:
        print(orjson.dumps({**key.as_dict(), "key": text}).decode())
        return
    print(text)
    until = f", until {key.expires_at:%Y-%m-%d %H:%M} UTC" if key.expires_at else ""
    typer.echo(
        f"The key of {name}, id {key.id}, scope {key.scope}{until}. Keep it now: only its "
        "hash is stored.",
        err=True,
    )


@keys.command("list")
def list_keys(json: _Json = False) -> None:
    """List the API keys by id, scope, expiry and name, never the keys themselves."""
    found = _keys().list()
    if json:
        print(orjson.dumps([key.as_dict() for key in found]).decode())
        return
    if not found:
        print("There is no key; veselova keys create NAME makes one.")
    for key in found:
        ends = key.revoked_at or key.expires_at
        until = "until " if key.state == "valid" else ""
        state = f"{key.state} {until}{ends:%Y-%m-%d}" if ends else key.state
        print(f"{key.id}  {key.created_at:%Y-%m-%d}  {key.scope:5}  {state:22}  {key.name}")


@keys.command()
def revoke(
    key_id: Annotated[
        str, typer.Argument(metavar="ID", help="the id of the key (veselova keys list)")
    ],
) -> None:
    """Revoke an API key; running servers refuse it from the next request on."""
    key = _keys().revoke(key_id)
    print(f"The key of {key.name}, id {key.id}, is revoked.")


def expiry(day: datetime | None) -> datetime | None:
    """Return the beginning of a day in UTC; raises InvalidInput unless it is to come."""
    moment = day and day.replace(tzinfo=UTC)
    if moment and moment <= datetime.now(UTC):
        raise InvalidInput(("--expires",), "a day to come", f"{moment:%Y-%m-%d}")
    return moment


def _keys() -> Keys:
    from veselova.service.access.keys import open_keys
    from veselova.service.http.server import settings_of_environment

    return open_keys(settings_of_environment())
