"""Answers as a worker process gives them: computed, and written in the format and coding asked
for.
"""

from __future__ import annotations

import io
import pickle
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO

from veselova.service.answers.request_limits import beyond_limits
from veselova.service.api.json_documents import write_document
from veselova.service.api.media_types import FORMATS, encode_stream
from veselova.service.api.problem_details import Refused
from veselova.service.api.request_models import require_valid
from veselova.service.api.settings import Settings
from veselova.service.workers.tasks import TASKS, solve_request

__all__ = ["Rendering", "Representation", "render"]

#: Answers below this are not worth a content coding.
_SMALL = 1000


@dataclass(frozen=True)
class Representation:
    """The format and the content coding of an answer, and the file to write, None for bytes."""

    format: str
    coding: str
    path: Path | None = None


@dataclass(frozen=True)
class Rendering:
    """The bytes of an answer, None where they are in the file wanted; its coding, and the
    provenance of a trajectory.
    """

    body: bytes | None
    coding: str
    provenance: dict[str, Any] | None = None


def render(kind: str, request: bytes, wanted: Representation, settings: Settings) -> Rendering:
    """Return the answer of a kind of TASKS; ``request`` is the pickle of its model. Raises
    InvalidRequest with all faults of a request whose fields are there.
    """
    asked = pickle.loads(request)
    require_valid(asked, partial(beyond_limits, settings=settings))
    if kind != "trajectory":
        document = TASKS[kind][1](asked)
        return _deliver(lambda stream: write_document(document, stream), wanted, wanted.coding)
    form = FORMATS[wanted.format]
    trajectory = solve_request(asked)
    return _deliver(
        lambda stream: form.write(trajectory, stream, asked.outputs),
        wanted,
        "identity" if form.compressed else wanted.coding,
        trajectory.provenance.as_dict(),
    )


def _deliver(
    write: Callable[[BinaryIO], None],
    wanted: Representation,
    coding: str,
    provenance: dict[str, Any] | None = None,
) -> Rendering:
    """Return what is written, in its coding."""
    if wanted.path is not None:
        try:
            with wanted.path.open("wb") as file, encode_stream(file, coding) as stream:
                write(stream)
        except OSError as error:
            wanted.path.unlink(missing_ok=True)
            detail = f"The answer could not be written: {error.strerror}."
            raise Refused("storage-full", detail, retry_after=60) from None
        return Rendering(None, coding, provenance)
    plain = io.BytesIO()
    write(plain)
    if coding == "identity" or plain.tell() < _SMALL:
        return Rendering(plain.getvalue(), "identity", provenance)
    compact = io.BytesIO()
    with encode_stream(compact, coding) as stream:
        stream.write(plain.getvalue())
    return Rendering(compact.getvalue(), coding, provenance)
