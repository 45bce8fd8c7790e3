"""Chaplygin's ball: it rolls on a plane without slipping, and is free to twist."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.flow import Flow
from veselova.mechanics.core.problem import Series
from veselova.mechanics.flows.ball_flow import ChaplyginFlow, RollingFlow
from veselova.mechanics.geometry.integrals_of_motion import unit_scale
from veselova.mechanics.systems.rolling_ball import RollingBall

__all__ = ["ChaplyginBall"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, init=False, repr=False)
class ChaplyginBall(RollingBall):
    """A ball of mass m and radius a that rolls on a plane without slipping: K̇ = K×Ω, γ̇ = γ×Ω with
    K = JΩ − D(Ω,γ)γ, J = I + D, D = ma².

    The arguments are those of ``RubberBall``; Ω is any vector.
    Outputs: Omega, gamma, frame, the contact point ``position`` (N, 2) along e_2 and e_3, its
    ``velocity``, which is that of the centre, the horizontal ``force`` of the plane on the ball,
    and the momentum K about the contact point, which is fixed in space.

    Integration alone serves it. Formulations: ``momentum``, Ω from the momentum in space, with the
    quadrature of the contact point; ``contact-forces``, the ball with its forces as Lagrange
    multipliers. Raises InvalidInput, which names the field.
    """

    system: ClassVar[str] = "chaplygin-ball"
    formulations: ClassVar[tuple[str, ...]] = ("momentum", "contact-forces")
    twists: ClassVar[bool] = True
    constrained: ClassVar[bool] = False

    @property
    def title(self) -> str:
        """Return the system, its area constant and its energy."""
        values = self.integrals(self.start)
        area, energy = (float(values[name][0]) for name in ("area", "energy"))
        return f"{self.system}, (K,γ) = {area:.6g}, energy {energy:.12g}"

    @property
    def _linear_name(self) -> str:
        return "(JΩ,γ)"

    def flow(self, formulation: str = "momentum") -> Flow:  # type: ignore[override]
        """Return the field in units of this problem."""
        if formulation == "contact-forces":
            return self.contact_force_flow()
        _, power = unit_scale(np.array([float(moment) for moment in self.moments]))
        momentum = self.derive("momentum", self.start)[0] / self.turning
        attitude = ChaplyginFlow(
            inertia=np.ldexp(self.ball.tensor, -power),
            inverse=np.ldexp(self.inverse, power),
            added=float(np.ldexp(float(self.ball.added), -power)),
            momentum=np.ldexp(self.frame.T @ momentum, -power),
            frame=self.frame,
            time_unit=1 / self.turning,
        )
        contact = self.start["position"][0]
        return RollingFlow(attitude, float(self.ball.radius), contact, self.ball.size)

    def angular_acceleration(self, Omega: Array, gamma: Array) -> Array:
        """Return Ω̇ from (J − Dγγᵀ)Ω̇ = IΩ×Ω."""
        added = float(self.ball.added)
        torque = np.cross(Omega @ self.ball.tensor, Omega)
        free = torque @ self.inverse
        across = gamma @ self.inverse
        share = added * np.sum(free * gamma, axis=-1)
        # 1 − D(Bγ,γ), without cancellation where I is small beside D
        share = share / np.sum(across * (gamma @ self.ball.tensor), axis=-1)
        return np.asarray(free + share[..., None] * across)

    def derive(self, name: str, series: Series) -> Array:
        """Return gamma, velocity, force or momentum."""
        if name != "momentum":
            return super().derive(name, series)
        Omega = series["Omega"]
        gamma = series["frame"][..., 0]
        spin = float(self.ball.added) * np.sum(Omega * gamma, axis=-1)
        return np.asarray(Omega @ self.inertia - spin[..., None] * gamma)

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
