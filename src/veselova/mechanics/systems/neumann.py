"""The Neumann system on Sⁿ⁻¹: a point on the unit sphere in the potential U = ½(A⁻¹q,q), for any
value of F_0.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.bodies.principal_inertia import positive_numbers
from veselova.mechanics.core.arguments import entry_count, read_only
from veselova.mechanics.core.errors import Faults
from veselova.mechanics.core.exact_input import Numbers, require_moderate, to_float
from veselova.mechanics.core.problem import Series
from veselova.mechanics.flows.neumann_flow import NeumannFlow
from veselova.mechanics.geometry.integrals_of_motion import (
    moser_eigenvalues,
    to_spheroconic,
    uhlenbeck_integrals,
)
from veselova.mechanics.geometry.natural_frame import moser_frame, refine
from veselova.mechanics.geometry.sphere import ExactState, point_on_sphere
from veselova.mechanics.systems.torus_problem import TorusProblem

__all__ = ["NeumannSystem"]

Array = NDArray[np.float64]


class NeumannSystem(TorusProblem):
    """A point on the unit sphere Sⁿ⁻¹, n ≥ 2, that moves by q'' = −A⁻¹q + [(A⁻¹q,q) − (q',q')]q,
    equation (4.7, printed 6.16), in time τ₁.

    - A: n positive numbers
    - q: the unit vector at τ₁ = 0, (n,)
    - q_prime: its velocity dq/dτ₁, tangent to the sphere, (n,)

    q must have unit length and q_prime be tangent to 1e-9; with ``normalize=True`` q is scaled and
    q_prime projected first. On F_0 = 0, equation (4.8, printed 6.17), the motion is that of a
    Veselova problem (Theorem LR→Nn); here F_0 may have any value. The frame's other columns are the
    eigenvectors n_2 … n_{n−1}, n_1 of A⁻¹ − q'q'ᵀ on q⊥ with eigenvalues c_2 … c_{n−1}, c_1. Raises
    InvalidInput, which names the field, what was required and what was given.
    """

    A: Array
    q: Array
    q_prime: Array
    near_frame: Array
    exact: ExactState

    system: ClassVar[str] = "neumann"
    time: ClassVar[str] = "tau1"
    outputs: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "q": ("axis",),
        "q_prime": ("axis",),
        "frame": ("axis", "vector"),
        "spheroconic": ("coordinate",),
    }
    derived: ClassVar[tuple[str, ...]] = ("q",)
    columns_of_frame: ClassVar[Mapping[str, int]] = {"q": 0}
    bounded: ClassVar[tuple[str, ...]] = ("frame",)
    shown: ClassVar[tuple[str, ...]] = ("A", "q", "q_prime")
    portrait: ClassVar[str] = "q"
    formulations: ClassVar[tuple[str, ...]] = ("neumann",)

    def __init__(
        self, A: Numbers, q: Numbers, q_prime: Numbers, *, normalize: bool = False
    ) -> None:
        faults = Faults()
        diagonal = faults.attempt(positive_numbers, A) or (Fraction(1),) * entry_count(A, q)
        exact = faults.attempt(point_on_sphere, diagonal, q, q_prime, normalize, "q_prime")
        faults.require_none()
        require_moderate(exact.tangent, ("q_prime",), has_scale=True)
        self._set(
            A=to_float(diagonal), q=exact.position, q_prime=to_float(exact.tangent), exact=exact
        )
        self._set(near_frame=moser_frame(self.A, self.q, self.q_prime))

    @cached_property
    def frame(self) -> Array:
        """Return the frame at τ₁ = 0, (n, n), to the last bit."""
        return read_only(
            refine(self.near_frame, self.exact.A, self.exact.q, self.exact.tangent, Fraction(1))
        )

    @property
    def energy(self) -> float:
        """Return ½(q',q') + ½(A⁻¹q,q)."""
        return float(self._energy(self.q, self.q_prime))

    @property
    def moves(self) -> bool:
        """Return whether the point moves: it rests where q' = 0 and q is an eigenvector of A."""
        values = {a for a, x in zip(self.exact.A, self.exact.q, strict=True) if x}
        return any(self.exact.tangent) or len(values) > 1

    @property
    def turning(self) -> float:
        """Return the larger of |q'| and √max I."""
        return float(max(np.linalg.norm(self.q_prime), np.sqrt(np.max(1 / self.A))))

    @property
    def start(self) -> Series:
        """Return the series at τ₁ = 0."""
        spheroconic = to_spheroconic(self.A, self.q[None])
        return {
            "q_prime": self.q_prime[None],
            "frame": self.frame[None],
            "spheroconic": spheroconic,
        }

    def flow(self, formulation: str = "neumann") -> NeumannFlow:
        """Return the field (4.7, printed 6.16) in units of this problem."""
        time_unit = 1 / self.turning
        return NeumannFlow(
            time_unit**2 / self.A,
            time_unit,
            np.concatenate([time_unit * self.q_prime, self.frame.ravel()]),
        )

    def complete(self, series: Series) -> Series:
        """Return the engine's series under the names of this system, with the spheroconic
        coordinates.
        """
        spheroconic = series.get("spheroconic")
        if spheroconic is None:
            spheroconic = to_spheroconic(self.A, series["frame"][:, :, 0])
        return {"q_prime": series["q_dot"], "frame": series["frame"], "spheroconic": spheroconic}

    def _energy(self, q: Array, v: Array) -> Array:
        return np.asarray(
            (np.sum(v * v, axis=-1) + np.sum(q * q / self.A, axis=-1)) / 2, dtype=np.float64
        )

    def integrals(self, series: Series) -> dict[str, Array]:
        """Return the integrals of motion along the series, by name.

        ``energy`` ½(q',q') + ½(A⁻¹q,q); ``F0`` (4.8, printed 6.17); ``neumann`` F_1…F_n;
        ``constants`` c_1…c_{n−1}; ``q_norm`` (q,q).
        """
        q = series["frame"][..., 0]
        v = series["q_prime"]
        A = self.A
        qAq, qAv, vAv = (np.sum(a * A * b, axis=-1) for a, b in ((q, q), (q, v), (v, v)))
        return {
            "energy": self._energy(q, v),
            "F0": vAv * qAq - qAv * qAv - qAq,
            "neumann": uhlenbeck_integrals(A, q, v),
            "constants": moser_eigenvalues(A, q, v),
            "q_norm": np.sum(q * q, axis=-1),
        }
