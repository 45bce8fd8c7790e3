"""How an endpoint that can be read is added: for GET and for HEAD at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from fastapi import APIRouter

__all__ = ["add_readable"]


def add_readable(
    routes: APIRouter, path: str, endpoint: Callable[..., Any], **described: Any
) -> None:
    """Add an endpoint for GET, and for HEAD, of which the OpenAPI document says nothing. The server
    sends no body to HEAD.
    """
    routes.add_api_route(path, endpoint, methods=["GET"], **described)
    routes.add_api_route(path, endpoint, methods=["HEAD"], include_in_schema=False)
