"""Request bodies read, and answers rendered in the negotiated format, in a worker process."""

from __future__ import annotations

import io
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO, TypeVar

from veselova.mechanics.core.decimals import FEWEST_DIGITS
from veselova.mechanics.core.errors import InvalidInput, show
from veselova.mechanics.results.trajectory import Trajectory
from veselova.service.api.json_documents import write_document
from veselova.service.api.media_types import FORMATS
from veselova.service.api.problem_details import Refused, loads
from veselova.service.api.request_models import BudgetedRequest, read_request
from veselova.service.api.settings import Settings
from veselova.service.workers.tasks import TASKS

#: Doubles from which an answer is written to a file.
_LARGE = 100_000

_Model = TypeVar("_Model", bound=BudgetedRequest)


@dataclass(frozen=True)
class Rendering:
    """The bytes of an answer, None where they are in the file; the provenance of a trajectory."""

    body: bytes | None
    provenance: dict[str, Any] | None = None


def read_body(model: type[_Model], body: bytes, settings: Settings) -> _Model:
    """Return the request of a body; raises InvalidRequest with all of its faults, Refused for
    malformed JSON.
    """
    return read_request(model, loads(body), partial(beyond_limits, settings=settings))


def check(model: type[BudgetedRequest], body: bytes, settings: Settings) -> None:
    """Raise what ``read_body`` raises."""
    read_body(model, body, settings)


def beyond_limits(request: BudgetedRequest, settings: Settings) -> list[InvalidInput]:
    """Return the limits of a server that a request exceeds, before its numbers are validated."""
    limits = (
        (("budget_s",), request.budget_s, settings.max_budget_s, "on this server"),
        (*request.dimension_at, settings.max_dimension, "entries on this server"),
        (*request.values_at, settings.max_values, "numbers in one answer on this server"),
    )
    return [
        InvalidInput(place, f"at most {most} {unit}", show(given))
        for place, given, most, unit in limits
        if given > most
    ]


def render(kind: str, body: bytes, form: str, path: Path, settings: Settings) -> Rendering:
    """Return the answer of a kind of TASKS in one of the FORMATS, or its provenance where it is
    large and ``path`` is its file. Raises as ``read_body`` does.
    """
    model, compute = TASKS[kind]
    asked: Any = read_body(model, body, settings)
    found = compute(asked)
    provenance = found.provenance.as_dict() if isinstance(found, Trajectory) else None

    def write(stream: BinaryIO) -> None:
        if isinstance(found, Trajectory):
            FORMATS[form].write(found, stream, asked.outputs)
        else:
            write_document(found, stream)

    if asked.values_at[1] * getattr(asked, "digits", FEWEST_DIGITS) > _LARGE * FEWEST_DIGITS:
        try:
            with path.open("wb") as file:
                write(file)
        except OSError as error:
            detail = f"The answer could not be written: {error.strerror}."
            raise Refused("storage-full", detail, retry_after=60) from None
        return Rendering(None, provenance)
    stream = io.BytesIO()
    write(stream)
    return Rendering(stream.getvalue(), provenance)
