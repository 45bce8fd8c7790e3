"""Balls that roll on a hyperplane of ℝⁿ, n ≥ 4, without momentum in so(n−1): one that may not
twist, and Chaplygin's.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.bodies.ball import BallN
from veselova.mechanics.core.errors import Faults
from veselova.mechanics.core.exact_input import Number, Numbers, require_moderate, to_float
from veselova.mechanics.core.flow import Flow
from veselova.mechanics.core.problem import Series
from veselova.mechanics.flows.ball_flow import AttitudeFlow
from veselova.mechanics.geometry.integrals_of_motion import unit_scale
from veselova.mechanics.geometry.natural_frame import ExactFrame, admissible_frame
from veselova.mechanics.geometry.so_n import coefficients, skew, wedge
from veselova.mechanics.geometry.sphere import inverse_length
from veselova.mechanics.systems.rolling import (
    RollingOnPlane,
    frame_along,
    read_start,
    require_turning,
)
from veselova.mechanics.systems.rolling_veselova import CommutingVeselova, RollingVeselova
from veselova.mechanics.systems.torus_problem import TorusProblem

__all__ = ["ChaplyginBallN", "RollingBallN", "RubberBallN"]

Array = NDArray[np.float64]

#: Bits of 1/|γ| where it is irrational: beyond what the engine takes from data for doubles.
_BITS = 320


class RollingBallN(RollingOnPlane):
    """A ball in ℝⁿ, n ≥ 4, that rolls on a hyperplane without slipping, with (ω)_ij = s_ij(γ∧ξ)_ij:
    ξ is the velocity of γ in the rank-one problem with the same momentum p, J(γ∧ξ) = γ∧p.

    - ball: what was given of the ball
    - gamma: (n,) the unit normal e_1
    - Omega: (n(n−1)/2,) the coefficients of ω on E_i∧E_j, i < j
    - frame: (n, n) at t = 0
    """

    ball: BallN
    gamma: Array
    _exact_gamma: tuple[Fraction, ...]
    _exact_xi: tuple[Fraction, ...]
    _exact_frame: ExactFrame | None

    engines: ClassVar[Mapping[str, tuple[str, ...]]] = TorusProblem.engines
    has_tori: ClassVar[bool] = True
    shown: ClassVar[tuple[str, ...]] = ("gamma", "Omega")
    portrait: ClassVar[str] = "gamma"
    columns_of_frame: ClassVar[Mapping[str, int]] = {"gamma": 0}
    outputs: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "Omega": ("plane",),
        "gamma": ("axis",),
        "frame": ("axis", "vector"),
        "position": ("horizontal",),
        "velocity": ("horizontal",),
        "force": ("horizontal",),
        "momentum": ("plane",),
    }
    derived: ClassVar[tuple[str, ...]] = ("gamma", "velocity", "force", "momentum")
    formulations: ClassVar[tuple[str, ...]] = ("momentum",)
    vanishing = frozenset({"twist"})
    #: What ω has to be.
    restriction: ClassVar[str]

    def __init__(
        self,
        inertia: Numbers | Mapping[str, Any],
        mass: Number,
        radius: Number,
        gamma: Numbers,
        Omega: Numbers,
        frame: Numbers | None = None,
        position: Numbers = (0, 0),
        *,
        strict: bool = True,
        normalize: bool = False,
    ) -> None:
        def read_ball(n: int) -> BallN:
            return BallN.of(n, self.twists, inertia, mass, radius, position)

        start = read_start(Faults(), read_ball, gamma, Omega, frame, normalize)
        ball, exact_gamma, direction, omega, exact_frame = start
        self._set(ball=ball, gamma=direction, _exact_gamma=exact_gamma, _exact_frame=exact_frame)
        self._set(_exact_xi=self._velocity_on_torus(omega))
        require_moderate(self._exact_xi, ("Omega",))
        moves = any(self._exact_xi)
        if exact_frame is not None:
            found = admissible_frame(to_float(exact_frame), direction)
        elif moves:
            found = self.on_torus().frame
        else:
            found = frame_along(direction, 0 * direction)
        self._set(frame=found, Omega=np.zeros(self.n * (self.n - 1) // 2))
        if moves:
            self._set(Omega=self.angular_velocity(found[None])[0])
        if not normalize:
            require_turning(omega, self.Omega, self.restriction)

    def _velocity_on_torus(self, omega: Any) -> tuple[Fraction, ...]:
        """Return ξ over |γ| from γ̇ = −ωγ, ω an (n, n) array of rationals.

        γ̇_i = ξ_i Σ_j s_ij γ_j² − γ_i Σ_j s_ij γ_jξ_j: a linear system, positive definite across γ,
        to which γγᵀ is added.
        """
        from flint import fmpq, fmpq_mat

        gamma, shares = np.array(self._exact_gamma, dtype=object), self.ball.shares
        system = np.diag(shares @ (gamma * gamma)) + (1 - shares) * np.outer(gamma, gamma)
        right = -(omega @ gamma) * (gamma @ gamma)
        matrix, column = (
            fmpq_mat(*shape, [fmpq(*Fraction(x).as_integer_ratio()) for x in numbers.ravel()])
            for shape, numbers in (((self.n, self.n), system), ((self.n, 1), right))
        )
        return tuple(Fraction(int(x.p), int(x.q)) for x in matrix.solve(column).entries())

    @property
    def n(self) -> int:
        """Return the dimension."""
        return self.ball.n

    def on_torus(self) -> RollingVeselova:
        """Return the problem on whose torus the motion runs, the same object every time."""
        return self._torus

    @cached_property
    def _torus(self) -> RollingVeselova:
        length = inverse_length(self._exact_gamma, _BITS)
        xi = tuple(length * x for x in self._exact_xi)
        data = (self.ball.A, self._exact_gamma, xi, self._exact_frame)
        if self.twists:
            return CommutingVeselova(*data, added=self.ball.added)
        return RollingVeselova(*data, normalize=True)

    @cached_property
    def momentum_in_space(self) -> Array:
        """Return Eᵀp, (n,), with exact zero along e_1."""
        torus = self.on_torus()
        x = self.ball.roots
        q, xi = torus.q, torus.q_dot
        p = (q @ (x * q)) * (x * xi) - (xi @ (x * q)) * (x * q)
        found = self.frame.T @ p
        found[0] = 0.0
        return found

    def flow(self, formulation: str = "momentum") -> Flow:
        """Return the field by the momentum in space, in units of this problem."""
        _, power = unit_scale(self.ball.operator)
        power -= power % 2
        attitude = AttitudeFlow(
            shares=self.ball.shares.astype(np.float64),
            roots=np.ldexp(self.ball.roots, -power // 2),
            momentum=np.ldexp(self.momentum_in_space / self.turning, -power),
            frame=self.frame,
            time_unit=1 / self.turning,
        )
        return self.roll(attitude)

    def _xi(self, q: Array, p: Array) -> Array:
        """Return ξ = [x⁻¹p − (p,x⁻¹q)q]/(q,xq), J_ij = x_ix_j, for q and p (..., n)."""
        x = self.ball.roots
        free = p / x
        free = free - np.sum(free * q, axis=-1)[..., None] * q
        return np.asarray(free / np.sum(q * x * q, axis=-1)[..., None])

    def angular_velocity(self, frame: Array) -> Array:
        """Return Ω at attitudes (N, n, n) of this motion, (N, n(n−1)/2)."""
        q = frame[..., 0]
        xi = self._xi(q, frame @ self.momentum_in_space)
        shares = coefficients(self.ball.shares.astype(np.float64))
        return np.asarray(shares * coefficients(wedge(q, xi)))

    def _parts(self, series: Series) -> tuple[Array, Array, Array]:
        """Return ω, q and p = −((I+D)ω)q of series."""
        J = self.ball.operator + float(self.ball.added)
        q = series["frame"][..., 0]
        p = -np.einsum("...ij,...j->...i", skew(series["Omega"] * J, self.n), q)
        return skew(series["Omega"], self.n), q, p

    def derive(self, name: str, series: Series) -> Array:
        """Return gamma, velocity, force, or the momentum q∧p about the contact point, (N,
        n(n−1)/2).
        """
        if name == "gamma":
            return super().derive(name, series)
        omega, q, p = self._parts(series)
        if name == "momentum":
            return coefficients(wedge(q, p))
        radius = float(self.ball.radius)
        horizontal = series["frame"][..., 1:]
        q_dot = -np.einsum("...ij,...j->...i", omega, q)
        if name == "velocity":
            return np.asarray(-radius * np.einsum("...ik,...i->...k", horizontal, q_dot))
        x = self.ball.roots
        p_dot = -np.einsum("...ij,...j->...i", omega, p)
        xi = self._xi(q, p)
        size = np.sum(q * x * q, axis=-1)[..., None]
        # of the derivative of ξ, what is across q
        xi_dot = (p_dot / x - np.sum(p * q / x, axis=-1)[..., None] * q_dot) / size
        xi_dot = xi_dot - 2 * np.sum(q_dot * x * q, axis=-1)[..., None] / size * xi
        moved = np.einsum("...ij,...j->...i", omega, xi) + xi_dot
        side = 1.0 if self.twists else -1.0
        force = side * float(self.ball.mass) * radius
        return np.asarray(force * np.einsum("...ik,...i->...k", horizontal, moved))

    def complete(self, series: Series) -> Series:
        """Return the series of a flow with ω, which follows from the momentum."""
        return {"Omega": self.angular_velocity(series["frame"]), **series}

    def integrals(self, series: Series) -> dict[str, Array]:
        """Return the integrals of motion along the series, by name: ``energy`` ½⟨k,ω⟩,
        ``gamma_norm`` (γ,γ), ``space_momentum`` Eᵀp, ``twist``: the largest of ⟨ω, e_i∧e_j⟩, i, j ≥
        2, or, where the ball twists freely, of the momentum's, over that of all.
        """
        frame = series["frame"]
        omega, q, p = self._parts(series)
        q_dot = -np.einsum("...ij,...j->...i", omega, q)
        k = skew(series["Omega"] * self.ball.operator, self.n) if self.twists else omega
        along = np.swapaxes(frame, -1, -2) @ k @ frame
        size = np.max(np.abs(along), axis=(-1, -2))
        across = np.max(np.abs(along[..., 1:, 1:]), axis=(-1, -2))
        return {
            "energy": np.asarray(np.sum(p * q_dot, axis=-1) / 2),
            "gamma_norm": np.asarray(np.sum(q * q, axis=-1)),
            "space_momentum": np.einsum("...ji,...j->...i", frame, p),
            "twist": np.divide(across, size, out=np.zeros_like(size), where=size > 0),
        }


class RubberBallN(RollingBallN):
    """What ``RubberBall`` is in ℝⁿ, n ≥ 4: the rank-one Veselova system with inertia J = I + ma²,
    equation (4.5, printed 5.11), as a rolling ball.

    - inertia: {"special": [A_1 … A_n]}, the effective operator J with J_ij = A_iA_j/det A, all of
      them above ma²; the moments about the centre are I_ij = J_ij − ma²
    - mass, radius: positive numbers m and a
    - gamma: (n,) the unit normal e_1 = γ of the hyperplane, seen from the body
    - Omega: ω = γ∧γ̇ = γγ̇ᵀ − γ̇γᵀ at t = 0, its n(n−1)/2 coefficients on E_i∧E_j, i < j, or the
      skew matrix (n, n)
    - frame: (n, n) [e_1 … e_n] at t = 0, columns, e_1 = γ; None for the natural frame
    - position: (n−1,) the contact point at t = 0, along e_2 … e_n; the pair (0, 0) is the origin
    - strict: not asked here: no body of masses has such moments, but symmetric ones

    With ``normalize=True`` γ is scaled and ω projected on γ∧γ̇. Outputs: Omega (N, n(n−1)/2), gamma
    (N, n), frame (N, n, n), the contact point ``position`` (N, n−1), its ``velocity`` −a(e_k, γ̇),
    the ``force`` of the hyperplane along it, and the momentum γ∧p about the contact point, (N,
    n(n−1)/2), p fixed in space. ``error`` bounds frame and position.

    Engine ``analytic``: theta functions or angles, and the path by Fourier series or panels.
    Formulation: ``momentum``, ω from the momentum p in space, with the quadrature of the contact
    point. Against the ball itself 1e-12 for n = 4, 5 and t ≤ 20. Raises InvalidInput, which names
    the field.
    """

    system: ClassVar[str] = "rubber-ball"
    twists: ClassVar[bool] = False
    restriction: ClassVar[str] = "γ∧γ̇: no twist"


class ChaplyginBallN(RollingBallN):
    """What ``ChaplyginBall`` is in ℝⁿ, n ≥ 4, without momentum in so(n−1): it rolls without
    slipping and is free to twist, and k = Iω + D(γγᵀω + ωγγᵀ) = γ∧p, D = ma².

    - inertia: {"special": [A_1 … A_n]} with J_ij = A_iA_j/det A above ma²: the moments about the
      centre are I_ij = D²/(J_ij − D)
    - mass, radius, gamma, frame, position, strict: as of ``RubberBallN``
    - Omega: ω at t = 0, its n(n−1)/2 coefficients on E_i∧E_j, i < j, or the skew matrix (n, n);
      the momentum k that it makes has to be γ∧p to 1e-9

    With ``normalize=True`` γ is scaled, and ω becomes the one with this γ̇ = −ωγ and momentum γ∧p.
    The motion commutes with that of ``RubberBallN`` of the same A: ω = J(γ∧ξ)/D − γ∧ξ, where ξ is
    the velocity of that one with the same p. Outputs, error, engines, formulation: as of
    ``RubberBallN``.
    """

    system: ClassVar[str] = "chaplygin-ball"
    twists: ClassVar[bool] = True
    restriction: ClassVar[str] = "one without momentum in so(n−1), (Iω)(u, v) = 0 for u, v across γ"
