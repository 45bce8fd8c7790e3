"""The name of an answer: a hash of the request that it answers, with every default filled in and
the budget left out.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

from veselova.service.api.problem_models import SYSTEMS
from veselova.service.api.request_models import TrajectoryRequest
from veselova.version import __version__

__all__ = ["cache_key", "entity_tag", "is_identity", "matches"]


#: Canonical text: a dictionary has no order.
_ENCODER = json.JSONEncoder(sort_keys=True, separators=(",", ":"))


def cache_key(request: TrajectoryRequest, stated: Mapping[str, Any]) -> str:
    """Return the SHA-256 of the canonical request and of the version of the package, which answers
    it, in hexadecimal.

    ``stated`` is the request as JSON values.
    """
    kind = SYSTEMS[request.problem.system].problem_class
    engine = request.chosen_engine
    formulation = request.formulation or (kind.formulations[0] if engine == "numeric" else None)
    chosen = {
        "engine": engine,
        "formulation": formulation,
        "outputs": list(request.outputs or kind.outputs),
    }
    document = {**stated, **chosen, "version": __version__}
    del document["budget_s"]
    return hashlib.sha256(_ENCODER.encode(_canonical(document)).encode()).hexdigest()


def is_identity(text: str) -> bool:
    """Return whether a text could be the name of an answer."""
    return len(text) == hashlib.sha256().digest_size * 2 and all(
        letter in "0123456789abcdef" for letter in text
    )


def entity_tag(name: str, format_name: str) -> str:
    """Return the ETag of one format of an answer; weak, since an answer that is computed again took
    other seconds.
    """
    return f'W/"{name}-{format_name}"'


def matches(if_none_match: str | None, tag: str, exists: bool) -> bool:
    """Return whether an If-None-Match header names the tag, in weak comparison; ``*`` names any
    answer that exists.
    """
    names = [part.strip().removeprefix("W/") for part in (if_none_match or "").split(",")]
    return tag.removeprefix("W/") in names or (exists and names == ["*"])


def _canonical(value: Any) -> Any:
    """Return a JSON value with 3 and 3.0 written alike. A string is a number taken exactly, and
    stays what it is.
    """
    kind = type(value)
    if kind is int:
        return float(value) if abs(value) <= 2**53 else value
    if kind is list or kind is tuple:
        return [item if type(item) is float else _canonical(item) for item in value]
    if kind is dict:
        return {key: _canonical(item) for key, item in value.items()}
    return value
