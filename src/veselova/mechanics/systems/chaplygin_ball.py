"""Chaplygin's ball: it rolls on a plane without slipping, and is free to twist."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.decimals import exact_as
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.core.exact_input import to_float
from veselova.mechanics.core.flow import Flow
from veselova.mechanics.core.problem import Series
from veselova.mechanics.core.upper import call_upper
from veselova.mechanics.flows.rigid_body_flow import SpatialFlow
from veselova.mechanics.geometry.integrals_of_motion import unit_scale
from veselova.mechanics.systems.rolling_ball import RollingBall
from veselova.mechanics.systems.rolling_ball_n import ChaplyginBallN, RollingBallN
from veselova.mechanics.systems.torus_problem import TorusProblem
from veselova.mechanics.systems.veselova import Veselova

__all__ = ["ChaplyginBall"]

Array = NDArray[np.float64]


class ChaplyginBall(RollingBall):
    """A ball of mass m and radius a that rolls on a plane without slipping: K̇ = K×Ω, γ̇ = γ×Ω with
    K = JΩ − D(Ω,γ)γ, J = I + D, D = ma².

    The arguments are those of ``RubberBall``; Ω is any vector.
    Outputs: Omega, gamma, frame, the contact point ``position`` (N, 2) along e_2 and e_3, its
    ``velocity``, which is that of the centre, the horizontal ``force`` of the plane on the ball,
    and the momentum K about the contact point, which is fixed in space.

    Engine ``analytic`` has every motion, on the torus of ``AreaVeselova``, with any number of
    digits where the momentum is not along γ.
    Formulation: ``momentum``, Ω from the momentum in space, with the quadrature of the contact
    point. Raises InvalidInput, which names the field. With n ≥ 4 entries of ``gamma`` the ball is a
    ``ChaplyginBallN``.
    """

    system: ClassVar[str] = "chaplygin-ball"
    engines: ClassVar[Mapping[str, tuple[str, ...]]] = TorusProblem.engines
    has_tori: ClassVar[bool] = True
    formulations: ClassVar[tuple[str, ...]] = ("momentum",)
    in_many_dimensions: ClassVar[type[RollingBallN] | None] = ChaplyginBallN
    twists: ClassVar[bool] = True
    constrained: ClassVar[bool] = False

    @property
    def area_constant(self) -> float:
        """Return (K,γ) = (IΩ,γ), without the rounding of DΩ."""
        return float(self.gamma @ self.ball.tensor @ self.Omega)

    @property
    def _linear_constant(self) -> tuple[str, float]:
        return "(K,γ)", self.area_constant

    @property
    def added(self) -> Fraction:
        """Return D = ma²."""
        return self.ball.added

    def on_torus(self) -> Veselova:
        """Return the problem on whose torus the motion runs, the same object every time. Raises
        Unsolved (``at-rest``) for a ball at rest.
        """
        return self._torus

    @cached_property
    def _torus(self) -> Veselova:
        if not self.moves:
            raise Unsolved("at-rest", "nothing moves, so there is neither a curve nor a torus")
        found: Veselova = call_upper("area_torus", self)
        return found

    def angular_velocity(self, frame: Array) -> Array:
        """Return Ω = B(K + σγ) at attitudes [e_1 e_2 e_3] (N, 3, 3) of this motion, σ =
        D(BK,γ)/(Bγ,Iγ).
        """
        return self._solve(frame @ self.momentum_in_space, frame[..., 0], self.area_constant)

    @property
    def momentum_in_space(self) -> Array:
        """Return EᵀK, (3,), its first number the area constant, without the rounding of DΩ."""
        found = np.asarray(self.frame.T @ self.derive("momentum", self.start)[0])
        found[0] = self.area_constant
        return found

    def _about_centre(self, vectors: Array) -> Array:
        """Return Ix, as ``momentum_of``."""
        if vectors.dtype == object:
            return np.asarray(vectors * exact_as(vectors, self.ball.inertia))
        return np.asarray(vectors @ self.ball.tensor)

    def _solve(self, vector: Array, gamma: Array, along: Any) -> Array:
        """Return (J − Dγγᵀ)⁻¹x = Bx + D(Bx,γ)/(Bγ,Iγ) Bγ, for x and γ (..., 3); along: (x,γ)."""
        free = self.velocity_of(vector)
        across = self.velocity_of(gamma)
        # D(Bx,γ) = (x,γ) − (IBx,γ), without cancellation where D is large beside I
        share = along - np.sum(self._about_centre(free) * gamma, axis=-1)
        # 1 − D(Bγ,γ), without cancellation where I is small beside D
        share = share / np.sum(across * self._about_centre(gamma), axis=-1)
        return np.asarray(free + share[..., None] * across)

    def flow(self, formulation: str = "momentum") -> Flow:
        """Return the field by the momentum in space, in units of this problem."""
        _, power = unit_scale(to_float(self.moments))
        attitude = SpatialFlow(
            inverse=np.ldexp(self.inverse, power),
            potential=self.potential.terms,
            frame=self.frame,
            time_unit=1 / self.turning,
            momentum=np.ldexp(self.momentum_in_space / self.turning, -power),
            weight=np.ldexp(self.ball.tensor, -power),
        )
        return self.roll(attitude)

    def angular_acceleration(self, Omega: Array, gamma: Array) -> Array:
        """Return Ω̇ from (J − Dγγᵀ)Ω̇ = IΩ×Ω."""
        torque = np.cross(self._about_centre(Omega), Omega)
        return self._solve(torque, gamma, np.sum(torque * gamma, axis=-1))

    def derive(self, name: str, series: Series) -> Array:
        """Return gamma, velocity, force or momentum."""
        if name != "momentum":
            return super().derive(name, series)
        Omega = series["Omega"]
        gamma = series["frame"][..., 0]
        spin = exact_as(Omega, self.ball.added) * np.sum(Omega * gamma, axis=-1)
        return np.asarray(self.momentum_of(Omega) - spin[..., None] * gamma)

    def integrals(self, series: Series) -> dict[str, Array]:
        """Return the integrals of motion along the series, by name: ``energy`` ½(K,Ω), ``area``
        (K,γ), ``gamma_norm`` (γ,γ), ``space_momentum`` EᵀK.
        """
        frame = series["frame"]
        gamma = frame[..., 0]
        momentum = self.derive("momentum", series)
        return {
            "energy": np.asarray(np.sum(momentum * series["Omega"], axis=-1) / 2),
            "area": np.asarray(np.sum(momentum * gamma, axis=-1)),
            "gamma_norm": np.asarray(np.sum(gamma * gamma, axis=-1)),
            "space_momentum": np.einsum("...ji,...j->...i", frame, momentum),
        }
