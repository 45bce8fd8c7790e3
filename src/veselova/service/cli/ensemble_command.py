"""``veselova solve`` of a file with many starts."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from veselova.service.api.ensemble_request import EnsembleRequest
from veselova.service.api.json_documents import encode, ensemble_document
from veselova.service.api.request_models import read_request
from veselova.service.cli.console import print_ensemble, print_json, terminal

__all__ = ["WRITERS", "read", "show"]

#: Endings of the files that an ensemble is written to.
WRITERS = (".npz", ".json")


def read(document: Any) -> EnsembleRequest:
    """Return the request that a file states; raises InvalidRequest."""
    return read_request(EnsembleRequest, document)


def show(request: EnsembleRequest, as_json: bool, output: Path | None) -> None:
    """Solve all starts; print what became of them, and write the arrays."""
    from veselova.service.workers.tasks import ensemble_request

    ensemble = ensemble_request(request)
    if output is not None and output.suffix.lower() == ".json":
        output.write_bytes(encode(ensemble_document(ensemble)))
    elif output is not None:
        ensemble.to_npz(output)
    if as_json:
        print_json(ensemble_document(ensemble))
        return
    print_ensemble(terminal(), ensemble)
    for i in np.flatnonzero(~ensemble.solved)[:20].tolist():
        print(f"start {i}: {ensemble.detail[i]}")
    if output is not None:
        print(f"Motions: {output}")
