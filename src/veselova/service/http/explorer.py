"""The explorer at ``/`` and the page of the API at ``/docs``: files of a bundle that the build of
the package makes, each with the policy that lets it run.
"""

from __future__ import annotations

import gzip
import hashlib
import mimetypes
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

from fastapi import FastAPI
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response

from veselova.service.api.content_negotiation import joined_field, negotiate_coding
from veselova.service.http.job_file import matches

__all__ = ["BUNDLE", "FILES", "MISSING", "BundledFile", "add_explorer", "find_file"]

#: Where the build puts the bundle (``explorer/build.py``); no commit has it.
BUNDLE = Path(__file__).parents[2] / "explorer"

#: The path of its files besides the page itself.
FILES = "/explorer/"

_POLICY = "; ".join(
    (
        "default-src 'none'",
        "script-src 'self'",
        "worker-src 'self'",
        "style-src 'self'",
        "font-src 'self'",
        "img-src 'self' data: blob:",
        "connect-src 'self'",
        "base-uri 'none'",
        "form-action 'none'",
        "frame-ancestors 'none'",
    )
)

#: The page of the API draws by scripts and styles of its own, and asks this server.
_POLICY_OF_DOCS = "; ".join(
    (
        "default-src 'none'",
        "script-src 'self'",
        "style-src 'self'",
        "img-src 'self' data:",
        "connect-src 'self'",
        "base-uri 'none'",
        "form-action 'none'",
        "frame-ancestors 'none'",
    )
)

#: Names of files hold a hash of what is in them, so they never change; the page names them anew.
_FOR_EVER = "public, max-age=31536000, immutable"

#: What is said where the bundle is missing.
MISSING = (
    "The explorer was not built with this installation: with Node 22 or newer in PATH, "
    "run `python explorer/build.py` in a clone and start the server again.\n"
)

#: The same at ``/docs``.
MISSING_DOCS = (
    "The page of the API was not built with this installation: with Node 22 or newer in PATH, run "
    "`python explorer/build.py` in a clone and start the server again; /openapi.json has it all.\n"
)

#: Types that mimetypes of some systems do not know.
_TYPES = {".js": "text/javascript", ".woff2": "font/woff2", ".css": "text/css"}

#: Types that are compressed already.
_COMPRESSED = frozenset({"font/woff2", "image/png"})


@dataclass(frozen=True)
class BundledFile:
    """A file of the bundle, read when it is asked for first."""

    path: Path

    @cached_property
    def content(self) -> bytes:
        """Return what is in the file."""
        return self.path.read_bytes()

    @cached_property
    def compressed(self) -> bytes | None:
        """Return the content in gzip, None where that saves nothing."""
        return None if self.media_type in _COMPRESSED else gzip.compress(self.content, mtime=0)

    @cached_property
    def etag(self) -> str:
        """Return the name of the content, in whatever coding."""
        return f'W/"{hashlib.sha256(self.content).hexdigest()[:32]}"'

    @property
    def media_type(self) -> str:
        """Return the media type by the name of the file."""
        known = _TYPES.get(self.path.suffix)
        return known or mimetypes.guess_type(self.path.name)[0] or "application/octet-stream"

    def answer(self, request: Request, cache_control: str, policy: str = _POLICY) -> Response:
        """Return the file, compressed where the client takes that; 304 where the client has it."""
        headers = {"ETag": self.etag, "Cache-Control": cache_control, "Vary": "Accept-Encoding"}
        headers["Content-Security-Policy"] = policy
        if matches(joined_field(request.headers, "if-none-match") or "", self.etag):
            return Response(status_code=304, headers=headers)
        content = self.content
        takes = joined_field(request.headers, "accept-encoding")
        if self.compressed is not None and negotiate_coding(takes, ("gzip",)) == "gzip":
            headers["Content-Encoding"] = "gzip"
            content = self.compressed
        return Response(content, headers=headers, media_type=self.media_type)


def find_file(path: Path) -> BundledFile | None:
    """Return a file as it is now, so that a bundle may be built under a server that runs."""
    try:
        return _file(path, path.stat().st_mtime_ns) if path.is_file() else None
    except (OSError, ValueError):
        return None


@lru_cache(maxsize=1024)
def _file(path: Path, _: int) -> BundledFile:
    return BundledFile(path)


def add_explorer(app: FastAPI, bundle: Path = BUNDLE) -> None:
    """Serve the explorer at ``/`` and the API's page at ``/docs``, or one sentence each where they
    were not built.
    """

    async def index(request: Request) -> Response:
        page = find_file(bundle / "index.html")
        if page is None:
            return PlainTextResponse(MISSING, status_code=404)
        return page.answer(request, "no-cache")

    async def documentation(request: Request) -> Response:
        page = find_file(bundle / "docs.html")
        if page is None:
            return PlainTextResponse(MISSING_DOCS, status_code=404)
        return page.answer(request, "no-cache", _POLICY_OF_DOCS)

    async def file(request: Request) -> Response:
        # The name is one part of a path: it leads to no other folder.
        found = find_file(bundle / "explorer" / request.path_params["name"])
        if found is None:
            return PlainTextResponse("The explorer has no such file.\n", status_code=404)
        return found.answer(request, _FOR_EVER)

    app.add_route("/", index, include_in_schema=False)
    app.add_route("/docs", documentation, include_in_schema=False)
    app.add_route(FILES + "{name}", file, include_in_schema=False)
