"""Answers to requests for motions and tori: negotiated, taken from the cache or computed, in memory
or through the spool.
"""

from __future__ import annotations

from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Any

from anyio import to_thread
from starlette.requests import Request
from starlette.responses import Response

from veselova.service.answers.cache import Cache
from veselova.service.answers.cache_entry import DamagedEntry
from veselova.service.answers.disconnect import while_connected
from veselova.service.answers.etag import entity_tag, is_identity, matches
from veselova.service.answers.rendering import (
    Rendering,
    Representation,
    render_answer,
    render_kept,
    render_solution,
)
from veselova.service.answers.request_limits import require_acceptable
from veselova.service.answers.request_reading import Reader
from veselova.service.answers.spool import Place, Spool, SpooledResponse
from veselova.service.api.caller import caller_of
from veselova.service.api.content_negotiation import joined_field, negotiate_coding, negotiate_type
from veselova.service.api.media_types import FORMATS, Format, format_of
from veselova.service.api.problem_details import Refused
from veselova.service.api.settings import Settings
from veselova.service.observability.metrics import Metrics
from veselova.service.workers.pool import Workers

__all__ = ["PROVENANCE", "Answers"]

#: Bytes of a kept answer that is written to a file.
_LARGE_BYTES = 1_000_000

#: Bytes that an answer may take for each that is kept of it.
_TEXT_BYTES = 5

#: The header field that has the provenance of a trajectory, whatever its format, as JSON.
PROVENANCE = "Veselova-Provenance"

#: What a name stands for never changes; only who asked may keep it, since a server may ask for
#: keys.
_FOREVER = "private, max-age=31536000, immutable"

#: What Cache-Status says of an answer that came from the cache.
_HIT = "veselova; hit"


class Answers:
    """What one server answers, from its workers, its cache and its spool."""

    def __init__(
        self,
        settings: Settings,
        workers: Workers,
        reader: Reader,
        metrics: Metrics,
        shared: bool = False,
    ) -> None:
        """``shared`` says whether callers are told apart, so that none may take all room."""
        self._settings = settings
        self._root_path = settings.root_path
        self._workers = workers
        self._reader = reader
        self._metrics = metrics
        self._cache = Cache(settings.data_dir / "cache", settings.cache_bytes)
        most = settings.max_spool_bytes
        most_each = settings.max_spool_bytes_per_caller or (most // 4 if shared else most)
        self._spool = Spool(settings.data_dir / "spool", most, most_each)

    @asynccontextmanager
    async def serving(self) -> AsyncIterator[None]:
        """Keep the spool open for the life of the server."""
        await to_thread.run_sync(self._spool.open)
        try:
            yield
        finally:
            self._spool.close()

    async def document(self, kind: str, request: Request) -> Response:
        """Return the JSON answer of a comparison or a torus."""
        require_acceptable(joined_field(request.headers, "accept"))
        asked = await self._reader.parse_body(kind, request)
        place = self._place(request, asked.file_bytes)
        wanted = _wanted("json", request, place)

        async def work() -> Response:
            with self._metrics.work(kind, asked.system, asked.engine):
                rendering = await self._workers.run(
                    render_answer,
                    kind,
                    asked.content,
                    wanted,
                    budget_s=asked.budget_s,
                    caller=caller_of(request).name,
                )
            return _response(rendering, wanted, place, {"Vary": "Accept-Encoding"})

        return await self._run_while_connected(request, work, place)

    async def trajectory(self, request: Request) -> Response:
        """Return the answer to a POST, from the cache where it is kept; raises Refused where the
        client has it already.
        """
        form = _format(request)
        asked = await self._reader.parse_body("trajectory", request)
        name = asked.name
        kept_as = _cache_name(name, request)
        await self._require_news(request, kept_as, entity_tag(name, form.name))
        place = self._place(request, asked.file_bytes)
        wanted = _wanted(form.name, request, place)
        entry = self._cache.entry(kept_as)

        async def work() -> Response:
            with self._metrics.work("trajectory", asked.system, asked.engine) as ending:
                try:
                    rendering = await self._workers.run(
                        render_solution,
                        asked.content,
                        wanted,
                        entry,
                        budget_s=asked.budget_s,
                        caller=caller_of(request).name,
                    )
                    ending.cached = rendering.cached
                finally:
                    self._metrics.count_cached(hit=ending.cached)
            headers = self._headers(name, form, await self._keep(kept_as, rendering))
            return _response(
                rendering,
                wanted,
                place,
                {**headers, "Cache-Status": _HIT} if rendering.cached else headers,
            )

        return await self._run_while_connected(
            request, work, place, None if entry is None else entry.part
        )

    async def _require_news(self, request: Request, kept_as: str, tag: str) -> None:
        """Raise Refused where the client has the answer already: RFC 9110, 13.1.2, where 304
        answers GET and HEAD alone.
        """
        stated = joined_field(request.headers, "if-none-match")
        if stated is None:
            return
        if matches(stated, tag, await self._find(kept_as) is not None):
            raise Refused(
                "precondition-failed",
                f"If-None-Match: required another entity than {tag}, which this request has.",
            )

    async def _find(self, name: str) -> str | None:
        """Return the file of an entry that is kept."""
        return await to_thread.run_sync(self._cache.find, name)

    async def _keep(self, name: str, rendering: Rendering) -> bool:
        """See to what the cache has to do with an answer, and return whether it can
        be had again.
        """
        if rendering.damaged:
            await to_thread.run_sync(self._cache.discard, name, rendering.stored == 0)
        if rendering.not_stored is not None:
            self._cache.report(rendering.not_stored)
        if rendering.stored and self._cache.is_full(rendering.stored):
            await to_thread.run_sync(self._cache.make_room)
        return rendering.cached or rendering.stored > 0

    def _headers(self, name: str, form: Format, cached: bool = True) -> dict[str, str]:
        """Return what the headers of a trajectory say of its name: its own address where it can be
        had there again.
        """
        headers = {"ETag": entity_tag(name, form.name), "Vary": "Accept, Accept-Encoding"}
        if form.name != "json":
            headers["Content-Disposition"] = (
                f'attachment; filename="trajectory-{name[:12]}.{form.name}"'
            )
        return (
            {**headers, "Content-Location": f"{self._root_path}/v1/trajectories/{name}"}
            if cached
            else headers
        )

    async def get_kept(self, name: str, request: Request) -> Response:
        """Return the answer to a GET or HEAD of a kept trajectory; raises Refused where it is not
        kept (any more).
        """
        form = _format(request)
        kept_as = _cache_name(name, request)
        cached = await self._find(kept_as) if is_identity(name) else None
        if cached is None:
            raise _not_kept(name)
        headers = {**self._headers(name, form), "Cache-Control": _FOREVER}
        if matches(joined_field(request.headers, "if-none-match"), headers["ETag"], exists=True):
            return Response(status_code=304, headers=headers)
        if request.method == "HEAD":
            response = Response(headers={**headers, "Content-Type": form.media_type})
            del response.headers["content-length"]  # that of the GET is not known before it
            return response
        stored = _bytes(cached)
        place = self._place(request, _TEXT_BYTES * stored if stored > _LARGE_BYTES else 0)
        wanted = _wanted(form.name, request, place)

        async def work() -> Response:
            rendering = await self._restore(kept_as, cached, wanted, caller_of(request).name)
            if rendering is None:
                raise _not_kept(name)
            return _response(rendering, wanted, place, {**headers, "Cache-Status": _HIT})

        return await self._run_while_connected(request, work, place)

    async def _restore(
        self, name: str, cached: str, wanted: Representation, caller: str
    ) -> Rendering | None:
        """Return a kept answer, or None where it is damaged or has just been removed."""
        try:
            return await self._workers.run(
                render_kept, cached, wanted, budget_s=self._settings.max_budget_s, caller=caller
            )
        except DamagedEntry:
            await to_thread.run_sync(self._cache.discard, name)
        except FileNotFoundError:
            pass
        return None

    def _place(self, request: Request, file_bytes: int) -> Place | None:
        return self._spool.place(caller_of(request).name, file_bytes) if file_bytes else None

    @staticmethod
    async def _run_while_connected(
        request: Request, work: Any, place: Place | None, part: str | None = None
    ) -> Response:
        """Return what the work gives while the client is there; of work that was stopped no file is
        left.
        """
        try:
            return await while_connected(request, work)
        except BaseException:
            if place is not None:
                place.let_go()
            if part is not None:
                with suppress(OSError):
                    Path(part).unlink(missing_ok=True)
            raise


def _wanted(form: str, request: Request, place: Place | None) -> Representation:
    return Representation(form, _coding(request), None if place is None else place.path)


def _response(
    rendering: Rendering, wanted: Representation, place: Place | None, headers: Mapping[str, str]
) -> Response:
    fields = {**headers, "Content-Type": FORMATS[wanted.format].media_type}
    if rendering.coding != "identity":
        fields["Content-Encoding"] = rendering.coding
    if rendering.provenance is not None:
        fields[PROVENANCE] = rendering.provenance
    if rendering.body is not None or place is None:
        return Response(rendering.body, headers=fields)
    return SpooledResponse(place, fields)


def _format(request: Request) -> Format:
    return format_of(
        negotiate_type(
            joined_field(request.headers, "accept"),
            [entry.media_type for entry in FORMATS.values()],
        )
    )


def _coding(request: Request) -> str:
    return negotiate_coding(joined_field(request.headers, "accept-encoding"))


def _bytes(cached: str) -> int:
    try:
        return Path(cached).stat().st_size
    except OSError:
        return 0


def _cache_name(name: str, request: Request) -> str:
    """Return the name under which the cache has an answer: that of an owner is no name of an
    answer, and so nobody else's.
    """
    owner = caller_of(request).owner
    return f"{owner}-{name}" if owner else name


def _not_kept(name: str) -> Refused:
    return Refused(
        "no-such-answer",
        f"No trajectory is kept as {name[:80]}; POST its request to /v1/trajectories.",
    )
