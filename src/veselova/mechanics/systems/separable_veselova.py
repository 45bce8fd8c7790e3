"""The reduced rank-one Veselova system in n dimensions, in the separable potentials of which (3.5,
printed 4.10) is the case n = 3.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.bodies.principal_inertia import positive_numbers
from veselova.mechanics.core.arguments import entry_count
from veselova.mechanics.core.errors import Faults, InvalidInput, field_faults, show
from veselova.mechanics.core.exact_input import (
    Numbers,
    exact_number,
    exact_vector,
    require_moderate,
    to_float,
)
from veselova.mechanics.core.problem import Problem, Series
from veselova.mechanics.flows.separable_flow import SeparableFlow
from veselova.mechanics.geometry import integrals_of_motion as integrals
from veselova.mechanics.geometry.integrals_of_motion import to_spheroconic
from veselova.mechanics.geometry.sphere import ExactState, point_on_sphere
from veselova.mechanics.potentials.separable import (
    SeparablePotential,
    family_polynomial,
    separation_constants,
)

__all__ = ["SeparableVeselova"]

Array = NDArray[np.float64]

#: The parts of a potential.
_PARTS = ("quartic", "quadratic", "centrifugal")


class SeparableVeselova(Problem):
    """The point q = e_1 of an n-dimensional body with inertia (4.5, printed 5.11) under (44,
    printed 5.2), n ≥ 2, in a separable potential

    V(q) = α₁[(A⁻²q,q) − (A⁻¹q,q)²] + α₂(A⁻¹q,q) + Σ β_i/q_i², equation (3.5, printed 4.10) where n
    = 3 and A = 𝓘⁻¹.

    - A: n distinct positive numbers
    - q, q_dot: the unit vector e_1 at t = 0 and its velocity, tangent to the sphere, (n,)
    - potential: {"quartic": α₁, "quadratic": α₂, "centrifugal": [β_1 … β_n]}, what is left out
      being zero

    q must have unit length and q_dot be tangent to 1e-9; with ``normalize=True`` q is scaled and
    q_dot projected first. In time τ the motion separates in spheroconic coordinates, for any n
    (docs/separable.md). The rest of the frame is left out: with a potential it is no algebraic
    function of the motion of q. Raises InvalidInput.
    """

    A: Array
    q: Array
    q_dot: Array
    exact: ExactState
    potential: tuple[Fraction, Fraction, tuple[Fraction, ...]]

    system: ClassVar[str] = "separable"
    outputs: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "q": ("axis",),
        "q_dot": ("axis",),
        "spheroconic": ("coordinate",),
    }
    derived: ClassVar[tuple[str, ...]] = ("spheroconic",)
    bounded: ClassVar[tuple[str, ...]] = ("q",)
    portrait: ClassVar[str] = "q"
    engines: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "analytic": ("angles",),
        "numeric": ("dop853", "taylor"),
    }
    formulations: ClassVar[tuple[str, ...]] = ("reduced",)

    def __init__(
        self,
        A: Numbers,
        q: Numbers,
        q_dot: Numbers,
        potential: Mapping[str, Any] | None = None,
        *,
        normalize: bool = False,
    ) -> None:
        faults = Faults()
        diagonal = faults.attempt(_different_numbers, A) or (Fraction(1),) * entry_count(A, q)
        n = len(diagonal)
        exact = faults.attempt(point_on_sphere, diagonal, q, q_dot, normalize)
        parts = faults.attempt(_potential, potential, n)
        faults.require_none()
        strengths = (*parts[:2], *parts[2])
        require_moderate(exact.tangent, ("q_dot",), has_scale=any(strengths))
        require_moderate(strengths, ("potential",), has_scale=True)
        for i, beta in enumerate(parts[2]):
            if beta and not exact.q[i]:
                raise InvalidInput(
                    ("potential", "centrifugal", i), "zero where q_i = 0 at the start", show(beta)
                )
        self._set(exact=exact, A=to_float(diagonal), potential=parts)
        self._set(q=exact.position, q_dot=to_float(exact.tangent))
        if not np.isfinite(self.energy):
            given = f"an energy of {self.energy}"
            raise InvalidInput(("potential",), "one that is finite at the start", given)

    @property
    def n(self) -> int:
        """Return the dimension of the body."""
        return int(self.A.size)

    @property
    def polynomial(self) -> tuple[Fraction, ...]:
        """Return the coefficients of v(λ), lowest first: V = Σ v(λ_k)/Π_{s≠k}(λ_k−λ_s), the β_i
        apart.
        """
        return family_polynomial([1 / a for a in self.exact.A], *self.potential[:2])

    @property
    def separable_potential(self) -> SeparablePotential:
        """Return the potential in floating point."""
        return SeparablePotential(to_float(self.polynomial), to_float(self.potential[2]))

    @property
    def energy(self) -> float:
        """Return h = T + V at the start."""
        with np.errstate(all="ignore"):
            kinetic = float(integrals.energy(self.A, self.q, self.q_dot))
            return kinetic + float(self.separable_potential.value(self.A, self.q))

    @property
    def turning(self) -> float:
        """Return |q̇| plus a rate to which the potential can bring the body."""
        scale, k = integrals.unit_scale(self.A)
        lightest = float(np.min(scale)) ** 2 / float(np.prod(scale)) * 2.0 ** (k * (2 - self.n))
        return float(np.linalg.norm(self.q_dot) + np.sqrt(2 * self._size / lightest))

    @property
    def _size(self) -> float:
        """Return how large the parts of the potential are at the start."""
        quartic, quadratic, betas = self.potential
        I = 1 / self.A
        q2 = self.q * self.q
        walls = sum(abs(float(b)) / x for b, x in zip(betas, q2, strict=True) if b)
        return float(abs(float(quartic)) * (I * I @ q2) + abs(float(quadratic)) * (I @ q2) + walls)

    @property
    def moves(self) -> bool:
        """Return whether the point moves: q̇ or the force along the sphere, both exactly.

        Without q̇ it rests where ∂V/∂q_i over q_i is the same for all q_i ≠ 0.
        """
        if np.any(self.q_dot):
            return True
        quartic, quadratic, betas = self.potential
        squares = [x * x for x in self.exact.q]
        size = sum(squares, Fraction())
        inverse = [1 / a for a in self.exact.A]
        moment = sum((i * x for i, x in zip(inverse, squares, strict=True)), Fraction()) / size
        slopes = {
            quartic * i * (i - 2 * moment) + quadratic * i - beta * (size / x) ** 2
            for i, x, beta in zip(inverse, squares, betas, strict=True)
            if x
        }
        return len(slopes) > 1

    @property
    def start(self) -> Series:
        """Return the series at t = 0."""
        return {"q": self.q[None], "q_dot": self.q_dot[None]}

    def flow(self, formulation: str = "reduced") -> SeparableFlow:
        """Return the reduced flow with this potential, in units of this problem."""
        quartic, quadratic, betas = self.potential
        turning = max(self.turning, float(np.finfo(float).tiny))  # its reciprocal is a float
        return SeparableFlow.of(
            self.A, self.q, self.q_dot, (float(quartic), float(quadratic), to_float(betas)), turning
        )

    def derive(self, name: str, series: Series) -> Array:
        """Return the spheroconic coordinates."""
        return to_spheroconic(self.A, series["q"])

    def integrals(self, series: Series) -> dict[str, Array]:
        """Return ``energy`` h = T + V, ``constants`` f_0 … f_{n−3} of the separation
        (docs/separable.md), ``q_norm`` (q,q).
        """
        potential = self.separable_potential
        rows = zip(series["q"], series["q_dot"], strict=True)
        found = np.array([separation_constants(self.A, q, v, potential) for q, v in rows])
        q = series["q"]
        return {
            "energy": found[:, -1],
            "constants": found[:, :-1],
            "q_norm": np.sum(q * q, axis=-1),
        }


def _different_numbers(A: Any) -> tuple[Fraction, ...]:
    """Return the entries of A exactly; raises InvalidInput unless they are different."""
    diagonal = positive_numbers(A)
    faults = Faults()
    for i, value in enumerate(diagonal):
        if value in diagonal[:i]:
            faults.add(("A", i), "a number different from the others", show(A[i]))
    faults.require_none()
    return diagonal


def _potential(given: Any, n: int) -> tuple[Fraction, Fraction, tuple[Fraction, ...]]:
    """Return (α₁, α₂, β); raises InvalidInput, located below ``potential``."""
    if given is None:
        return Fraction(0), Fraction(0), (Fraction(0),) * n
    if not isinstance(given, Mapping) or not given:
        raise InvalidInput(
            ("potential",), f"an object with some of {', '.join(_PARTS)}, or null", show(given)
        )
    faults = Faults()
    faults.found += field_faults(("potential",), given, _PARTS)
    quartic, quadratic = (
        faults.attempt(exact_number, given.get(name, 0), ("potential", name)) for name in _PARTS[:2]
    )
    walls = given.get("centrifugal", (0,) * n)
    betas = faults.attempt(exact_vector, walls, ("potential", "centrifugal"), n)
    faults.require_none()
    return quartic, quadratic, betas
