"""The commands for operators of a server: ``veselova serve`` and ``veselova keys``."""

from __future__ import annotations

import re
from contextlib import suppress
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, Annotated

import orjson
import typer

from veselova.mechanics.core.errors import InvalidInput, show

if TYPE_CHECKING:
    from veselova.service.access.keys import Keys


_UNITS = {"h": timedelta(hours=1), "d": timedelta(days=1), "w": timedelta(weeks=1)}

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
            help="proxies with TLS, time and rate limits, whose X-Forwarded-For is trusted",
        ),
    ] = None,
    settings: Annotated[
        bool, typer.Option("--settings", help="print the limits, and the variables that set them")
    ] = False,
) -> None:
    """Serve the HTTP API until interrupted (limits: environment variables VESELOVA_…)."""
    from veselova.service.http.server import serve as run_server

    if require_keys and insecure:
        raise InvalidInput(("--insecure",), "one of --require-keys and --insecure", "both")
    keys = "required" if require_keys else "off" if insecure else None
    run_server(host, port, settings, forwarded_allow_ips, keys=keys)


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
        str | None,
        typer.Option(
            metavar="WHEN", help="90d, 12h, 4w or a date such as 2030-01-31; never when left out"
        ),
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
    expires_at = expiry(expires, datetime.now(UTC))
    key, text = _keys().create(name, scope, expires_at, same_owner_as)
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


def expiry(text: str | None, now: datetime) -> datetime | None:
    """Return the moment that ``90d``, ``12h``, ``4w`` or a date such as ``2030-01-31`` states (its
    beginning in UTC); raises InvalidInput for other text, and for a moment in the past.
    """
    if text is None:
        return None
    if form := re.fullmatch(r"([1-9][0-9]{0,4})([hdw])", text):
        return now + int(form[1]) * _UNITS[form[2]]
    with suppress(ValueError):
        moment = datetime.strptime(text, "%Y-%m-%d").replace(tzinfo=UTC)
        if moment > now:
            return moment
    required = "a time to come: 90d, 12h, 4w, or a date such as 2030-01-31"
    raise InvalidInput(("--expires",), required, show(text))


def _keys() -> Keys:
    from veselova.service.access.keys import open_keys
    from veselova.service.http.server import settings_of_environment

    return open_keys(settings_of_environment())
