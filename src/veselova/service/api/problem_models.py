"""The JSON of problems: one model for each system, told apart by ``system``.

The numerical fields are taken as they come (their JSON schema is stated for the OpenAPI document)
and validated where the problem is built, so that Python, command line and HTTP refuse the same
input with the same sentence.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from veselova.mechanics.core.problem import Problem
from veselova.mechanics.systems.chaplygin_ball import ChaplyginBall
from veselova.mechanics.systems.ellipsoid import EllipsoidGeodesic
from veselova.mechanics.systems.euler_poisson import EulerPoisson
from veselova.mechanics.systems.lr_system import LRSystem
from veselova.mechanics.systems.neumann import NeumannSystem
from veselova.mechanics.systems.rolling_ball import RollingBall
from veselova.mechanics.systems.rubber_ball import RubberBall
from veselova.mechanics.systems.separable_veselova import SeparableVeselova
from veselova.mechanics.systems.stiefel import StiefelFlow
from veselova.mechanics.systems.veselova import Veselova
from veselova.mechanics.systems.veselova_so3 import VeselovaSO3
from veselova.service.api.problem_fields import (
    NUMBER,
    Attitude,
    BallInertia,
    BodyInertia,
    Columns,
    Direction,
    Frame,
    Inertia,
    InertiaOperator,
    Matrix,
    Number,
    Potential,
    PotentialData,
    Request,
    SeparableData,
    SystemModel,
    Tensor,
    Times,
    Triple,
    Turning,
    Vector,
    Whole,
)

__all__ = ["NUMBER", "SYSTEMS", "ProblemModel", "Request", "Times"]


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
    strict: Annotated[
        bool,
        Field(
            description="refuse moments that violate the triangle inequalities, which no body has; "
            "false computes with them and says nothing"
        ),
    ] = False


class EulerPoissonModel(RigidBodyModel):
    """The Euler–Poisson equations (3.4) of a free rigid body in a potential 𝒱(γ)."""

    problem_class: ClassVar[type[Problem]] = EulerPoisson

    system: Literal["euler-poisson"]


class BallModel(SystemModel):
    """A ball on a horizontal plane, or on a hyperplane of ℝⁿ, n ≥ 4, and its state at t = 0."""

    problem_class: ClassVar[type[RollingBall]]
    measured: ClassVar[str] = "gamma"

    inertia: Annotated[
        BallInertia,
        Field(
            description="inertia about the centre: 3 positive principal moments, or a symmetric "
            "positive definite 3 × 3 matrix. n ≥ 4: the special one of n positive numbers A"
        ),
    ]
    mass: Annotated[Number, Field(description="mass, greater than 0")]
    radius: Annotated[Number, Field(description="radius, greater than 0")]
    gamma: Annotated[
        Direction,
        Field(description="unit normal e_1 = γ of the plane, upwards, seen from the body"),
    ]
    Omega: Annotated[
        Turning,
        Field(
            description="angular velocity in the body; n ≥ 4: coefficients on E_i∧E_j, i < j, or "
            "the skew matrix"
        ),
    ]
    frame: Annotated[
        Frame,
        Field(description="orthogonal n × n, columns e_i, e_1 = γ; the natural one when left out"),
    ] = None
    position: Annotated[
        Vector, Field(description="contact point at t = 0, along e_2 … e_n; zero when left out")
    ] = (0, 0)
    strict: Annotated[
        bool, Field(description="refuse moments that violate the triangle inequalities")
    ] = True
    normalize: Annotated[
        bool,
        Field(description="scale gamma to unit length first; n ≥ 4: and project Omega"),
    ] = False

    @property
    def outputs(self) -> Mapping[str, tuple[str, ...]]:
        """Return those of the ball in ℝⁿ where n ≥ 4."""
        many = self.problem_class.in_many_dimensions
        return self.problem_class.outputs if many is None or self.dimension < 4 else many.outputs


class RubberBallModel(BallModel):
    """A ball that rolls on a plane without slipping, (Ω,γ) = const, zero for no twist."""

    problem_class: ClassVar[type[RollingBall]] = RubberBall

    system: Literal["rubber-ball"]


class ChaplyginBallModel(BallModel):
    """A ball that rolls on a plane without slipping and is free to twist: Chaplygin's."""

    problem_class: ClassVar[type[RollingBall]] = ChaplyginBall

    system: Literal["chaplygin-ball"]


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
    "rubber-ball": RubberBallModel,
    "chaplygin-ball": ChaplyginBallModel,
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
    | RubberBallModel
    | ChaplyginBallModel
    | StiefelModel
    | EulerPoissonModel
    | LRModel
    | SeparableModel,
    Field(discriminator="system"),
]
