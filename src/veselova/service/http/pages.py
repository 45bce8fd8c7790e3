"""The explorer at ``/``, the page of the API at ``/docs`` and the guide at ``/guide/``: files that
the build of the package makes, each with the policy that lets it run.
"""

from __future__ import annotations

import base64
import hashlib
import os
import re
from collections.abc import Awaitable, Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

from fastapi import FastAPI
from starlette.requests import Request
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

#: Where the builds put the files (``explorer/build.py``, ``docs/build``); no commit has them.
EXPLORER = Path(__file__).parents[2] / "explorer"
GUIDE = Path(__file__).parents[2] / "guide"

_MISSING = "{} was not built with this installation: {} in a clone and start the server again.\n"

#: What is said where the explorer or the guide is missing.
MISSING = _MISSING.format(
    "The explorer", "with Node 22 or newer in PATH, run `python explorer/build.py`"
)
_MISSING_GUIDE = _MISSING.format("The guide", "run `docs/build`")

#: Scripts that stand in a page: the theme of the guide chooses light or dark before it draws.
_INLINE_SCRIPT = re.compile(rb"<script(?![^>]*\bsrc=)[^>]*>(.*?)</script>", re.DOTALL)

#: Names of files hold a hash of what is in them, so they never change; a page names them anew.
_FOR_EVER = "public, max-age=31536000, immutable"


class _Files(StaticFiles):
    """A folder, with the policy of the explorer, or of the guide where styles stand in pages. Where
    it has no ``index.html``, ``missing`` is said.
    """

    def __init__(
        self, folder: Path, missing: str = "", cache: str = "no-cache", styled: bool = False
    ) -> None:
        super().__init__(directory=folder, check_dir=False)
        self.config_checked = True  # a folder may be missing
        self._missing = "" if (folder / "index.html").is_file() else missing
        self._cache = cache
        self._styled = styled

    async def get_response(self, path: str, scope: Scope) -> Response:
        """Return a file, whose name is that of the start for the folder itself."""
        if self._missing:
            return PlainTextResponse(self._missing, status_code=404)
        return await super().get_response("index.html" if path == "." else path, scope)

    def file_response(
        self, full_path: Any, stat_result: os.stat_result, *others: Any, **options: Any
    ) -> Response:
        """Return a file, or 304, with its headers."""
        response = super().file_response(full_path, stat_result, *others, **options)
        response.headers["Cache-Control"] = self._cache
        policy = _policy(str(full_path), stat_result.st_mtime_ns, self._styled)
        response.headers["Content-Security-Policy"] = policy
        return response


@lru_cache(maxsize=1024)
def _policy(path: str, _: int, styled: bool) -> str:
    """Return the policy of a file: its own scripts by their hashes, files of the same origin,
    nothing else. The style of a formula stands in its elements.
    """
    scripts = _INLINE_SCRIPT.findall(Path(path).read_bytes()) if path.endswith(".html") else []
    digests = [base64.b64encode(hashlib.sha256(script).digest()).decode() for script in scripts]
    hashes = dict.fromkeys(f"'sha256-{digest}'" for digest in digests)
    return "; ".join(
        (
            "default-src 'none'",
            " ".join(("script-src 'self'", *hashes)),
            "style-src 'self' 'unsafe-inline'" if styled else "style-src 'self'",
            "worker-src 'self'",
            "font-src 'self'",
            "img-src 'self' data: blob:",
            "connect-src 'self'",
            "base-uri 'none'",
            "form-action 'self'" if styled else "form-action 'none'",
            "frame-ancestors 'none'",
        )
    )


def add_explorer(app: FastAPI, bundle: Path = EXPLORER) -> None:
    """Serve the explorer at ``/`` and ``/geodesics``, and the API's page at ``/docs``."""
    pages = _Files(bundle, MISSING)

    def page(name: str) -> Callable[[Request], Awaitable[Response]]:
        async def answer(request: Request) -> Response:
            return await pages.get_response(f"{name}.html", request.scope)

        return answer

    for path, name in (("/", "index"), ("/geodesics", "geodesics"), ("/docs", "docs")):
        app.add_route(path, page(name), include_in_schema=False)
    app.mount("/explorer", _Files(bundle / "explorer", cache=_FOR_EVER))


def add_guide(app: FastAPI, bundle: Path = GUIDE) -> None:
    """Serve the guide at ``/guide/``."""

    async def start(_: Request) -> Response:
        return RedirectResponse("guide/", 308)  # relative: right below any prefix of a proxy

    app.add_route("/guide", start, include_in_schema=False)
    app.mount("/guide", _Files(bundle, _MISSING_GUIDE, styled=True))
