"""Answers as a worker process gives them: computed or taken from the cache, written in the format and coding asked for."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from veselova.mechanics.archive import read_archive, write_archive
from veselova.mechanics.errors import VeselovaError
from veselova.mechanics.trajectory import Trajectory
from veselova.service.documents import stored_outputs, write_document
from veselova.service.formats import FORMATS, Format, coded
from veselova.service.problem_details import Refused
from veselova.service.schemas import TrajectoryRequest
from veselova.service.tasks import TASKS, requested_trajectory

__all__ = ["DamagedEntry", "Delivery", "Wanted", "answered", "restored", "solved"]

#: Answers below this are not worth a content coding.
_SMALL = 1000

#: The text in an archive that says what was asked.
_REQUEST = "request"


class DamagedEntry(VeselovaError):
    """A file of the cache that does not hold what was put into it."""


@dataclass(frozen=True)
class Wanted:
    """How an answer is to be given: the format's name, the content coding, and the file to write; in memory where it is None."""

    format: str
    coding: str
    place: str | None = None


@dataclass(frozen=True)
class Delivery:
    """An answer: its bytes, or None where they are in the file wanted; its coding, provenance, and why it could not be stored."""

    body: bytes | None
    coding: str
    provenance: str | None = None
    not_stored: str | None = None


def answered(kind: str, request: Mapping[str, Any], wanted: Wanted) -> Delivery:
    """Return the JSON answer of a kind other than a trajectory; ``request`` is the dump of a validated request."""
    model, compute = TASKS[kind]
    document = compute(model.model_validate(request))
    return _delivered(lambda stream: write_document(document, stream), wanted, wanted.coding)


def solved(request: Mapping[str, Any], wanted: Wanted, store: str | None) -> Delivery:
    """Return a trajectory, computed; it is kept in the file ``store`` as well, if that can be written."""
    asked = TrajectoryRequest.model_validate(request)
    trajectory = requested_trajectory(asked)
    delivery = _written(trajectory, asked.outputs, wanted)
    if store is None:
        return delivery
    try:
        _keep(trajectory, asked, store)
    except OSError as error:
        with suppress(OSError):
            Path(store).unlink(missing_ok=True)
        return Delivery(delivery.body, delivery.coding, delivery.provenance, error.strerror or str(error))
    return delivery


def restored(path: str, wanted: Wanted) -> Delivery:
    """Return a trajectory that was kept; raises DamagedEntry where the file is not whole, FileNotFoundError where it is gone."""
    try:
        with Path(path).open("rb") as file, np.load(file) as archive:
            asked = TrajectoryRequest.model_validate(json.loads(str(archive[_REQUEST])))
            trajectory = read_archive(asked.problem.problem(), archive)
    except FileNotFoundError:
        raise
    except (zipfile.BadZipFile, ValueError, KeyError, TypeError, EOFError, OSError, VeselovaError) as error:
        raise DamagedEntry(f"{path}: {type(error).__name__}") from None
    return _written(trajectory, asked.outputs, wanted)


def _keep(trajectory: Trajectory, asked: TrajectoryRequest, store: str) -> None:
    kept = tuple(trajectory.problem.outputs) if trajectory.decimals is not None else stored_outputs(trajectory.problem)
    notes = {_REQUEST: json.dumps({**asked.model_dump(), "times": [0.0]})}  # the times are in the archive
    with Path(store).open("wb") as stream:
        write_archive(trajectory, stream, kept, compressed=False, notes=notes)


def _written(trajectory: Trajectory, outputs: list[str] | None, wanted: Wanted) -> Delivery:
    form: Format = FORMATS[wanted.format]
    coding = "identity" if form.compressed else wanted.coding
    provenance = json.dumps(trajectory.provenance.as_dict())
    return _delivered(lambda stream: form.write(trajectory, stream, outputs), wanted, coding, provenance)


def _delivered(write: Callable[[BinaryIO], None], wanted: Wanted, coding: str, provenance: str | None = None) -> Delivery:
    if wanted.place is not None:
        try:
            with Path(wanted.place).open("wb") as file, coded(file, coding) as stream:
                write(stream)
        except OSError as error:
            Path(wanted.place).unlink(missing_ok=True)
            raise Refused("storage-full", f"The answer could not be written: {error.strerror}.", retry_after=60) from None
        return Delivery(None, coding, provenance)
    plain = io.BytesIO()
    write(plain)
    if coding == "identity" or plain.tell() < _SMALL:
        return Delivery(plain.getvalue(), "identity", provenance)
    compact = io.BytesIO()
    with coded(compact, coding) as stream:
        stream.write(plain.getvalue())
    return Delivery(compact.getvalue(), coding, provenance)
