"""The JSON of requests for a motion as data, for a curve, and for theta functions."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Annotated, Any, ClassVar

from pydantic import ConfigDict, Field, WithJsonSchema

from veselova.mechanics.core.curve_arguments import (
    CURVE_OUTPUTS,
    LARGEST_GENUS,
    curve_arguments,
    curve_outputs,
    exact_points,
    points_with_sheets,
    torus_points,
)
from veselova.mechanics.core.decimals import FEWEST_DIGITS, MOST_DIGITS
from veselova.mechanics.core.errors import Faults, InvalidInput, show
from veselova.mechanics.core.theta_arguments import ThetaArguments
from veselova.mechanics.results.closed_form import require_accuracy
from veselova.service.api.complex_numbers import from_pairs
from veselova.service.api.examples import CURVE, THETA
from veselova.service.api.problem_models import NUMBER
from veselova.service.api.request_models import BudgetedRequest, TorusRequest

__all__ = ["ClosedFormRequest", "CurveRequest", "ThetaRequest", "ToolkitRequest"]

_COMPLEX = {
    "anyOf": [NUMBER, {"type": "array", "items": NUMBER, "minItems": 2, "maxItems": 2}],
    "description": "a number, or a pair [real, imaginary]",
}


def _list_of(items: dict[str, Any], least: int = 1) -> dict[str, Any]:
    return {"type": "array", "items": items, "minItems": least}


def _or_null(schema: dict[str, Any]) -> WithJsonSchema:
    return WithJsonSchema({"anyOf": [schema, {"type": "null"}]})


#: Lists longer than branch points may be are refused before anything is counted.
_MANY = 100

_ROWS = _list_of(_list_of(_COMPLEX))
_ROW_PAIR = {"type": "array", "items": _list_of(NUMBER), "minItems": 2, "maxItems": 2}


class ClosedFormRequest(TorusRequest):
    """A problem whose motion is asked for as data."""

    accuracy: Annotated[
        Any,
        WithJsonSchema(
            {
                "anyOf": [
                    {"type": "number", "exclusiveMinimum": 0, "maximum": 1e-2},
                    {"type": "null"},
                ]
            }
        ),
        Field(
            description="error that modes left out of the time map may make, 1e-15 or more; "
            "1e-12 when left out"
        ),
    ] = None

    def option_faults(self) -> list[InvalidInput]:
        """Return what is wrong with the request beyond its fields."""
        faults = Faults()
        faults.attempt(require_accuracy, self.accuracy)
        return faults.found


class ToolkitRequest(BudgetedRequest):
    """What is asked of a curve, or of theta functions, at points."""

    #: The fields that have points; faults of their number are those of the first.
    point_fields: ClassVar[tuple[str, ...]]

    def point_count(self) -> int:
        """Return how many points there are, before anything is validated."""
        given = (getattr(self, name, None) for name in self.point_fields)
        return sum(len(points) for points in given if isinstance(points, list))

    def value_count(self) -> int:
        """Return how many complex numbers an answer has at the points, before anything is
        validated.
        """
        raise NotImplementedError


class CurveRequest(ToolkitRequest):
    """The curve w² = sign·Π(λ−b_j) with real branch points: its periods, its Riemann matrix, and
    the images of points under the Abel–Jacobi map.
    """

    model_config = ConfigDict(json_schema_extra={"examples": [CURVE]})
    point_fields: ClassVar[tuple[str, ...]] = ("points", "z")

    branch_points: Annotated[
        Any,
        WithJsonSchema({"type": "array", "items": NUMBER, "minItems": 3, "maxItems": 34}),
        Field(description="2g+1 or 2g+2 distinct real numbers in any order, g ≤ 16"),
    ]
    sign: Annotated[Any, WithJsonSchema({"type": "integer", "enum": [-1, 1]})] = -1
    points: Annotated[
        Any, _or_null(_list_of(_COMPLEX)), Field(description="λ of points, whose images are given")
    ] = None
    w: Annotated[
        Any,
        _or_null(_list_of(_COMPLEX)),
        Field(description="a number for each of the points that names its sheet"),
    ] = None
    z: Annotated[
        Any,
        _or_null(_list_of(_list_of(NUMBER))),
        Field(description="points of the real torus, g numbers each, whose places are given"),
    ] = None
    outputs: Annotated[
        Any,
        _or_null({"type": "array", "items": {"type": "string", "enum": list(CURVE_OUTPUTS)}}),
        Field(description="further outputs"),
    ] = None
    digits: Annotated[
        int,
        Field(
            ge=FEWEST_DIGITS,
            le=MOST_DIGITS,
            description=f"beyond {FEWEST_DIGITS}, numbers are decimal strings with radii",
        ),
    ] = FEWEST_DIGITS
    certified: Annotated[
        bool, Field(description="radii are proven; numbers are decimal strings")
    ] = False

    @property
    def subject(self) -> str:
        """Return the name of what is asked about."""
        return "curve"

    @property
    def genus(self) -> int:
        """Return g as the number of branch points says, before they are validated."""
        known = self.branch_points if isinstance(self.branch_points, list) else ()
        return max(0, (len(known) - 1) // 2)

    def value_count(self) -> int:
        """Return how many numbers the answer has for points and for Thomae's formula."""
        genus = self.genus
        named = isinstance(self.outputs, list) and "thomae" in self.outputs
        partitions = math.comb(2 * genus + 1, genus + 1) if named and genus < _MANY else 0
        return self.point_count() * genus + partitions * (3 * genus + 2)

    def option_faults(self) -> list[InvalidInput]:
        """Return what is wrong with the request beyond its fields."""
        faults = Faults()
        faults.attempt(curve_arguments, self.branch_points, self.sign)
        if (self.points is None) != (self.w is None):
            missing = "points" if self.points is None else "w"
            faults.add((missing,), "points and w together, or neither", "one of them")
        points, sheets = self.places
        if points is not None and sheets is not None:
            faults.attempt(points_with_sheets, points, sheets)
        elif points is not None:
            faults.attempt(exact_points, points)
        if self.z is not None and 1 <= self.genus <= LARGEST_GENUS:
            faults.attempt(torus_points, self.z, self.genus)
        if self.outputs is not None:
            faults.attempt(curve_outputs, self.outputs)
        return faults.found

    @property
    def places(self) -> tuple[Any, Any]:
        """Return the points and their w."""
        return from_pairs(self.points, 1), from_pairs(self.w, 1)


class ThetaRequest(ToolkitRequest):
    """θ[ε;δ](z|τ) = Σ_{m∈Z^g} exp(πi(m+ε)ᵀτ(m+ε) + 2πi(m+ε)·(z+δ)), or its derivatives in z, at
    points z.
    """

    model_config = ConfigDict(json_schema_extra={"examples": [THETA]})
    point_fields: ClassVar[tuple[str, ...]] = ("z",)

    z: Annotated[
        Any, WithJsonSchema(_list_of(_list_of(_COMPLEX))), Field(description="points of g numbers")
    ]
    tau: Annotated[
        Any,
        _or_null(_ROWS),
        Field(description="τ, g × g, symmetric, Im τ positive definite, g ≤ 8; either this or T"),
    ] = None
    T: Annotated[
        Any,
        _or_null(_list_of(_list_of(NUMBER))),
        Field(description="the real matrix of τ = iT, such as the riemann_matrix of a torus"),
    ] = None
    characteristic: Annotated[
        Any,
        WithJsonSchema({"anyOf": [_ROW_PAIR, _list_of(_ROW_PAIR), {"type": "null"}]}),
        Field(description="[ε, δ], g real numbers each, or a list of these; zero when left out"),
    ] = None
    derivatives: Annotated[
        Any,
        WithJsonSchema({"type": "integer", "enum": [0, 1, 2]}),
        Field(description="0: values, 1: gradients, 2: matrices of second derivatives"),
    ] = 0

    @property
    def subject(self) -> str:
        """Return the name of what is asked about."""
        return "theta"

    def value_count(self) -> int:
        """Return how many complex numbers are asked for."""
        matrix = self.tau if self.T is None else self.T
        genus = len(matrix) if isinstance(matrix, list) else 0
        given = self.characteristic
        several = isinstance(given, list) and _depth(given) == 3
        orders = {0: 1, 1: genus, 2: genus * genus}
        order = self.derivatives if isinstance(self.derivatives, int) else 0
        count = len(given) if several else 1
        return math.prod((self.point_count(), count, orders.get(order, 1)))

    def option_faults(self) -> list[InvalidInput]:
        """Return what is wrong with the request beyond its fields."""
        faults = Faults()
        if (self.tau is None) == (self.T is None):
            given = "neither" if self.T is None else "both"
            faults.add(("tau",), "tau, or T of τ = iT, and not both", given)
        if not isinstance(self.z, list) or not all(isinstance(row, list) for row in self.z):
            faults.add(("z",), "a list of points, each a list of numbers", show(self.z))
        if not faults.found:
            faults.attempt(lambda: self.arguments)
            return faults.found
        places = [fault.path for fault in faults.found]
        further = ThetaArguments.faults(
            None if ("z",) in places else from_pairs(self.z, 2),
            None if ("tau",) in places else from_pairs(self.tau, 2),
            self.characteristic,
            self.derivatives,
            None if ("tau",) in places else self.T,
        )
        return [*faults.found, *further]

    @cached_property
    def arguments(self) -> ThetaArguments:
        """Return the arguments of the theta function; raises InvalidInput with all faults."""
        z = from_pairs(self.z, 2)
        tau = from_pairs(self.tau, 2)
        return ThetaArguments.of(z, tau, self.characteristic, self.derivatives, self.T)


def _depth(value: Any) -> int:
    depth = 0
    while isinstance(value, list) and value:
        depth += 1
        value = value[0]
    return depth
