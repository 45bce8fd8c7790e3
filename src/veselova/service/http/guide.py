"""The guide at ``/guide/``: the documentation as ``docs/build`` makes it, with the one policy that
lets its pages work.
"""

from __future__ import annotations

import base64
import hashlib
import re
from functools import lru_cache
from pathlib import Path

from fastapi import FastAPI
from starlette.requests import Request
from starlette.responses import PlainTextResponse, RedirectResponse, Response

from veselova.service.http.explorer import BundledFile, find_file

__all__ = ["BUNDLE", "MISSING", "add_guide"]

#: Where ``docs/build`` puts the site; no commit has it.
BUNDLE = Path(__file__).parents[2] / "guide"

#: What is said where the site is missing.
MISSING = (
    "The guide was not built with this installation: run `docs/build` in a clone and start the "
    "server again.\n"
)

#: Scripts that stand in a page: the theme chooses light or dark before anything is drawn.
_INLINE_SCRIPT = re.compile(rb"<script(?![^>]*\bsrc=)[^>]*>(.*?)</script>", re.DOTALL)


@lru_cache(maxsize=1024)
def _policy(file: BundledFile) -> str:
    """Return the policy of a page: its own scripts by their hashes, files of the same origin,
    nothing else. The style of a formula stands in its elements.
    """
    scripts = _INLINE_SCRIPT.findall(file.content) if file.path.suffix == ".html" else []
    digests = dict.fromkeys(
        base64.b64encode(hashlib.sha256(script).digest()).decode() for script in scripts
    )
    return "; ".join(
        (
            "default-src 'none'",
            " ".join(("script-src 'self'", *(f"'sha256-{digest}'" for digest in digests))),
            "style-src 'self' 'unsafe-inline'",
            "font-src 'self'",
            "img-src 'self' data:",
            "connect-src 'self'",
            "base-uri 'none'",
            "form-action 'self'",
            "frame-ancestors 'none'",
        )
    )


def add_guide(app: FastAPI, bundle: Path = BUNDLE) -> None:
    """Serve the guide at ``/guide/``, or one sentence where it was not built."""

    async def start(_: Request) -> Response:
        return RedirectResponse("guide/", 308)  # relative: right below any prefix of a proxy

    async def file(request: Request) -> Response:
        if not (bundle / "index.html").is_file():
            return PlainTextResponse(MISSING, status_code=404)
        # A name that leads out of the folder, by dots or by a root of its own, is no file of it.
        try:
            path = (bundle / (request.path_params["path"] or "index.html")).resolve()
        except (OSError, ValueError):
            path = bundle
        found = find_file(path) if path.is_relative_to(bundle.resolve()) else None
        if found is None:
            return PlainTextResponse("The guide has no such page.\n", status_code=404)
        return found.answer(request, "no-cache", _policy(found))

    app.add_route("/guide", start, include_in_schema=False)
    app.add_route("/guide/{path:path}", file, include_in_schema=False)
