"""The dual of a system: that of Veselova and the Euler–Poisson equations, with their integrals and
potentials exchanged.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from veselova import EulerPoisson, VeselovaSO3
from veselova.mechanics.core.exact_input import exact_number
from veselova.mechanics.systems.rigid_body import RigidBody


def dual(problem: RigidBody) -> RigidBody:
    """Return the dual of a Veselova system, which is an Euler–Poisson one, or the other way round
    (duality lemma).

    Its inertia is 𝒥 = 𝓘⁻¹, and potential and companion are exchanged: 𝒱 = F, and V completes the
    integral. It starts with the same γ, γ̇ and frame, and zero linear constant: Ω = γ̇×γ + sγ. The
    dual of the dual is the first.
    """
    gamma = problem.gamma
    Omega = problem.Omega - (problem.Omega @ gamma) * gamma
    free = isinstance(problem, VeselovaSO3)
    if free:
        Omega = (
            Omega - ((Omega @ problem.inverse @ gamma) / (gamma @ problem.inverse @ gamma)) * gamma
        )
    inertia: Any = (
        [1 / moment for moment in problem.moments] if problem.axes is None else problem.inverse
    )
    start = (inertia, gamma, Omega, _dual_data(problem), problem.frame)
    return EulerPoisson(*start, normalize=True) if free else VeselovaSO3(*start, normalize=True)


def _dual_data(problem: RigidBody) -> dict[str, Any] | None:
    """Return the data of the dual potential."""
    given = problem.potential.given
    if given is None:
        return None
    swapped: dict[str, Any] = {"family": given["family"]} if "family" in given else {}
    if "clebsch" in given:
        # F = −α det𝓘 (𝓘⁻¹γ,γ) = −(α/det𝒥) (𝒥γ,γ)
        determinant = np.prod(np.array(problem.moments, dtype=object))
        swapped["clebsch"] = -exact_number(given["clebsch"], ("potential", "clebsch")) * determinant
    if "polynomial" in given:
        swapped |= {"polynomial": given["companion"], "companion": given["polynomial"]}
    return swapped
