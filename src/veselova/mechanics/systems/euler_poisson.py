"""The Euler–Poisson equations of a free rigid body in a potential 𝒱(γ)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.problem import Series
from veselova.mechanics.systems.rigid_body import RigidBody

__all__ = ["EulerPoisson"]

Array = NDArray[np.float64]


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
