"""The systems by the names that documents have for them, and problems from such documents."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from importlib import import_module
from typing import Any

from veselova.mechanics.core.errors import (
    Faults,
    InvalidInput,
    field_faults,
    show,
    unknown_name,
)
from veselova.mechanics.core.problem import Problem

__all__ = ["SYSTEMS", "class_of", "read_problem", "require_fields"]

#: System → the file of this chapter that defines it, and its class.
SYSTEMS: Mapping[str, tuple[str, str]] = {
    "veselova": ("veselova", "Veselova"),
    "veselova-so3": ("veselova_so3", "VeselovaSO3"),
    "rubber-ball": ("rubber_ball", "RubberBall"),
    "chaplygin-ball": ("chaplygin_ball", "ChaplyginBall"),
    "neumann": ("neumann", "NeumannSystem"),
    "ellipsoid-geodesic": ("ellipsoid", "EllipsoidGeodesic"),
    "separable": ("separable_veselova", "SeparableVeselova"),
    "euler-poisson": ("rigid_body", "EulerPoisson"),
    "lr": ("lr_system", "LRSystem"),
    "stiefel": ("stiefel", "StiefelFlow"),
}


def class_of(system: str) -> type[Problem]:
    """Return the class of one of ``SYSTEMS``."""
    file, name = SYSTEMS[system]
    kind: type[Problem] = getattr(import_module(f"veselova.mechanics.systems.{file}"), name)
    return kind


def require_fields(kind: type[Problem], fields: Mapping[str, Any], place: str) -> None:
    """Raise InvalidInput, located at a place, for fields that a class does not take or lacks."""
    known = inspect.signature(kind).parameters
    needed = [name for name, argument in known.items() if argument.default is argument.empty]
    faults = Faults()
    faults.found += field_faults((place,), fields, list(known), needed)
    faults.require_none()


def read_problem(document: Any) -> Problem:
    """Return the problem that ``problem.as_request()`` states as a document.

    Raises InvalidInput, which names the field, for an unknown system and for fields that the
    system's class does not take, lacks or refuses.
    """
    if not isinstance(document, Mapping):
        raise InvalidInput(("problem",), "an object with the field system", show(document))
    system = document.get("system")
    if not isinstance(system, str) or system not in SYSTEMS:
        raise unknown_name(("problem", "system"), system, list(SYSTEMS))
    kind = class_of(system)
    fields = {name: value for name, value in document.items() if name != "system"}
    require_fields(kind, fields, "problem")
    try:
        return kind(**fields)
    except InvalidInput as error:
        raise error.below("problem") from None
