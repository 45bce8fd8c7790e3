"""The JSON of answers, as models: the OpenAPI document is made of them."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, RootModel, create_model

from veselova.mechanics.core.arguments import FEWEST_DIGITS
from veselova.mechanics.results.closed_form_schema import SCHEMA as CLOSED_FORM
from veselova.mechanics.results.sampled_motion import Provenance
from veselova.mechanics.results.toolkit import QUASI_PERIODS

_Decimal = Annotated[str, Field(pattern=r"^-?\d", description="a decimal")]
_Number = float | _Decimal
_Matrix = list[list[float]] | list[list[_Decimal]]
_Pair = Annotated[list[float], Field(min_length=2, max_length=2)]
_PairOrDecimals = _Pair | Annotated[list[_Decimal], Field(min_length=2, max_length=2)]
_ByName = dict[str, float]


def _says(description: str) -> Any:
    return Field(description=description)


def _optional(description: str) -> Any:
    """Return a field that may be left out."""
    return Field(default_factory=dict, description=description)


#: Arrays by the names of outputs, first axis the times; those of starts have one axis more.
_Series = dict[str, list[_Number] | list[list[_Number]] | list[list[list[_Number]]]]
_Radii = dict[str, list[_Decimal] | list[list[_Decimal]] | list[list[list[_Decimal]]]]
_Rows = dict[str, list[list[float]] | list[list[list[float]]] | list[list[list[list[float]]]]]


class Integral(BaseModel):
    """An integral of motion."""

    initial: float | list[float]
    drift: float


class Trajectory(BaseModel):
    """A motion at times."""

    engine: str
    times: list[float] = _says("the doubles nearest to the times asked for, in their order")
    series: _Series = _says(
        f"decimals where more than {FEWEST_DIGITS} digits, or certified errors, were asked for"
    )
    radii: _Radii = _optional("the error of every decimal")
    integrals: dict[str, Integral]
    error: list[_Number] = _says(
        "bounds the true error of every component of the bounded series at each time: true ≤ "
        "error; bounded series of system veselova: q and frame"
    )
    provenance: Provenance


class Ensemble(BaseModel):
    """The motions of many starts."""

    times: list[float] = _says("the doubles nearest to the times asked for")
    outcome: list[str] = _says("of each start: solved, or the reason's name")
    detail: list[str] = _says("of each start: the reason in a sentence")
    together: list[bool] = _says("which starts were computed side by side")
    rows: list[int] = _says("starts that were solved, from 0: first axis of the series")
    series: _Rows = _says("by rows, times and components")
    error: list[list[float]] = _says(
        "bounds the true error of every component of the bounded series at each time: true ≤ "
        "error; bounded are q and frame; by rows, times"
    )
    provenance: Provenance


class Comparison(BaseModel):
    """A motion by both engines, or in two formulations."""

    deviation: _ByName = _says("largest difference of the engines, per output")
    agrees: bool = _says("whether they differ by no more than the sum of both errors")
    conditioning_floor: float = _says(
        "the formula ε·max(1, |ω||t|) at the farthest time: what one rounding of doubles moves in "
        "a motion that loses nothing"
    )
    error: _ByName
    drift: dict[str, _ByName]
    seconds: _ByName
    provenance: dict[str, Provenance]
    analytic: Trajectory = _optional("by the closed form")
    numeric: Trajectory = _optional("by integration")
    formulations: dict[str, Trajectory] = _optional(
        "instead of analytic and numeric, for a system of one engine: two formulations by name"
    )


class Drift(BaseModel):
    """The mean velocity of the contact point along e_2 … e_n; given for a ball with up to three
    phases, and not on a separatrix.
    """

    velocity: list[float]
    resonance: list[int] | None = _says(
        "whole numbers M with M·f = 0 by which a ball also drifts across; null where there are none"
    )


class Torus(BaseModel):
    """The invariant torus of a motion."""

    n: int
    energy: float | None = _says("null beyond the range of a double, or with jacobi_integral")
    constants: list[float]
    branch_points: list[float]
    origins: list[str]
    periods: list[list[float]] | None = _says("null beyond the range of a double")
    riemann_matrix: list[list[float]]
    riemann_matrix_residual: float
    frequencies_tau1: list[float]
    frequencies_t: list[float]
    phases: list[float]
    mean_rate: float
    regime: str
    drift: Drift = _optional("of a rolling ball")
    jacobi_integral: float = _optional("in place of the energy, where that is not conserved")


class ClosedForm(RootModel[dict[str, Any]]):
    """A motion in closed form as data."""

    model_config = ConfigDict(
        json_schema_extra={name: part for name, part in CLOSED_FORM.items() if name != "$schema"}
    )


QuasiPeriods = create_model(
    "QuasiPeriods",
    __doc__="Half the periods of the first and second kind.",
    **dict.fromkeys(QUASI_PERIODS, (_Matrix, ...)),  # type: ignore[call-overload]
)


class Curve(BaseModel):
    """The periods of a hyperelliptic curve, and the images of points."""

    genus: int
    sign: int = _optional("of w² = sign·Π(λ−b_j)")
    branch_points: list[float] = _optional("increasing")
    cuts: list[list[float]] = _optional("the intervals round which a_1 … a_g go")
    gaps: list[list[float]] = _optional("the intervals that b_1 … b_g are made of")
    a_periods: _Matrix | None = _optional(
        "∮ λ^{k−1}dλ/w over a_s, column s; null beyond the range of a double"
    )
    b_periods: _Matrix | None = _optional("the same over b_s, without the factor i")
    normalized_differentials: _Matrix | None = _optional(
        "c: v_j = Σ_k c_jk λ^{k−1}dλ/w has ∮_{a_s} v_j = δ_js"
    )
    riemann_matrix: _Matrix = _says(
        "T; the Riemann matrix is iT. Decimals, here and below, where more than "
        f"{FEWEST_DIGITS} digits, or certified errors, were asked for"
    )
    riemann_matrix_error: float = _says("the error of T in double precision")
    characteristics: list[list[list[float]]] = _says(
        "[ε, δ] of each branch point: τε + δ is its image"
    )
    abel: list[list[_PairOrDecimals]] = _optional(
        "images of the points from the last branch point, as pairs [real, imaginary]; left out "
        "without points"
    )
    points: _Matrix = _optional("λ on each cut at the points z; left out without z")
    signs: list[list[float]] = _optional("the signs of w there")
    quasi_periods: QuasiPeriods = _optional(  # type: ignore[valid-type]
        "over a_s and b_s, omega and eta without the factor i; where outputs names them"
    )
    digits: int = _optional("of the decimals")
    certified: bool = _optional("whether radii are proven")
    radii: dict[str, list[Any]] = _optional(
        "the error of every decimal, by the name of its field, nested as that is"
    )


class Theta(BaseModel):
    """Values or derivatives of theta functions."""

    values: list[list[float | list[Any]]] = _says(
        "by points, then characteristics where several were given, then derivatives, as pairs "
        "[real, imaginary]"
    )
    exponent: list[float | list[float]] = _says(
        "θ = values·exp(exponent), by points and characteristics; 0 where the value is in the "
        "range of a double"
    )
    error: list[float | list[float]] = _says("by how much the values are off at most")


_Numbers = float | str | list[Any] | None


class Geodesics(BaseModel):
    """Geodesics, or area and perimeter of a polygon of them. Arrays have the shape in which those
    of the request are broadcast, with null where they have no number; decimals are texts.
    """

    ellipsoid: list[float] = _optional("its semiaxes")
    coordinates: str = _optional("those of all points")
    P1: list[Any] = _optional("where geodesics start")
    P2: list[Any] = _optional("where they end")
    s12: _Numbers = _optional("length")
    azi1: _Numbers = _optional("azimuth at P1, in degrees from growing β to growing ω")
    azi2: _Numbers = _optional("azimuth at P2 of the way ahead")
    v1: list[Any] = _optional("unit tangent at P1")
    v2: list[Any] = _optional("unit tangent at P2")
    m12: _Numbers = _optional("reduced length")
    M12: _Numbers = _optional("geodesic scale")
    M21: _Numbers = _optional("geodesic scale of the way back")
    caustic: _Numbers = _optional("c: tangents touch the quadric Σ x_i²/(A_i−c) = 1")
    error: _Numbers = _optional("bound of the error of s12, and of m12 times that of an azimuth")
    unique: bool | list[Any] | None = _optional(
        "whether no symmetry makes another geodesic as short; null without Q"
    )
    points: list[Any] = _optional("at the lengths that were asked for")
    digits: int = _optional("of the decimals")
    certified: bool = _optional("whether radii are proven")
    radii: dict[str, Any] = _optional("the error of every decimal, Infinity where it is unknown")
    area: float = _optional("positive where the corners go round anticlockwise")
    perimeter: float = _optional("sum of the lengths")
    area_error: float = _optional("bound of the area's error")
    perimeter_error: float = _optional("bound of the perimeter's error")


class Fault(BaseModel):
    """What is wrong at one place of a request."""

    pointer: str
    detail: str


class Problem(BaseModel):
    """Why a request was not answered (RFC 9457)."""

    type: str = Field(examples=["urn:veselova:problem:invalid-input"])
    title: str
    status: int
    detail: str
    outcome: str = _optional("the named outcome of an engine that cannot serve the problem")
    errors: list[Fault] = _optional("of invalid input")


class System(BaseModel):
    """A system that can be solved."""

    system: str
    title: str
    schema_name: str = Field(alias="schema")
    time: str
    fields_: list[str] = Field(alias="fields")
    formulations: list[str]
    outputs: list[str]
    closed_form: bool = _says("whether motions run on tori and are given as data")
    engines: dict[str, list[str]] = _says("engine → its methods")


class SystemList(BaseModel):
    """What a server solves, and its limits."""

    systems: list[System]
    version: str
    limits: _ByName = _says("largest dimension, most values, longest budget")


class Ready(BaseModel):
    """That a server can answer."""

    status: str


class Health(Ready):
    """That a server runs."""

    version: str
