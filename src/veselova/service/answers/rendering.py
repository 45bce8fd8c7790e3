"""Answers as a worker process gives them: taken from the cache or computed, written in the format and coding asked for."""

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
from veselova.service.answers.cache_entry import DamagedEntry, Entry, packed, read_entry, unpacked
from veselova.service.api.json_documents import write_document
from veselova.service.api.media_types import FORMATS, Format, coded
from veselova.service.api.problem_details import Refused
from veselova.service.api.request_models import TrajectoryRequest
from veselova.service.workers.tasks import TASKS, requested_trajectory

__all__ = ["Delivery", "Wanted", "answered", "restored", "solved"]

#: Answers below this are not worth a content coding.
_SMALL = 1000

#: The largest entry that is sent to the server.
_MOST_SENT = 1_000_000


@dataclass(frozen=True)
class Wanted:
    """How an answer is to be given: the format's name, the content coding, and the file to write; in memory where it is None."""

    format: str
    coding: str
    place: str | None = None


@dataclass(frozen=True)
class Delivery:
    """An answer: its bytes, or None where they are in the file wanted; its coding and its provenance.

    Of the cache: whether the answer came from it, the bytes of the entry that was written, or the content of one that is yet to
    be, whether one was damaged, and why none could be read or written.
    """

    body: bytes | None
    coding: str
    provenance: str | None = None
    kept: bool = False
    stored: int = 0
    entry: bytes | None = None
    damaged: bool = False
    not_stored: str | None = None


def answered(kind: str, request: bytes, wanted: Wanted) -> Delivery:
    """Return the JSON answer of a kind other than a trajectory; ``request`` is the pickle of a validated request's fields."""
    model, compute = TASKS[kind]
    document = compute(model.model_validate(pickle.loads(request)))
    return _delivered(lambda stream: write_document(document, stream), wanted, wanted.coding)


def solved(request: bytes, wanted: Wanted, entry: Entry | None) -> Delivery:
    """Return a trajectory: the one that is kept as an entry of the cache, or one that is computed, and kept if that can be.

    A small entry is not written: it goes to the server, which does that when the answer has been sent.
    """
    damaged, failure = False, None
    if entry is not None and os.access(entry.path, os.F_OK):  # which raises nothing: most answers are new
        try:
            return _written(*read_entry(entry.path), wanted, kept=True)
        except FileNotFoundError:
            pass
        except DamagedEntry:
            damaged = True
        except OSError as error:
            failure = error.strerror or str(error)
    stated = pickle.loads(request)
    asked = TrajectoryRequest.model_validate(stated)
    trajectory = requested_trajectory(asked)
    kept: dict[str, Any] = {"damaged": damaged, "not_stored": failure}
    if entry is not None and failure is None:
        content = packed(stated, trajectory, min(entry.most, _MOST_SENT)) if wanted.place is None else None
        try:
            kept |= {"entry": content} if content else {"stored": entry.write(stated, trajectory)}
        except OSError as error:
            kept["not_stored"] = error.strerror or str(error)
    return _written(asked, trajectory, wanted, **kept)


def restored(kept: str | bytes, wanted: Wanted) -> Delivery:
    """Return a trajectory that was kept, in a file or as the content of one that is yet to be written.

    Raises DamagedEntry where the file is not whole, OSError where it cannot be read.
    """
    return _written(*(read_entry(kept) if isinstance(kept, str) else unpacked(kept)), wanted, kept=True)


def _written(asked: TrajectoryRequest, trajectory: Trajectory, wanted: Wanted, **facts: Any) -> Delivery:
    form: Format = FORMATS[wanted.format]
    coding = "identity" if form.compressed else wanted.coding
    facts["provenance"] = json.dumps(trajectory.provenance.as_dict())
    return _delivered(lambda stream: form.write(trajectory, stream, asked.outputs), wanted, coding, **facts)


def _delivered(write: Callable[[BinaryIO], None], wanted: Wanted, coding: str, **facts: Any) -> Delivery:
    """Return what is written, in its coding, with what else there is to say of it."""
    if wanted.place is not None:
        try:
            with Path(wanted.place).open("wb") as file, coded(file, coding) as stream:
                write(stream)
        except OSError as error:
            Path(wanted.place).unlink(missing_ok=True)
            raise Refused("storage-full", f"The answer could not be written: {error.strerror}.", retry_after=60) from None
        return Delivery(None, coding, **facts)
    plain = io.BytesIO()
    write(plain)
    if coding == "identity" or plain.tell() < _SMALL:
        return Delivery(plain.getvalue(), "identity", **facts)
    compact = io.BytesIO()
    with coded(compact, coding) as stream:
        stream.write(plain.getvalue())
    return Delivery(compact.getvalue(), coding, **facts)
