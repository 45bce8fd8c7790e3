"""The JSON of requests for a motion as data, a curve, theta functions and geodesics."""

from __future__ import annotations

import math
from contextlib import suppress
from functools import cached_property
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import ConfigDict, Field

from veselova.mechanics.core.arguments import FEWEST_DIGITS, beyond_double
from veselova.mechanics.core.errors import Faults, InvalidInput, select_faults, show
from veselova.mechanics.core.exact_input import double_array
from veselova.mechanics.core.toolkit_arguments import (
    CURVE_OUTPUTS,
    LARGEST_GENUS,
    ThetaArguments,
    complex_number,
    curve_arguments,
    curve_outputs,
    exact_points,
    points_with_sheets,
    torus_points,
)
from veselova.mechanics.geometry.geographic import read_ellipsoid
from veselova.mechanics.geometry.places import PLACES, exact_array, read_places
from veselova.mechanics.results.closed_form import require_accuracy
from veselova.service.api.examples import CURVE, GEODESIC, THETA
from veselova.service.api.problem_models import Given, Number, Numbers, Pair, Rows, from_null
from veselova.service.api.request_models import BudgetedRequest, Certified, Digits, TorusRequest

_Complex = Annotated[Number | Pair, Field(description="a number, or a pair [real, imaginary]")]
_Points = Annotated[list[_Complex], Field(min_length=1)]
_ComplexRows = Annotated[list[_Points], Field(min_length=1)]
_Characteristic = Annotated[list[Numbers], Field(min_length=2, max_length=2)]


def from_pairs(value: Any, depth: int) -> Any:
    """Return nested lists whose entries, ``depth`` levels inside, were numbers or pairs.

    Other values stay as they are: the caller knows what is required there.
    """
    if depth and isinstance(value, list):
        return [from_pairs(item, depth - 1) for item in value]
    if depth or not isinstance(value, list) or len(value) != 2:
        return value
    try:
        real, imaginary = (complex_number(part, ()) for part in value)
    except InvalidInput:
        return value
    return complex(real.real, imaginary.real) if imaginary.real else value[0]


class ClosedFormRequest(TorusRequest):
    """A request for a motion as data."""

    accuracy: Given[Annotated[float, Field(gt=0, le=1e-2)] | None] = Field(
        None,
        description="error that modes left out of the time map may make, 1e-15 or more; 1e-12 "
        "when left out",
    )

    def faults(self) -> list[InvalidInput]:
        """Return what is wrong with the problem and the accuracy."""
        faults = Faults()
        faults.attempt(require_accuracy, self.accuracy)
        return [*super().faults(), *faults.found]


class CurveRequest(BudgetedRequest):
    """The curve w² = sign·Π(λ−b_j) with real branch points: its periods, its Riemann matrix, and
    the images of points under the Abel–Jacobi map.
    """

    model_config = ConfigDict(json_schema_extra={"examples": [CURVE]})

    branch_points: Given[Annotated[list[Number], Field(min_length=3, max_length=34)]] = Field(
        description="2g+1 or 2g+2 distinct real numbers in any order, g ≤ 16"
    )
    sign: Given[Literal[-1, 1]] = Field(-1, description="of w²")
    points: Given[_Points | None] = Field(None, description="λ of points, for their images")
    w: Given[_Points | None] = Field(
        None, description="a number for each of the points that names its sheet"
    )
    z: Given[Rows | None] = Field(
        None, description="points of the real torus, g numbers each, whose places are given"
    )
    outputs: Given[list[Literal[CURVE_OUTPUTS]] | None] = Field(  # type: ignore[valid-type]
        None, description="further outputs"
    )
    digits: Digits = FEWEST_DIGITS
    certified: Certified = False

    @property
    def genus(self) -> int:
        """Return g as the number of branch points says, before they are validated."""
        known = self.branch_points if isinstance(self.branch_points, list) else ()
        return max(0, (len(known) - 1) // 2)

    @property
    def values_at(self) -> tuple[tuple[str, ...], int]:
        """Return the points, and how many numbers there are for all."""
        given = (self.points, self.z)
        points = sum(len(places) for places in given if isinstance(places, list))
        genus = min(self.genus, LARGEST_GENUS)  # others are refused
        return ("points",), points * max(1, genus)

    def faults(self) -> list[InvalidInput]:
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

    z: Given[_ComplexRows] = Field(description="points of g numbers")
    tau: Given[_ComplexRows | None] = Field(
        None, description="τ, g × g, symmetric, Im τ positive definite, g ≤ 8; either this or T"
    )
    T: Given[Rows | None] = Field(
        None, description="the real matrix of τ = iT, such as the riemann_matrix of a torus"
    )
    characteristic: Given[_Characteristic | list[_Characteristic] | None] = Field(
        None, description="[ε, δ], g real numbers each, or a list of these; zero when left out"
    )
    derivatives: Given[Literal[0, 1, 2]] = Field(
        0, description="0: values, 1: gradients, 2: matrices of second derivatives"
    )

    @property
    def values_at(self) -> tuple[tuple[str, ...], int]:
        """Return the points, and how many complex numbers are asked for, at most."""
        matrix = self.tau if self.T is None else self.T
        genus = max(1, len(matrix) if isinstance(matrix, list) else 0)
        order = self.derivatives if self.derivatives in (0, 1, 2) else 0
        points, several = (
            len(given) if isinstance(given, list) else 1 for given in (self.z, self.characteristic)
        )
        return ("z",), points * several * int(genus**order)

    def faults(self) -> list[InvalidInput]:
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


_Array = Number | list[Any]
_Places = Annotated[list[Any], Field(min_length=1)]
_Finite = Annotated[float, Field(allow_inf_nan=False)]

#: Arguments that are points, in rows.
_POINTS = ("P", "Q", "points")

#: Fields that make a request for geodesics, or for a polygon of them; and those beside them.
_ASKED = (
    (("P", "Q"), ("at", "normalize", "digits", "certified")),
    (("P", "azi1", "s12"), ("at", "normalize", "digits")),
    (("P", "Q", "count"), ("at", "normalize")),
    (("points",), ("normalize",)),
)


class GeodesicRequest(BudgetedRequest):
    """Geodesics of an ellipsoid: the shortest from P to Q, or so many of all by a count; those from
    P in the directions azi1 and of the lengths s12; or the polygon of the shortest through points.
    """

    model_config = ConfigDict(json_schema_extra={"examples": [GEODESIC]})

    ellipsoid: Given[str | Annotated[list[Number], Field(min_length=3, max_length=3)]] = Field(
        description="a name, such as WGS84 or Haumea, or three semiaxes in any order"
    )
    P: Given[_Places | None] = Field(None, description="a point or an array of them; null: none")
    Q: Given[_Places | None] = Field(None, description="the other ends; arrays are broadcast")
    azi1: Given[_Array | None] = Field(None, description="degrees, from growing β to growing ω")
    s12: Given[_Array | None] = Field(None, description="lengths of any sign")
    count: Annotated[int, Field(ge=1, le=100)] | None = Field(
        None, description="of the geodesics from one P to one Q, the shortest first"
    )
    points: Given[_Places | None] = Field(None, description="three corners of a polygon or more")
    coordinates: Literal[PLACES] = "geodetic"  # type: ignore[valid-type]
    normalize: bool = Field(False, description="whether cartesian points are moved to the surface")
    digits: Digits = FEWEST_DIGITS
    certified: Certified = False
    at: list[_Finite] = Field([], description="lengths along the geodesics whose points are given")

    @cached_property
    def arguments(self) -> dict[str, Any]:
        """Return what is stated besides the ellipsoid and its defaults, NaN where null was."""
        stated = self.model_dump(exclude_defaults=True, exclude={"ellipsoid", "at", "budget_s"})
        return {name: from_null(x) for name, x in stated.items()}

    @property
    def values_at(self) -> tuple[tuple[str, ...], int]:
        """Return the points, and how many numbers there are for all geodesics, 0 for arrays that
        do not fit one another.
        """
        count = 0
        with suppress(ValueError):
            shapes = ((name, np.shape(x)) for name, x in self.arguments.items())
            outer = (shape[:-1] if name in _POINTS else shape for name, shape in shapes)
            count = math.prod(np.broadcast_shapes(*outer)) * (self.count or 1)
        return (next(iter(self.arguments), "P"),), count * (21 + 3 * len(self.at))

    def faults(self) -> list[InvalidInput]:
        """Return what is wrong with the request beyond its fields."""
        faults, given = Faults(), self.arguments
        named = [x for x in given if x != "coordinates"] + ["at"] * bool(self.at)
        fits = [(asked, {*named} - {*asked, *beside}) for asked, beside in _ASKED]
        fits = [(asked, others) for asked, others in fits if {*asked} <= {*named}]
        if fits:
            asked, others = min(fits, key=lambda fit: (len(fit[1]), -len(fit[0])))
            for name in sorted(others):
                value = self.at if name == "at" else given[name]
                faults.add((name,), f"no such field beside {' and '.join(asked)}", show(value))
        else:
            required = ", or ".join(" and ".join(asked) for asked, _ in _ASKED)
            faults.add((), f"the fields {required}", " and ".join(named) or "none of them")
        axes = faults.attempt(read_ellipsoid, self.ellipsoid)
        how = self.coordinates, np.array(axes or (1, 1, 1), dtype=np.float64)
        moved = self.normalize or not axes
        exact = beyond_double(self.digits, self.certified)
        exact &= not (moved and self.coordinates == "cartesian")  # moved in doubles alone
        for name, values in given.items():
            if name in _POINTS:
                options = {"normalize": moved, "exact": exact}
                faults.attempt(read_places, values, name, *how, **options)
            elif name in ("azi1", "s12") and exact:
                faults.attempt(exact_array, values, name)
            elif name in ("azi1", "s12"):
                faults.attempt(double_array, values, (name,), "finite numbers")
        if not faults.found and not self.values_at[1]:
            shapes = ", ".join(f"{name} {np.shape(x)}" for name, x in given.items() if np.shape(x))
            faults.add(self.values_at[0], "arrays that can be broadcast together", shapes)
        return faults.found
