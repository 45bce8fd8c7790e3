"""The JSON of requests for a motion as data, for a curve, and for theta functions."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import ConfigDict

from veselova.mechanics.core.curve_arguments import (
    CURVE_OUTPUTS,
    LARGEST_GENUS,
    curve_arguments,
    curve_outputs,
    exact_points,
    points_with_sheets,
    torus_points,
)
from veselova.mechanics.core.decimals import FEWEST_DIGITS
from veselova.mechanics.core.errors import Faults, InvalidInput, select_faults, show
from veselova.mechanics.core.theta_arguments import ThetaArguments
from veselova.mechanics.results.closed_form import require_accuracy
from veselova.service.api.complex_numbers import from_pairs
from veselova.service.api.examples import CURVE, THETA
from veselova.service.api.problem_fields import INTEGER, NULL, NUMBER, any_of, given, list_of
from veselova.service.api.request_models import BudgetedRequest, Certified, Digits, TorusRequest

__all__ = ["ClosedFormRequest", "CurveRequest", "ThetaRequest"]

_COMPLEX = {
    **any_of(NUMBER, list_of(NUMBER, 2, 2)),
    "description": "a number, or a pair [real, imaginary]",
}

#: Lists longer than branch points may be are refused before anything is counted.
_MANY = 100

_ROWS = list_of(list_of(_COMPLEX))
_ROW_PAIR = list_of(list_of(NUMBER), 2, 2)


class ClosedFormRequest(TorusRequest):
    """A problem whose motion is asked for as data."""

    accuracy: Annotated[
        Any,
        given(
            "error that modes left out of the time map may make, 1e-15 or more; "
            "1e-12 when left out",
            {"type": "number", "exclusiveMinimum": 0, "maximum": 1e-2},
            NULL,
        ),
    ] = None

    def option_faults(self) -> list[InvalidInput]:
        """Return what is wrong with the request beyond its fields."""
        faults = Faults()
        faults.attempt(require_accuracy, self.accuracy)
        return faults.found


class CurveRequest(BudgetedRequest):
    """The curve w² = sign·Π(λ−b_j) with real branch points: its periods, its Riemann matrix, and
    the images of points under the Abel–Jacobi map.
    """

    model_config = ConfigDict(json_schema_extra={"examples": [CURVE]})

    branch_points: Annotated[
        Any,
        given("2g+1 or 2g+2 distinct real numbers in any order, g ≤ 16", list_of(NUMBER, 3, 34)),
    ]
    sign: Annotated[Any, given("of w²", {**INTEGER, "enum": [-1, 1]})] = -1
    points: Annotated[Any, given("λ of points, for their images", list_of(_COMPLEX), NULL)] = None
    w: Annotated[
        Any, given("a number for each of the points that names its sheet", list_of(_COMPLEX), NULL)
    ] = None
    z: Annotated[
        Any,
        given(
            "points of the real torus, g numbers each, whose places are given",
            list_of(list_of(NUMBER)),
            NULL,
        ),
    ] = None
    outputs: Annotated[
        Any,
        given("further outputs", list_of({"type": "string", "enum": list(CURVE_OUTPUTS)}, 0), NULL),
    ] = None
    digits: Digits = FEWEST_DIGITS
    certified: Certified = False

    @property
    def genus(self) -> int:
        """Return g as the number of branch points says, before they are validated."""
        known = self.branch_points if isinstance(self.branch_points, list) else ()
        return max(0, (len(known) - 1) // 2)

    @property
    def values_at(self) -> tuple[tuple[str, ...], int]:
        """Return the points, and how many numbers there are for all and for Thomae's formula."""
        given = (self.points, self.z)
        points = sum(len(places) for places in given if isinstance(places, list))
        genus = self.genus
        named = isinstance(self.outputs, list) and "thomae" in self.outputs
        partitions = math.comb(2 * genus + 1, genus + 1) if named and genus < _MANY else 0
        return ("points",), points * max(1, genus) + partitions * (3 * genus + 2)

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


class ThetaRequest(BudgetedRequest):
    """θ[ε;δ](z|τ) = Σ_{m∈Z^g} exp(πi(m+ε)ᵀτ(m+ε) + 2πi(m+ε)·(z+δ)), or its derivatives in z, at
    points z.
    """

    model_config = ConfigDict(json_schema_extra={"examples": [THETA]})

    z: Annotated[Any, given("points of g numbers", _ROWS)]
    tau: Annotated[
        Any,
        given("τ, g × g, symmetric, Im τ positive definite, g ≤ 8; either this or T", _ROWS, NULL),
    ] = None
    T: Annotated[
        Any,
        given(
            "the real matrix of τ = iT, such as the riemann_matrix of a torus",
            list_of(list_of(NUMBER)),
            NULL,
        ),
    ] = None
    characteristic: Annotated[
        Any,
        given(
            "[ε, δ], g real numbers each, or a list of these; zero when left out",
            _ROW_PAIR,
            list_of(_ROW_PAIR),
            NULL,
        ),
    ] = None
    derivatives: Annotated[
        Any,
        given(
            "0: values, 1: gradients, 2: matrices of second derivatives",
            {**INTEGER, "enum": [0, 1, 2]},
        ),
    ] = 0

    @property
    def values_at(self) -> tuple[tuple[str, ...], int]:
        """Return the points, and how many complex numbers are asked for."""
        matrix = self.tau if self.T is None else self.T
        genus = max(1, len(matrix) if isinstance(matrix, list) else 0)
        given = self.characteristic
        several = isinstance(given, list) and _depth(given) == 3
        order = self.derivatives if self.derivatives in (0, 1, 2) else 0
        points = len(self.z) if isinstance(self.z, list) else 0
        return ("z",), points * (len(given) if several else 1) * int(genus**order)

    def option_faults(self) -> list[InvalidInput]:
        """Return what is wrong with the request beyond its fields."""
        faults = Faults()
        z, tau, T = from_pairs(self.z, 2), from_pairs(self.tau, 2), self.T
        if (tau is None) == (T is None):
            given = "neither" if T is None else "both"
            faults.add(("tau",), "tau, or T of τ = iT, and not both", given)
            tau = T = None
        if not isinstance(z, list) or not all(isinstance(row, list) for row in z):
            faults.add(("z",), "a list of points, each a list of numbers", show(z))
        named, others = {fault.path[0] for fault in faults.found}, Faults()
        others.attempt(ThetaArguments.of, z, tau, self.characteristic, self.derivatives, T)
        return faults.found + select_faults(others.found, lambda x: x.path[0] not in named)

    @property
    def arguments(self) -> ThetaArguments:
        """Return the arguments of the theta function; raises InvalidInput with all faults."""
        z, tau = from_pairs(self.z, 2), from_pairs(self.tau, 2)
        return ThetaArguments.of(z, tau, self.characteristic, self.derivatives, self.T)


def _depth(value: Any) -> int:
    depth = 0
    while isinstance(value, list) and value:
        depth += 1
        value = value[0]
    return depth
