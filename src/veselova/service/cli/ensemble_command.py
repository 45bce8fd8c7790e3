"""``veselova solve`` of a file with many starts."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np

from veselova.mechanics.core.errors import InvalidInput
from veselova.service.api.ensemble_request import EnsembleRequest
from veselova.service.api.json_documents import encode, ensemble_document
from veselova.service.api.request_models import read_request
from veselova.service.cli.console import print_ensemble, print_json, terminal
from veselova.service.cli.files import check_file

__all__ = ["run"]

#: Endings of the files that an ensemble is written to.
_WRITERS = (".npz", ".json")


def run(
    document: Any,
    as_json: bool,
    output: Path | None,
    plot: Path | None,
    limits: Callable[[EnsembleRequest], AbstractContextManager[None]],
) -> None:
    """Solve all starts of a JSON document within the ``limits`` of its request; print what became
    of them, and write the arrays. Raises InvalidInput for a picture and for other files.
    """
    from veselova.service.workers.tasks import ensemble_request

    request = read_request(EnsembleRequest, document)
    check_file("--output", output, _WRITERS)
    if plot is not None:
        raise InvalidInput(("--plot",), "no picture and no film of many starts", str(plot))
    with limits(request):
        ensemble = ensemble_request(request)
    if output is not None and output.suffix.lower() == ".json":
        output.write_bytes(encode(ensemble_document(ensemble)))
    elif output is not None:
        ensemble.to_npz(output)
    if as_json:
        print_json(ensemble_document(ensemble))
        return
    console = terminal()
    print_ensemble(console, ensemble)
    for i in np.flatnonzero(~ensemble.solved)[:20].tolist():
        console.print(f"start {i}: {ensemble.detail[i]}", markup=False, highlight=False)
    if output is not None:
        print(f"Motions: {output}")
