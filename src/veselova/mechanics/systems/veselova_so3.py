"""The Veselova system on T SO(3): a rigid body with (Ω,γ) constant, in a potential V(γ)."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.bodies.ball import require_body
from veselova.mechanics.core.errors import InvalidInput, Unsolved
from veselova.mechanics.core.exact_input import Numbers
from veselova.mechanics.core.problem import Series
from veselova.mechanics.core.upper import call_upper
from veselova.mechanics.flows.rigid_body_flow import momentum
from veselova.mechanics.geometry.sphere import INPUT_TOLERANCE, exact_cross, inverse_length
from veselova.mechanics.systems.rigid_body import RigidBody, exact_inverse
from veselova.mechanics.systems.torus_problem import TorusProblem
from veselova.mechanics.systems.veselova import Veselova

__all__ = ["VeselovaSO3", "multiplier"]

Array = NDArray[np.float64]


#: Bits of 1/|γ| where it is irrational: beyond what the engine takes from data for doubles, and
#: beyond all digits that can be asked for. Each costs: exact rationals of 4096 bits make a solution
#: in doubles half as long again.
_DOUBLE_BITS = 320
_ALL_BITS = 4096


class VeselovaSO3(RigidBody):
    """A rigid body under (Ω,γ) = const, equations (3.1, printed 4.2) with (la, printed 4.3): 𝓘Ω̇ =
    𝓘Ω×Ω + γ×∂V/∂γ + λγ, ė_i = e_i×Ω, e_1 = γ.

    - inertia: 3 positive principal moments, or a symmetric positive definite 3 × 3 matrix
    - gamma: the unit vector e_1 at t = 0, seen from the body, (3,)
    - Omega: the angular velocity in the body, (3,); (Ω,γ) may have any value and keeps it. Where
      a number of γ or Ω is a double, less than 16 roundings of |Ω| count as zero
    - potential: V(γ) as data (see ``Potential``): {"clebsch": α}, {"family": [α₁ … α₅]} of
      (3.5, printed 4.10), {"polynomial": […]}; None for 0
    - frame: [e_1 e_2 e_3] at t = 0, (3, 3), columns e_i, e_1 = γ; None for the natural frame of
      γ and γ̇
    - strict: moments that no body has, larger than the sum of the others, are refused where it is
      True, and warned of where it is None

    γ must have unit length to 1e-9; with ``normalize=True`` it is scaled and the frame made
    orthonormal. Raises InvalidInput, which names the field.
    Outputs: Omega, gamma, frame, momentum 𝔪 = 𝓘Ω − (𝓘Ω,γ)γ + (Ω,γ)γ, multiplier λ. Formulations:
    ``multiplier``, (3.1) with (la); ``momentum``, the momentum Eᵀ𝔪 in space with Ω from it, after
    (4.2a, printed 5.8).

    Without a potential engine ``analytic`` has every motion, and is the default: where (Ω,γ) = 0
    that of the rank-one problem, otherwise on the torus of ``AreaVeselova``. More
    digits are served there too, certified errors only where (Ω,γ) = 0. With a
    potential of (3.5) (``clebsch``, ``family``) and (Ω,γ) = 0 it has it by quadratures, method
    ``angles``. ``without_closed_form`` is the reason for every other problem.
    """

    system: ClassVar[str] = "veselova-so3"
    outputs: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "Omega": ("axis",),
        "gamma": ("axis",),
        "frame": ("axis", "vector"),
        "momentum": ("axis",),
        "multiplier": (),
    }
    derived: ClassVar[tuple[str, ...]] = ("gamma", "momentum", "multiplier")
    engines: ClassVar[Mapping[str, tuple[str, ...]]] = TorusProblem.engines
    has_tori: ClassVar[bool] = True
    formulations: ClassVar[tuple[str, ...]] = ("multiplier", "momentum")
    constrained: ClassVar[bool] = True
    #: What ``rank_one`` makes.
    rank_one_class: ClassVar[type[Veselova]] = Veselova

    def __init__(
        self,
        inertia: Numbers,
        gamma: Numbers,
        Omega: Numbers,
        potential: Mapping[str, Any] | None = None,
        frame: Numbers | None = None,
        *,
        strict: bool | None = None,
        normalize: bool = False,
    ) -> None:
        super().__init__(inertia, gamma, Omega, potential, frame, normalize=normalize)
        if strict is False:
            return
        try:
            require_body(self.moments)
        except InvalidInput as fault:
            if strict:
                raise
            warnings.warn(str(fault), stacklevel=6)  # above the call of the class, in four steps

    def _take_natural_frame(self) -> None:
        if self.has_torus and self.linear == 0:  # one start for both engines, and all digits of it
            point = self.on_torus()
            self._set(frame=point.to_body_axes(point.frame[None])[0])

    @property
    def without_closed_form(self) -> str | None:
        """Return why the motion has no closed form; None where it has one."""
        if self.linear != 0 and self.potential.terms:
            return (
                f"with a potential the closed form has (Ω,γ) = 0, here {self.linear:.6g}; "
                "integrate numerically"
            )
        if self.potential.terms and set(self.potential.given or ()) - {"clebsch", "family"}:
            return (
                "the closed form has the potentials (3.5), no polynomial of a user's; integrate "
                "numerically"
            )
        return None

    @property
    def has_torus(self) -> bool:
        """Return whether V = 0: the motion is then on the torus of ``on_torus()``."""
        return not self.potential.terms

    def on_torus(self) -> Veselova:
        """Return the problem on whose torus the motion runs, the same object every time:
        ``rank_one()``, an irrational |γ| to the digits that doubles need, and where (Ω,γ) ≠ 0 the
        ``AreaVeselova``.
        """
        return self._torus

    @cached_property
    def _torus(self) -> Veselova:
        if self.linear == 0:
            return self._rank_one(_DOUBLE_BITS)
        if self.potential.terms:
            self._require_geodesic()
        found: Veselova = call_upper("area_torus", self)
        return found

    @property
    def horizontal_momentum(self) -> Array:
        """Return 𝓘Ω − (𝓘Ω,γ)γ in space, along e_1, e_2, e_3 (3,), where it is constant if V = 0;
        the first number is zero.
        """
        in_space = np.asarray(self.frame.T @ (self.inertia @ self.Omega))
        in_space[0] = 0.0
        return in_space

    def angular_velocity(self, frame: Array) -> Array:
        """Return Ω at attitudes [e_1 e_2 e_3] (N, 3, 3) of this motion, where V = 0.

        Ω = 𝓘⁻¹(p + σγ), p the ``horizontal_momentum``, with σ from (Ω,γ), which is constant. The
        component (Ω,γ) of 𝔪 along γ is left out: in small bodies it exceeds 𝓘Ω, in heavy balls the
        rounding of 𝓘Ω exceeds it.
        """
        gamma = frame[..., 0]
        free = frame @ self.horizontal_momentum @ self.inverse
        across = gamma @ self.inverse
        share = self.linear - np.sum(free * gamma, axis=-1)
        share = share / np.sum(across * gamma, axis=-1)
        return np.asarray(free + share[..., None] * across)

    @property
    def _linear_constant(self) -> tuple[str, float]:
        return "(Ω,γ)", self.linear

    @property
    def energy_name(self) -> str:
        """Return ``energy`` where (Ω,γ) = 0, else ``jacobi_integral``."""
        return "energy" if self.linear == 0 else "jacobi_integral"

    @property
    def vanishing(self) -> frozenset[str]:
        """Return the constraint, where (Ω,γ) = 0."""
        return frozenset({"constraint"}) if self.linear == 0 else frozenset()

    def derive(self, name: str, series: Series) -> Array:
        """Return gamma, momentum or multiplier."""
        if name == "multiplier":
            return multiplier(self, series["Omega"], series["frame"][..., 0])
        if name == "momentum":
            Omega, gamma = series["Omega"], series["frame"][..., 0]
            M = self.momentum_of(Omega)
            # not the (Ω,γ) of doubles, whose rounding may exceed all of 𝓘Ω
            exact = Omega.dtype == object and self.linear != 0
            linear = np.sum(Omega * gamma, axis=-1) if exact else self.linear
            along = linear - np.sum(M * gamma, axis=-1)
            return np.asarray(M + along[..., None] * gamma)
        return super().derive(name, series)

    def integrals(self, series: Series) -> dict[str, Array]:
        """Return the integrals of motion along the series, by name.

        ``constraint`` (Ω,γ); ``gamma_norm`` (γ,γ); where (Ω,γ) = 0 ``energy`` ½(𝓘Ω,Ω) + V, which
        is F_1 + V; elsewhere ``jacobi_integral`` ½(𝓘Ω,Ω) − (Ω,γ)(𝓘Ω,γ) + V of Jacobi and Painlevé
        (ints, printed 4.4), since the energy is not conserved there; ``F2`` ½(𝔪,𝔪) + F(γ), (ints)
        and (3.5, printed 4.10), where the potential has a companion F and (Ω,γ) = 0 or F asks for
        none; ``space_momentum`` Eᵀ𝔪 where V = 0.
        """
        Omega = series["Omega"]
        frame = series["frame"]
        gamma = frame[..., 0]
        potential = self.potential
        M = Omega @ self.inertia
        m = momentum(self.inertia, Omega, gamma, constrained=True)
        along = np.sum(Omega * gamma, axis=-1)
        kinetic = np.sum(Omega * M, axis=-1) / 2 - along * np.sum(M * gamma, axis=-1)
        found = {
            "constraint": along,
            "gamma_norm": np.sum(gamma * gamma, axis=-1),
            self.energy_name: np.asarray(kinetic + potential.terms.value(gamma)),
        }
        if potential.companion is not None and (self.linear == 0 or potential.unconditional):
            found["F2"] = np.asarray(np.sum(m * m, axis=-1) / 2 + potential.companion.value(gamma))
        if not potential.terms:
            found["space_momentum"] = np.einsum("...ji,...j->...i", frame, m)
        return found

    def rank_one(self) -> Veselova:
        """Return the same motion as the rank-one problem with A = 𝓘⁻¹, q = γ, q̇ = γ×Ω, exact where
        the data are.

        Raises Unsolved (``not-rank-one``) unless V = 0 and (Ω,γ) = 0 to 1e-9 of |Ω|.
        """
        return self._rank_one(_ALL_BITS)

    def _rank_one(self, bits: int) -> Veselova:
        self._require_geodesic()
        A, gamma = exact_inverse(self.exact_tensor), self.exact_gamma
        length = inverse_length(gamma, bits)
        velocity = [length * x for x in exact_cross(gamma, self.exact_Omega)]
        return self.rank_one_class(A, gamma, velocity, self.exact_frame, normalize=True)

    def _require_geodesic(self) -> None:
        if self.potential.terms:
            raise Unsolved(
                "not-rank-one",
                "potential: required none for a torus; given one; solve gives the motion",
            )
        if abs(self.linear) > INPUT_TOLERANCE * np.linalg.norm(self.Omega):
            reason = f"Omega: required (Ω,γ) = 0; given {self.linear:.6g}; solve gives the motion"
            raise Unsolved("not-rank-one", reason)


def multiplier(problem: VeselovaSO3, Omega: Array, gamma: Array) -> Array:
    """Return λ = −(𝓘Ω×Ω + γ×∂V/∂γ, 𝓘⁻¹γ)/(𝓘⁻¹γ,γ), equation (la, printed 4.3), shape (...)."""
    force = np.cross(problem.momentum_of(Omega), Omega)
    if problem.potential.terms:
        force = force + np.cross(gamma, problem.potential.terms.gradient(gamma))
    across = problem.velocity_of(gamma)
    return np.asarray(-np.sum(force * across, axis=-1) / np.sum(gamma * across, axis=-1))
