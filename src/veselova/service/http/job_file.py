"""The files of jobs, whole or in parts."""

from __future__ import annotations

from starlette.datastructures import Headers
from starlette.responses import FileResponse
from starlette.types import Message, Receive, Scope, Send

from veselova.service.api.problem_details import Refused, problem_response
from veselova.service.observability.request_log import note

__all__ = ["JobFile"]


class JobFile(FileResponse):
    """A file, or what its client asks of it (Range). What is no range is left aside, as RFC 9110,
    14.2 has it; one beyond the end is refused with a problem document.
    """

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send the file, a part of it, or a refusal."""
        refused: Message | None = None

        async def watch(message: Message) -> None:
            nonlocal refused
            if message["type"] == "http.response.start" and message["status"] >= 400:
                refused = message
            if refused is None:
                await send(message)

        await super().__call__(scope, receive, watch)
        if refused is None:
            return
        stated = Headers(raw=list(refused["headers"]))
        if "content-range" not in stated:
            others = [field for field in scope["headers"] if field[0] != b"range"]
            await super().__call__({**scope, "headers": others}, receive, send)
            return
        error = Refused(
            "range-not-satisfiable", "Range: required a part of the file; given one beyond its end."
        )
        note(outcome=error.code)
        response = problem_response(error)
        response.headers["Content-Range"] = stated["content-range"]
        await response(scope, receive, send)
