"""What the Veselova system on T SO(3) and the Euler–Poisson equations share: a rigid body, its
state, and a potential V(γ); and the latter, of a free body.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from fractions import Fraction
from operator import mul
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.bodies.principal_inertia import WideAxes, symmetric_matrix, three_moments
from veselova.mechanics.core.arguments import has_doubles
from veselova.mechanics.core.decimals import exact_as
from veselova.mechanics.core.errors import Faults
from veselova.mechanics.core.exact_input import Numbers, exact_vector, require_moderate, to_float
from veselova.mechanics.core.flow import Flow
from veselova.mechanics.core.problem import Problem, Series
from veselova.mechanics.flows.rigid_body_flow import RigidBodyFlow, SpatialFlow, momentum
from veselova.mechanics.geometry.integrals_of_motion import unit_scale
from veselova.mechanics.geometry.natural_frame import (
    ExactFrame,
    admissible_frame,
    natural_frame,
    read_frame,
)
from veselova.mechanics.geometry.sphere import exact_cross, inverse_length, read_direction
from veselova.mechanics.potentials.polynomial import Potential, without_companion

__all__ = ["EulerPoisson", "RigidBody", "exact_inverse"]

Array = NDArray[np.float64]
ExactMatrix = tuple[tuple[Fraction, ...], ...]

#: What counts as (Ω,γ) = 0 where a number of either is a double, relative to |Ω|: the rounding of a
#: scalar product. Numbers stated as text, whole numbers or ratios have none.
_ROUNDING = 16 * np.finfo(float).eps

#: Bits of 1/|γ| where it is irrational: those of a double, and some to spare.
_BITS = 80


class RigidBody(Problem):
    """A body with a fixed point, its angular velocity Ω and the frame of space-fixed vectors e_1 =
    γ, e_2, e_3, in body axes.

    - moments: (3,) principal moments, exact where given so
    - wide_axes: the principal axes where a matrix was given
    - inertia, inverse: (3, 3) the tensor and its inverse
    - Omega, gamma: (3,)
    - frame: (3, 3) at t = 0
    - potential: V(γ)
    - linear: the linear constant at the start: (Ω,γ), or (𝓘Ω,γ) where the body is free
    - exact_gamma, exact_Omega, exact_frame: the state as given, rationals: γ not yet scaled,
      the frame None for the natural one
    - exact_tensor: the tensor as given, rows of rationals
    """

    moments: tuple[Fraction, ...]
    wide_axes: WideAxes | None
    inertia: Array
    inverse: Array
    gamma: Array
    Omega: Array
    frame: Array
    potential: Potential
    linear: float
    exact_gamma: tuple[Fraction, ...]
    exact_Omega: tuple[Fraction, ...]
    exact_frame: ExactFrame | None
    exact_tensor: ExactMatrix

    #: Whether a multiplier keeps (Ω,γ) constant.
    constrained: ClassVar[bool]
    bounded: ClassVar[tuple[str, ...]] = ("frame",)
    shown: ClassVar[tuple[str, ...]] = ("inertia", "gamma", "Omega")
    portrait: ClassVar[str] = "gamma"
    columns_of_frame: ClassVar[Mapping[str, int]] = {"gamma": 0}

    def __init__(
        self,
        inertia: Numbers,
        gamma: Numbers,
        Omega: Numbers,
        potential: Mapping[str, Any] | None = None,
        frame: Numbers | None = None,
        *,
        normalize: bool = False,
    ) -> None:
        faults = Faults()
        body = faults.attempt(_inertia, inertia)
        point = faults.attempt(read_direction, gamma, 3, normalize)
        exact_Omega = faults.attempt(exact_vector, Omega, ("Omega",), 3)
        of_frame = (point and point[0], 3, normalize, "gamma")
        exact_frame = faults.attempt(read_frame, frame, *of_frame)
        moments, axes, exact_tensor = body or _inertia((1, 1, 1))
        tensor, inverse = to_float(exact_tensor), to_float(exact_inverse(exact_tensor))
        # a companion belongs to one inertia
        known = without_companion(potential) if body is None else potential
        V = faults.attempt(Potential.of, known, tensor, inverse, dual=not self.constrained)
        if V is not None and point is not None:
            faults.attempt(V.require_finite, point[1])
        faults.require_none()
        exact_gamma, direction = point
        require_moderate(exact_Omega, ("Omega",), has_scale=bool(V.terms))
        velocity = to_float(exact_Omega)
        across = direction if self.constrained else tensor @ direction
        along = linear = float(velocity @ across)
        size = float(np.linalg.norm(velocity) * np.linalg.norm(across))
        if abs(along) <= _ROUNDING * size:
            is_exact = self.constrained and not has_doubles([gamma, Omega])
            linear = _component(exact_Omega, exact_gamma) if is_exact else 0.0
        if linear == 0:
            velocity = velocity - (along / (direction @ across)) * direction
        if exact_frame is None:
            principal = axes.rounded.T if axes is not None else np.eye(3)
            rate = principal @ np.cross(direction, velocity)
            start = natural_frame(1 / to_float(moments), principal @ direction, rate)
            start = principal.T @ start
        else:
            start = admissible_frame(to_float(exact_frame), direction)
        self._set(moments=moments, wide_axes=axes, exact_tensor=exact_tensor)
        self._set(inertia=tensor, inverse=inverse, inverse_inertia=inverse)
        self._set(potential=V, linear=linear)
        self._set(gamma=direction, Omega=velocity, frame=start)
        self._set(exact_gamma=exact_gamma, exact_Omega=exact_Omega, exact_frame=exact_frame)
        if frame is None:
            self._take_natural_frame()

    def _take_natural_frame(self) -> None:
        """Replace the natural frame, rounded from doubles, where a subclass knows more digits."""

    @property
    def added(self) -> Fraction | None:
        """Return D = ma² of Chaplygin's ball, None for any other body."""
        return None

    @property
    def axes(self) -> Array | None:
        """Return the principal axes as columns, (3, 3), where a matrix was given."""
        return None if self.wide_axes is None else self.wide_axes.rounded

    def momentum_of(self, vectors: Array) -> Array:
        """Return 𝓘x along the body axes, for x (..., 3) in doubles, or in balls along principal
        axes that are those of the body.
        """
        if vectors.dtype == object:
            return np.asarray(vectors * exact_as(vectors, self.moments))
        return np.asarray(vectors @ self.inertia)

    def velocity_of(self, vectors: Array) -> Array:
        """Return 𝓘⁻¹x, as ``momentum_of``."""
        if vectors.dtype == object:
            return np.asarray(vectors / exact_as(vectors, self.moments))
        return np.asarray(vectors @ self.inverse)

    def to_axes(self) -> tuple[tuple[Fraction, ...], tuple[Fraction, ...]]:
        """Return γ, of any length, and Ω along the principal axes, as given."""
        given = (self.exact_gamma, self.exact_Omega)
        axes = self.wide_axes
        return given if axes is None else (axes.to_axes(given[0]), axes.to_axes(given[1]))

    @property
    def size(self) -> str:
        """Return the linear constant."""
        name, value = self._linear_constant
        return f"{name} = {value:.6g}"

    @property
    @abstractmethod
    def _linear_constant(self) -> tuple[str, float]:
        """Return the name and the value of the linear constant."""

    @property
    def turning(self) -> float:
        """Return |Ω| plus the rate √(2|V|/I) to which the potential can bring the body."""
        lightest = min(float(moment) for moment in self.moments)
        return float(
            np.linalg.norm(self.Omega)
            + np.sqrt(2 * self.potential.terms.size(self.gamma) / lightest)
        )

    @property
    def moves(self) -> bool:
        """Return whether anything moves: Ω or the torque γ×∂V/∂γ."""
        return bool(
            np.any(self.Omega)
            or np.any(np.cross(self.gamma, self.potential.terms.gradient(self.gamma)))
        )

    @property
    def start(self) -> Series:
        """Return the series at t = 0."""
        return {"Omega": self.Omega[None], "frame": self.frame[None]}

    def flow(self, formulation: str = "multiplier") -> Flow:
        """Return the field in units of this problem; ``momentum`` is the formulation by the
        momentum in space.
        """
        _, power = unit_scale(to_float(self.moments))
        rate = self.turning
        inertia, Omega = np.ldexp(self.inertia, -power), self.Omega / rate
        shared: dict[str, Any] = {
            "inverse": np.ldexp(self.inverse, power),
            "potential": self.potential.terms.times(float(np.ldexp(1 / rate, -power)) / rate),
            "frame": self.frame,
            "time_unit": 1 / rate,
        }
        if formulation != "momentum":
            return RigidBodyFlow(
                **shared, inertia=inertia, Omega=Omega, constrained=self.constrained
            )
        in_body = momentum(inertia, Omega, self.gamma, self.constrained)
        weight = np.eye(3) if self.constrained else None
        return SpatialFlow(**shared, momentum=self.frame.T @ in_body, weight=weight)

    def derive(self, name: str, series: Series) -> Array:
        """Return gamma, the first column of the frame, or the momentum."""
        if name == "gamma":
            return super().derive(name, series)
        return momentum(self.inertia, series["Omega"], series["frame"][..., 0], self.constrained)


def _inertia(given: Any) -> tuple[tuple[Fraction, ...], WideAxes | None, ExactMatrix]:
    """Return the principal moments, the principal axes where a matrix is given, and the tensor."""
    moments, axes = three_moments(given)
    if axes is not None:
        return moments, axes, symmetric_matrix(given, ("inertia",), 3)
    rows = (tuple(x if i == j else Fraction(0) for j in range(3)) for i, x in enumerate(moments))
    return moments, None, tuple(rows)


def exact_inverse(tensor: ExactMatrix) -> ExactMatrix:
    """Return the inverse of a symmetric 3 × 3 matrix, exactly: vector products of its rows over the
    determinant.
    """
    cofactors = [exact_cross(tensor[i - 2], tensor[i - 1]) for i in range(3)]
    determinant = sum((x * y for x, y in zip(tensor[0], cofactors[0], strict=True)), Fraction())
    return tuple(tuple(x / determinant for x in row) for row in cofactors)


def _component(vector: tuple[Fraction, ...], direction: tuple[Fraction, ...]) -> float:
    """Return the component of a vector along a direction of any length, rounded once."""
    largest = max(map(abs, vector))
    if not largest:
        return 0.0
    along = sum(map(mul, vector, direction)) * inverse_length(direction, _BITS)
    return float(along / largest) * float(largest)


class EulerPoisson(RigidBody):
    """A free rigid body in an axisymmetric potential, equations (3.4, printed 4.9): 𝒥Ω̇ = 𝒥Ω×Ω +
    γ×∂𝒱/∂γ, ė_i = e_i×Ω, e_1 = γ.

    - inertia: 𝒥: 3 positive principal moments, or a symmetric positive definite 3 × 3 matrix
    - gamma: (3,) the unit vector e_1 at t = 0, seen from the body
    - Omega: (3,) the angular velocity in the body
    - potential: 𝒱(γ) as data (see ``Potential``): {"clebsch": α} for α(𝒥γ,γ), {"family": [α₁ …
      α₅]} for the F(γ) of (3.5, printed 4.10) with 𝓘 = 𝒥⁻¹, {"polynomial": […]}; None for 0
    - frame: (3, 3) [e_1 e_2 e_3] at t = 0, columns e_i, e_1 = γ; None for the natural frame of
      γ and γ̇

    γ must have unit length to 1e-9; with ``normalize=True`` it is scaled and the frame made
    orthonormal. Raises InvalidInput, which names the field.
    Outputs: Omega, gamma, frame, momentum 𝒥Ω. Formulations: ``velocity``, (3.4); ``momentum``, the
    momentum in space.
    """

    system: ClassVar[str] = "euler-poisson"
    outputs: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "Omega": ("axis",),
        "gamma": ("axis",),
        "frame": ("axis", "vector"),
        "momentum": ("axis",),
    }
    derived: ClassVar[tuple[str, ...]] = ("gamma", "momentum")
    formulations: ClassVar[tuple[str, ...]] = ("velocity", "momentum")
    constrained: ClassVar[bool] = False

    @property
    def _linear_constant(self) -> tuple[str, float]:
        return "i2", self.linear

    @property
    def vanishing(self) -> frozenset[str]:
        """Return i_2, where it is zero."""
        return frozenset({"i2"}) if self.linear == 0 else frozenset()

    def integrals(self, series: Series) -> dict[str, Array]:
        """Return the integrals of motion along the series, by name.

        ``gamma_norm`` i_1 = (γ,γ); ``i2`` (𝒥Ω,γ); ``energy`` f_1 = ½(𝒥Ω,Ω) + 𝒱; ``f2`` ½(𝒥Ω,𝒥Ω) +
        V(γ) where the potential has the companion V of the duality lemma and i_2 = 0 or V asks for
        none; ``space_momentum`` Eᵀ𝒥Ω where 𝒱 = 0.
        """
        Omega = series["Omega"]
        frame = series["frame"]
        gamma = frame[..., 0]
        potential = self.potential
        M = Omega @ self.inertia
        found = {
            "gamma_norm": np.sum(gamma * gamma, axis=-1),
            "i2": np.sum(M * gamma, axis=-1),
            "energy": np.asarray(np.sum(Omega * M, axis=-1) / 2 + potential.terms.value(gamma)),
        }
        if potential.companion is not None and (self.linear == 0 or potential.unconditional):
            found["f2"] = np.asarray(np.sum(M * M, axis=-1) / 2 + potential.companion.value(gamma))
        if not potential.terms:
            found["space_momentum"] = np.einsum("...ji,...j->...i", frame, M)
        return found
