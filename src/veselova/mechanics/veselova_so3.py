"""The Veselova system on T SO(3): a rigid body with (Ω,γ) constant, in a potential V(γ)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.errors import Unsolved
from veselova.mechanics.neumann import NeumannSystem
from veselova.mechanics.problem import Series
from veselova.mechanics.rigid_body import RigidBody
from veselova.mechanics.rigid_body_flow import momentum
from veselova.mechanics.sphere import INPUT_TOLERANCE
from veselova.mechanics.veselova import Veselova

__all__ = ["VeselovaSO3", "multiplier"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, init=False, repr=False)
class VeselovaSO3(RigidBody):
    """A rigid body under (Ω,γ) = const, equations (3.1) with (la): 𝓘Ω̇ = 𝓘Ω×Ω + γ×∂V/∂γ + λγ, ė_i = e_i×Ω, e_1 = γ.

    inertia    3 positive principal moments, or a symmetric positive definite 3 × 3 matrix; no triangle inequality is asked for
    gamma      the unit vector e_1 at t = 0, seen from the body, (3,)
    Omega      the angular velocity in the body, (3,); (Ω,γ) may have any value and keeps it
    potential  V(γ) as data (see ``Potential``): {"clebsch": α}, {"family": [α₁ … α₅]} of (3.5), {"polynomial": […]}; None for 0
    frame      [e_1 e_2 e_3] at t = 0, (3, 3), columns e_i, e_1 = γ; None for the natural frame of γ and γ̇

    γ must have unit length to 1e-9; with ``normalize=True`` it is scaled first. Raises InvalidInput, which names the field.
    Outputs: Omega, gamma, frame, momentum 𝔪 = 𝓘Ω − (𝓘Ω,γ)γ + (Ω,γ)γ, multiplier λ. Formulations: ``multiplier``, (3.1) with
    (la); ``momentum``, the momentum Eᵀ𝔪 in space with Ω from it, after (4.2a). Where (Ω,γ) = 0 and V is of (3.5) (``clebsch``,
    ``family``), engine ``analytic`` has the motion by quadratures.
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
    engines: ClassVar[Mapping[str, tuple[str, ...]]] = {"numeric": ("dop853", "taylor"), "analytic": ("angles",)}
    formulations: ClassVar[tuple[str, ...]] = ("multiplier", "momentum")
    constrained: ClassVar[bool] = True

    @property
    def _linear_name(self) -> str:
        return "(Ω,γ)"

    @property
    def vanishing(self) -> frozenset[str]:
        """Return the constraint, where (Ω,γ) = 0."""
        return frozenset({"constraint"}) if self.linear == 0 else frozenset()

    def derive(self, name: str, series: Series) -> Array:
        """Return gamma, momentum or multiplier."""
        if name == "multiplier":
            return multiplier(self, series["Omega"], series["frame"][..., 0])
        return super().derive(name, series)

    def integrals(self, series: Series) -> dict[str, Array]:
        """Return the integrals of motion along the series, by name.

        ``constraint`` (Ω,γ); ``gamma_norm`` (γ,γ); ``energy`` ½(𝓘Ω,Ω) − (Ω,γ)(𝓘Ω,γ) + V, the Jacobi–Painlevé integral (ints),
        F_1 + V where (Ω,γ) = 0; ``F2`` ½(𝔪,𝔪) + F(γ), (ints) and (3.5), where the potential has a companion F and
        (Ω,γ) = 0 or F asks for none; ``space_momentum`` Eᵀ𝔪 where V = 0.
        """
        Omega, frame = series["Omega"], series["frame"]
        gamma, potential = frame[..., 0], self.potential
        M, m = Omega @ self.inertia, momentum(self.inertia, Omega, gamma, constrained=True)
        along = np.sum(Omega * gamma, axis=-1)
        kinetic = np.sum(Omega * M, axis=-1) / 2 - along * np.sum(M * gamma, axis=-1)
        found = {
            "constraint": along,
            "gamma_norm": np.sum(gamma * gamma, axis=-1),
            "energy": np.asarray(kinetic + potential.terms.value(gamma)),
        }
        if potential.companion is not None and (self.linear == 0 or potential.unconditional):
            found["F2"] = np.asarray(np.sum(m * m, axis=-1) / 2 + potential.companion.value(gamma))
        if not potential.terms:
            found["space_momentum"] = np.einsum("...ji,...j->...i", frame, m)
        return found

    def rank_one(self) -> Veselova:
        """Return the same motion as the rank-one problem with A = 𝓘⁻¹, q = γ, which has a closed form.

        Raises Unsolved (``not-rank-one``) unless V = 0 and (Ω,γ) = 0 to 1e-9 of |Ω|.
        """
        self._require_geodesic()
        A: Any = [1 / moment for moment in self.moments] if self.axes is None else self.inverse
        return Veselova(A, self.gamma, np.cross(self.gamma, self.Omega), self.frame, normalize=True)

    def neumann(self) -> NeumannSystem:
        """Return the Neumann system that γ is in time τ₁, dτ₁ = √(2h det𝓘⁻¹/(𝓘⁻¹γ,γ)) dt (Theorem LR→N3), in principal axes.

        Raises Unsolved (``not-rank-one``) unless V = 0 and (Ω,γ) = 0 to 1e-9 of |Ω|, or at rest, where τ₁ stands still.
        """
        self._require_geodesic()
        if not np.any(self.Omega):
            raise Unsolved("not-rank-one", "a body at rest has no Neumann time: dτ₁/dt = 0")
        moments = np.array([float(moment) for moment in self.moments])
        rate = np.sqrt(self.Omega @ self.inertia @ self.Omega / np.prod(moments) / (self.gamma @ self.inverse @ self.gamma))
        to_principal = np.eye(3) if self.axes is None else self.axes.T
        q_prime = np.cross(self.gamma, self.Omega) / rate
        return NeumannSystem(
            [1 / moment for moment in self.moments], to_principal @ self.gamma, to_principal @ q_prime, normalize=True
        )

    def _require_geodesic(self) -> None:
        if self.potential.terms:
            raise Unsolved("not-rank-one", "the rank-one problem and Theorem LR→N3 have no potential; integrate numerically")
        if abs(self.linear) > INPUT_TOLERANCE * np.linalg.norm(self.Omega):
            reason = f"the rank-one problem and Theorem LR→N3 have (Ω,γ) = 0, here {self.linear:.6g}; integrate numerically"
            raise Unsolved("not-rank-one", reason)


def multiplier(problem: VeselovaSO3, Omega: Array, gamma: Array) -> Array:
    """Return λ = −(𝓘Ω×Ω + γ×∂V/∂γ, 𝓘⁻¹γ)/(𝓘⁻¹γ,γ), equation (la), shape (...)."""
    force = np.cross(Omega @ problem.inertia, Omega) + np.cross(gamma, problem.potential.terms.gradient(gamma))
    across = gamma @ problem.inverse
    return np.asarray(-np.sum(force * across, axis=-1) / np.sum(gamma * across, axis=-1))
