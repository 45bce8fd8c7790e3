"""The JSON of problems: one model for each system, told apart by ``system``.

The numerical fields are taken as they come (their JSON schema is stated for the OpenAPI document)
and validated where the problem is built, so that Python, command line and HTTP refuse the same
input with the same sentence.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BaseModel, ConfigDict, Field, WithJsonSchema

from veselova.mechanics.core.errors import InvalidInput
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.systems.ellipsoid import EllipsoidGeodesic
from veselova.mechanics.systems.euler_poisson import EulerPoisson
from veselova.mechanics.systems.lr_system import LRSystem
from veselova.mechanics.systems.neumann import NeumannSystem
from veselova.mechanics.systems.separable_veselova import SeparableVeselova
from veselova.mechanics.systems.stiefel import StiefelFlow
from veselova.mechanics.systems.veselova import Veselova
from veselova.mechanics.systems.veselova_so3 import VeselovaSO3

__all__ = ["NUMBER", "SYSTEMS", "ProblemModel", "Request", "Times"]

NUMBER = {
    "anyOf": [
        {"type": "number"},
        {"type": "string", "pattern": r"^\s*[+-]?(\d|\.\d)[\d./eE+ -]*$", "maxLength": 2100},
    ],
    "description": 'A finite number; as a string ("0.7", "7/10") it is taken exactly.',
}
_VECTOR = {"type": "array", "items": NUMBER, "minItems": 2}
_MATRIX = {"type": "array", "items": _VECTOR, "minItems": 2}
_UNIFORM = {
    "type": "object",
    "properties": {"start": NUMBER, "stop": NUMBER, "count": {"type": "integer", "minimum": 1}},
    "required": ["start", "stop", "count"],
    "additionalProperties": False,
}
_WHOLE = {"type": "integer", "minimum": 1}
_INERTIA_OPERATOR = {
    "anyOf": [
        {
            "type": "object",
            "properties": {name: schema},
            "required": [name],
            "additionalProperties": False,
        }
        for name, schema in (
            (
                "special",
                {
                    **_VECTOR,
                    "description": "A_1 … A_n > 0 of (4.5): 𝓘(E_i∧E_j) = (A_iA_j/det A) E_i∧E_j",
                },
            ),
            (
                "matrix",
                {"type": "array", "items": {"type": "array", "items": NUMBER}, "minItems": 1},
            ),
        )
    ],
}
_MONOMIAL = {
    "type": "object",
    "properties": {
        "coefficient": NUMBER,
        "powers": {
            "type": "array",
            "items": {"type": "array", "items": {"type": "integer"}, "minItems": 3, "maxItems": 3},
        },
    },
    "required": ["coefficient", "powers"],
    "additionalProperties": False,
    "description": "c Π g_ij^p for powers [[i, j, p], …], i and j from 1",
}
_TIMES = {"anyOf": [{"type": "array", "items": NUMBER, "minItems": 1}, _UNIFORM]}

_TRIPLE = {"type": "array", "items": NUMBER, "minItems": 3, "maxItems": 3}
_SQUARE = {"type": "array", "items": _TRIPLE, "minItems": 3, "maxItems": 3}
_TERM = {
    "type": "object",
    "properties": {
        "coefficient": NUMBER,
        "powers": {"type": "array", "items": {"type": "integer"}, "minItems": 3, "maxItems": 3},
    },
    "required": ["coefficient", "powers"],
    "additionalProperties": False,
}
_POTENTIAL = {
    "type": "object",
    "properties": {
        "clebsch": NUMBER,
        "family": {"type": "array", "items": NUMBER, "minItems": 5, "maxItems": 5},
        "polynomial": {"type": "array", "items": _TERM, "minItems": 1},
        "companion": {"type": "array", "items": _TERM, "minItems": 1},
    },
    "minProperties": 1,
    "additionalProperties": False,
}
_SEPARABLE = {
    "type": "object",
    "properties": {"quartic": NUMBER, "quadratic": NUMBER, "centrifugal": _VECTOR},
    "minProperties": 1,
    "additionalProperties": False,
}
_COLUMNS = {
    "type": "array",
    "items": {"type": "array", "items": NUMBER, "minItems": 1},
    "minItems": 2,
}
_BODY_INERTIA = {
    "anyOf": [
        {
            "type": "object",
            "properties": {name: form},
            "required": [name],
            "additionalProperties": False,
        }
        for name, form in (("special", _VECTOR), ("matrix", _COLUMNS))
    ]
}

Vector = Annotated[Any, WithJsonSchema(_VECTOR)]
Inertia = Annotated[Any, WithJsonSchema({"anyOf": [_VECTOR, _MATRIX]})]
Frame = Annotated[Any, WithJsonSchema({"anyOf": [_MATRIX, {"type": "null"}]})]
Triple = Annotated[Any, WithJsonSchema(_TRIPLE)]
Tensor = Annotated[Any, WithJsonSchema({"anyOf": [_TRIPLE, _SQUARE]})]
Attitude = Annotated[Any, WithJsonSchema({"anyOf": [_SQUARE, {"type": "null"}]})]
PotentialData = Annotated[Any, WithJsonSchema({"anyOf": [_POTENTIAL, {"type": "null"}]})]
Columns = Annotated[Any, WithJsonSchema(_COLUMNS)]
BodyInertia = Annotated[Any, WithJsonSchema(_BODY_INERTIA)]
Whole = Annotated[Any, WithJsonSchema(_WHOLE)]
InertiaOperator = Annotated[Any, WithJsonSchema(_INERTIA_OPERATOR)]
Matrix = Annotated[Any, WithJsonSchema(_MATRIX)]
Potential = Annotated[
    Any,
    WithJsonSchema(
        {"anyOf": [{"type": "array", "items": _MONOMIAL, "minItems": 1}, {"type": "null"}]}
    ),
]
SeparableData = Annotated[Any, WithJsonSchema({"anyOf": [_SEPARABLE, {"type": "null"}]})]
Times = Annotated[Any, WithJsonSchema(_TIMES)]


class Request(BaseModel):
    """What every part of a request is: no field but those stated, no value converted."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class SystemModel(Request):
    """A problem of one system."""

    #: What the model becomes, and the field that shows its size: a number, or a list with as many
    #: entries.
    problem_class: ClassVar[type[Problem]]
    measured: ClassVar[str]

    system: str

    @property
    def dimension(self) -> int:
        """Return how many components a vector of the problem has, before anything is validated."""
        value = getattr(self, self.measured)
        return value if isinstance(value, int) else len(value) if isinstance(value, list) else 0

    def problem(self) -> Problem:
        """Return the problem; raises InvalidInput located below ``problem``."""
        fields = {name: getattr(self, name) for name in type(self).model_fields if name != "system"}
        try:
            return self.problem_class(**fields)
        except InvalidInput as error:
            raise error.below("problem") from None


class VeselovaModel(SystemModel):
    """The rank-one Veselova problem with inertia 𝓘(E_i∧E_j) = (A_iA_j/det A) E_i∧E_j and its state
    at t = 0.
    """

    problem_class: ClassVar[type[Problem]] = Veselova
    measured: ClassVar[str] = "A"

    system: Literal["veselova"]
    A: Annotated[
        Inertia,
        Field(
            description="n positive numbers, or a symmetric positive definite n × n matrix; n ≥ 2"
        ),
    ]
    q: Annotated[Vector, Field(description="unit vector e_1, n numbers")]
    q_dot: Annotated[Vector, Field(description="its velocity, orthogonal to q, n numbers")]
    frame: Annotated[
        Frame,
        Field(
            description="orthogonal n × n, columns e_i, e_1 = q; the natural frame when left out"
        ),
    ] = None
    normalize: Annotated[
        bool,
        Field(description="scale q to unit length and project q_dot on its tangent space first"),
    ] = False


class NeumannModel(SystemModel):
    """The Neumann system on the unit sphere with potential ½(A⁻¹q,q), in its own time τ₁, and its
    state at τ₁ = 0.
    """

    problem_class: ClassVar[type[Problem]] = NeumannSystem
    measured: ClassVar[str] = "A"

    system: Literal["neumann"]
    A: Annotated[Vector, Field(description="n positive numbers; n ≥ 2")]
    q: Annotated[Vector, Field(description="unit vector, n numbers")]
    q_prime: Annotated[Vector, Field(description="its velocity dq/dτ₁, orthogonal to q, n numbers")]
    normalize: Annotated[
        bool,
        Field(description="scale q to unit length and project q_prime on its tangent space first"),
    ] = False


class EllipsoidGeodesicModel(SystemModel):
    """A geodesic on the ellipsoid Σ X_i²/A_i = 1, in its arc length s, with the normals of the
    quadrics its tangent touches.
    """

    problem_class: ClassVar[type[Problem]] = EllipsoidGeodesic
    measured: ClassVar[str] = "A"

    system: Literal["ellipsoid-geodesic"]
    A: Annotated[Vector, Field(description="squares of the semiaxes, n positive numbers; n ≥ 2")]
    X: Annotated[Vector, Field(description="point of the ellipsoid at s = 0, n numbers")]
    X_dot: Annotated[Vector, Field(description="unit tangent dX/ds there, n numbers")]
    normalize: Annotated[
        bool, Field(description="scale X onto the ellipsoid, project and scale X_dot first")
    ] = False


class RigidBodyModel(SystemModel):
    """A rigid body in a potential V(γ) and its state at t = 0."""

    measured: ClassVar[str] = "inertia"

    inertia: Annotated[
        Tensor,
        Field(
            description="3 positive principal moments, or a symmetric positive definite 3 × 3 "
            "matrix"
        ),
    ]
    gamma: Annotated[Triple, Field(description="unit vector e_1 = γ seen from the body")]
    Omega: Annotated[Triple, Field(description="angular velocity in the body")]
    potential: Annotated[
        PotentialData, Field(description="V(γ), the sum of the parts given; zero when left out")
    ] = None
    frame: Annotated[
        Attitude,
        Field(description="orthogonal 3 × 3, columns e_i, e_1 = γ; the natural one when left out"),
    ] = None
    normalize: Annotated[bool, Field(description="scale gamma to unit length first")] = False


class VeselovaSO3Model(RigidBodyModel):
    """The Veselova system on T SO(3), equations (3.1): (Ω,γ) = const in a potential V(γ) (Clebsch,
    (3.5), any polynomial).
    """

    problem_class: ClassVar[type[Problem]] = VeselovaSO3

    system: Literal["veselova-so3"]


class EulerPoissonModel(RigidBodyModel):
    """The Euler–Poisson equations (3.4) of a free rigid body in a potential 𝒱(γ)."""

    problem_class: ClassVar[type[Problem]] = EulerPoisson

    system: Literal["euler-poisson"]


class StiefelModel(SystemModel):
    """The reduced LR flow on T*V(r,n): the first r vectors of a body with any inertia under the
    constraints of rank r.
    """

    problem_class: ClassVar[type[Problem]] = StiefelFlow
    measured: ClassVar[str] = "X"

    system: Literal["stiefel"]
    inertia: Annotated[
        BodyInertia,
        Field(
            description='{"special": n positive numbers A} for 𝓘(E_i∧E_j) = (A_iA_j/det A) '
            'E_i∧E_j, or {"matrix": …}, symmetric '
            "and positive definite, on the coefficients of E_i∧E_j, i < j, in lexicographic order"
        ),
    ]
    X: Annotated[
        Columns,
        Field(description="n rows of r numbers, the columns e_1 … e_r orthonormal; 1 ≤ r ≤ n"),
    ]
    P: Annotated[
        Columns,
        Field(description="its momentum, n rows of r numbers, XᵀP skew; either this or X_dot"),
    ] = None
    X_dot: Annotated[
        Columns, Field(description="its velocity, n rows of r numbers, XᵀẊ skew; either this or P")
    ] = None
    normalize: Annotated[
        bool,
        Field(description="make X orthonormal and project P or X_dot on its tangent space first"),
    ] = False


class LRModel(SystemModel):
    """An LR system on SO(n): any inertia, ⟨ω, e_p∧e_q⟩ = const for r < p < q ≤ n, a potential, and
    its state at t = 0.
    """

    problem_class: ClassVar[type[Problem]] = LRSystem
    measured: ClassVar[str] = "n"

    system: Literal["lr"]
    n: Annotated[Whole, Field(description="dimension of the body, n ≥ 2")]
    rank: Annotated[Whole, Field(description="r of D_r, from 1 to n − 1 (no constraints)")]
    inertia: Annotated[
        InertiaOperator,
        Field(
            description="special, or symmetric positive definite on the basis E_i∧E_j, i < j, "
            "lexicographic"
        ),
    ]
    omega: Annotated[Matrix, Field(description="angular velocity g⁻¹ġ in the body, skew n × n")]
    g: Annotated[
        Frame,
        Field(
            description="attitude, body to space, orthogonal n × n, frame = gᵀ; the identity when "
            "left out"
        ),
    ] = None
    potential: Annotated[
        Potential, Field(description="v(g) as a sum of monomials in the entries of g")
    ] = None
    homogeneous: Annotated[
        bool,
        Field(
            description="require ⟨ω, e_p∧e_q⟩ = 0 and project ω on it; else they are what ω gives"
        ),
    ] = False


class SeparableModel(SystemModel):
    """The reduced rank-one system in n dimensions, in the potentials of (3.5), and its state at t =
    0.
    """

    problem_class: ClassVar[type[Problem]] = SeparableVeselova
    measured: ClassVar[str] = "A"

    system: Literal["separable"]
    A: Annotated[Vector, Field(description="n positive numbers, no two equal; n ≥ 2")]
    q: Annotated[Vector, Field(description="unit vector e_1, n numbers")]
    q_dot: Annotated[Vector, Field(description="its velocity, orthogonal to q, n numbers")]
    potential: Annotated[
        SeparableData, Field(description="α₁ (quartic), α₂ (quadratic), β_1 … β_n (centrifugal)")
    ] = None
    normalize: Annotated[
        bool,
        Field(description="scale q to unit length and project q_dot on its tangent space first"),
    ] = False


#: The systems, by the name that tells them apart.
SYSTEMS: Mapping[str, type[SystemModel]] = {
    "veselova": VeselovaModel,
    "neumann": NeumannModel,
    "ellipsoid-geodesic": EllipsoidGeodesicModel,
    "veselova-so3": VeselovaSO3Model,
    "stiefel": StiefelModel,
    "euler-poisson": EulerPoissonModel,
    "lr": LRModel,
    "separable": SeparableModel,
}

ProblemModel = Annotated[
    VeselovaModel
    | NeumannModel
    | EllipsoidGeodesicModel
    | VeselovaSO3Model
    | StiefelModel
    | EulerPoissonModel
    | LRModel
    | SeparableModel,
    Field(discriminator="system"),
]
