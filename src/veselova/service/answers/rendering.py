"""Answers as a worker process gives them: taken from the cache or computed, written in the format
and coding asked for.
"""

from __future__ import annotations

import io
import json
import os
import pickle
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

from veselova.mechanics.results.trajectory import Trajectory
from veselova.service.answers.cache_entry import DamagedEntry, Entry, read_entry
from veselova.service.api.json_documents import write_document
from veselova.service.api.media_types import FORMATS, Format, encode_stream
from veselova.service.api.problem_details import Refused
from veselova.service.api.request_models import TrajectoryRequest
from veselova.service.workers.tasks import TASKS, solve_request

__all__ = ["Rendering", "Representation", "render_answer", "render_kept", "render_solution"]

#: Answers below this are not worth a content coding.
_SMALL = 1000


@dataclass(frozen=True)
class Representation:
    """How an answer is to be given: the format's name, the content coding, and the file to write;
    in memory where it is None.
    """

    format: str
    coding: str
    place: str | None = None


@dataclass(frozen=True)
class Rendering:
    """An answer: its bytes, or None where they are in the file wanted; its coding and its
    provenance.

    Of the cache: whether the answer came from it, the bytes of the entry that was written, whether
    one was damaged, and why none could be read or written.
    """

    body: bytes | None
    coding: str
    provenance: str | None = None
    cached: bool = False
    stored: int = 0
    damaged: bool = False
    not_stored: str | None = None


def render_answer(kind: str, request: bytes, wanted: Representation) -> Rendering:
    """Return the JSON answer of a kind other than a trajectory; ``request`` is the pickle of a
    validated request's fields.
    """
    model, compute = TASKS[kind]
    document = compute(model.model_validate(pickle.loads(request)))
    return _deliver(lambda stream: write_document(document, stream), wanted, wanted.coding)


def render_solution(request: bytes, wanted: Representation, entry: Entry | None) -> Rendering:
    """Return a trajectory: the one that is kept as an entry of the cache, or one that is computed,
    and kept if that can be.
    """
    damaged = False
    failure = None
    # which raises nothing: most answers are new
    if entry is not None and os.access(entry.path, os.F_OK):
        try:
            return _write(*read_entry(entry.path), wanted, cached=True)
        except FileNotFoundError:
            pass
        except DamagedEntry:
            damaged = True
        except OSError as error:
            failure = error.strerror or str(error)
    stated = pickle.loads(request)
    asked = TrajectoryRequest.model_validate(stated)
    trajectory = solve_request(asked)
    cached: dict[str, Any] = {"damaged": damaged, "not_stored": failure}
    if entry is not None and failure is None:
        try:
            cached["stored"] = entry.write(stated, trajectory)
        except OSError as error:
            cached["not_stored"] = error.strerror or str(error)
    return _write(asked, trajectory, wanted, **cached)


def render_kept(path: str, wanted: Representation) -> Rendering:
    """Return a trajectory that is kept in a file.

    Raises DamagedEntry where the file is not whole, OSError where it cannot be read.
    """
    return _write(*read_entry(path), wanted, cached=True)


def _write(
    asked: TrajectoryRequest, trajectory: Trajectory, wanted: Representation, **facts: Any
) -> Rendering:
    form: Format = FORMATS[wanted.format]
    coding = "identity" if form.compressed else wanted.coding
    facts["provenance"] = json.dumps(trajectory.provenance.as_dict())
    return _deliver(
        lambda stream: form.write(trajectory, stream, asked.outputs), wanted, coding, **facts
    )


def _deliver(
    write: Callable[[BinaryIO], None], wanted: Representation, coding: str, **facts: Any
) -> Rendering:
    """Return what is written, in its coding, with what else there is to say of it."""
    if wanted.place is not None:
        try:
            with Path(wanted.place).open("wb") as file, encode_stream(file, coding) as stream:
                write(stream)
        except OSError as error:
            Path(wanted.place).unlink(missing_ok=True)
            raise Refused(
                "storage-full",
                f"The answer could not be written: {error.strerror}.",
                retry_after=60,
            ) from None
        return Rendering(None, coding, **facts)
    plain = io.BytesIO()
    write(plain)
    if coding == "identity" or plain.tell() < _SMALL:
        return Rendering(plain.getvalue(), "identity", **facts)
    compact = io.BytesIO()
    with encode_stream(compact, coding) as stream:
        stream.write(plain.getvalue())
    return Rendering(compact.getvalue(), coding, **facts)
