"""The integrable rank-one Veselova problem: a body with inertia (4.5) and its state at t = 0."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.bodies.principal_inertia import WideAxes, principal_inertia
from veselova.mechanics.core.arguments import entry_count, read_only
from veselova.mechanics.core.errors import Faults, InvalidInput
from veselova.mechanics.core.exact_input import Numbers, require_moderate, round_to_text, to_float
from veselova.mechanics.core.problem import Series
from veselova.mechanics.flows.reduced_flow import ReducedFlow
from veselova.mechanics.geometry import integrals_of_motion as integrals
from veselova.mechanics.geometry.integrals_of_motion import to_spheroconic
from veselova.mechanics.geometry.natural_frame import (
    admissible_frame,
    natural_frame,
    read_frame,
    refine,
)
from veselova.mechanics.geometry.so_n import wedge
from veselova.mechanics.geometry.sphere import ExactState, point_on_sphere
from veselova.mechanics.systems.neumann import NeumannSystem
from veselova.mechanics.systems.torus_problem import TorusProblem

__all__ = ["Veselova"]

Array = NDArray[np.float64]


#: Products of all A's are between this and its inverse: energy and momentum are floats then.
_LEAST_PRODUCT = Fraction(1, 10**200)


class Veselova(TorusProblem):
    """An n-dimensional rigid body with inertia 𝓘(E_i∧E_j) = (A_iA_j/det A) E_i∧E_j under the
    constraint (44, printed 5.2), n ≥ 2.

    - A: n positive numbers, or a symmetric positive definite n × n matrix. A matrix is
      diagonalised: the body axes stay the given ones, and the attributes A, q, q_dot, frame are
      in the principal axes (``axes`` maps back)
    - q: (n,) the unit vector e_1 at t = 0, seen from the body
    - q_dot: (n,) its velocity, tangent to the sphere; zero is a body at rest
    - frame: (n, n) the frame [e_1 … e_n] at t = 0, columns e_i, e_1 = q; None for the natural
      frame (Theorem recon0)

    q must have unit length and q_dot be tangent to 1e-9. With ``normalize=True`` q is scaled and
    q_dot projected first, and the frame is made orthonormal with e_1 = q; its determinant keeps
    its sign (``read_frame``). Every number may be a string ("0.7", "7/10") and is then taken
    exactly. Smaller defects are projected away. Raises InvalidInput, which names the field, what
    was required and what was given.

    Outputs:

    - q, q_dot: (N, n)
    - frame: (N, n, n) columns e_i, along the body axes of the problem
    - omega: (N, n, n) q∧q̇, equation (44.3, printed 6.1)
    - spheroconic: (N, n−1), increasing
    - tau1: (N,) Neumann time, zero at t = 0
    """

    A: Array
    q: Array
    q_dot: Array
    near_frame: Array
    axes: Array | None
    exact: ExactState

    system: ClassVar[str] = "veselova"
    outputs: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "q": ("axis",),
        "q_dot": ("axis",),
        "frame": ("axis", "vector"),
        "omega": ("axis", "axis_2"),
        "spheroconic": ("coordinate",),
        "tau1": (),
    }
    derived: ClassVar[tuple[str, ...]] = ("q", "omega")
    columns_of_frame: ClassVar[Mapping[str, int]] = {"q": 0}
    bounded: ClassVar[tuple[str, ...]] = ("frame",)
    portrait: ClassVar[str] = "q"
    formulations: ClassVar[tuple[str, ...]] = ("reduced",)
    vanishing = frozenset({"q_p"})

    def __init__(
        self,
        A: Numbers,
        q: Numbers,
        q_dot: Numbers,
        frame: Numbers | None = None,
        *,
        normalize: bool = False,
    ) -> None:
        faults = Faults()
        inertia = faults.attempt(_moderate_inertia, A)
        size = entry_count(A, q)
        diagonal, axes = inertia or ((Fraction(1),) * size, None)
        exact = faults.attempt(point_on_sphere, diagonal, q, q_dot, normalize)
        q_of_frame = exact and exact.q
        exact_frame = faults.attempt(read_frame, frame, q_of_frame, size, normalize)
        faults.require_none()
        if axes is not None:
            # The tangential part, so that a body at rest stays so.
            exact = replace(exact, q=axes.to_axes(exact.q), q_dot=axes.to_axes(exact.tangent))
        require_moderate(exact.tangent, ("q_dot",))
        self._become(replace(exact, frame=exact_frame), axes)

    def _become(self, exact: ExactState, axes: WideAxes | None = None) -> None:
        """Set the state from data along principal axes, of which the frame alone is along the
        body's.
        """
        A, velocity = to_float(exact.A), to_float(exact.tangent)
        position = exact.position
        if exact.frame is None:
            near_frame = natural_frame(integrals.unit_scale(A)[0], position, velocity)
        else:
            along = to_float(exact.frame)
            along = along if axes is None else axes.rounded.T @ along
            near_frame = admissible_frame(along, position)
        self._set(A=A, q=position, q_dot=velocity, near_frame=near_frame, exact=exact)
        self._set(axes=None if axes is None else axes.rounded)
        if A.size == 3:
            to_body = np.eye(3) if axes is None else axes.rounded
            self._set(inverse_inertia=to_body @ np.diag(A) @ to_body.T)

    def neumann(self) -> NeumannSystem:
        """Return the Neumann system that the motion of q is in time τ₁ (Theorem LR→Nn), along the
        principal axes; F_0 = 0.

        q' = q̇ √((Aq,q)/(2h det A)). Raises InvalidInput for a body at rest.
        """
        if not self.moves:
            raise InvalidInput(
                ("q_dot",), "a body that moves (at rest τ₁ stands still)", "the zero vector"
            )
        return NeumannSystem(
            self.A, self.q, integrals.neumann_velocity(self.A, self.q, self.q_dot), normalize=True
        )

    @cached_property
    def moves(self) -> bool:
        """Return whether the body moves at all (q̇ ≠ 0)."""
        return bool(self.q_dot.any())

    @cached_property
    def frame(self) -> Array:
        """Return the frame [e_1 … e_n] at t = 0, (n, n): the given one, or the natural one to the
        last bit.
        """
        if self.exact.frame is not None:
            return self.near_frame
        return read_only(refine(self.near_frame, self.exact.A, self.exact.q, self.exact.tangent))

    @cached_property
    def energy(self) -> float:
        """Return the kinetic energy h, equation (redL, printed 6.2)."""
        return float(integrals.energy(self.A, self.q, self.q_dot))

    @cached_property
    def constants(self) -> Array:
        """Return c_2 ≤ … ≤ c_{n−1}, the nonzero roots of the invariant polynomial N(λ), shape
        (n−2,).
        """
        return read_only(integrals.constants_of_motion(self.A, self.q, self.q_dot))

    @cached_property
    def spheroconic(self) -> Array:
        """Return the spheroconic coordinates λ_1 ≤ … ≤ λ_{n−1} at t = 0, shape (n−1,)."""
        return read_only(to_spheroconic(self.A, self.q))

    @property
    def turning(self) -> float:
        """Return |q̇|."""
        return float(np.linalg.norm(self.q_dot))

    @property
    def start(self) -> Series:
        """Return the series at t = 0."""
        series = {"tau1": np.zeros(1), "q_dot": self.q_dot[None], "frame": self.frame[None]}
        return self.complete({**series, "spheroconic": self.spheroconic[None]})

    def flow(self, formulation: str = "reduced") -> ReducedFlow:
        """Return the reduced flow (extended, printed 6.8) with the frame, in units of this problem;
        the body must move.
        """
        return ReducedFlow.of(self.A, self.q, self.q_dot, self.frame)

    def derive(self, name: str, series: Series) -> Array:
        """Return q, the first column of the frame, its spheroconic coordinates, or ω = q∧q̇ in the
        body, equation (44.3, printed 6.1).
        """
        q = series["frame"][..., 0]
        q_dot = series["q_dot"]
        if name == "q":
            return super().derive(name, series)
        if name == "spheroconic":
            return to_spheroconic(self.A, q if self.axes is None else q @ self.axes)
        return np.asarray(wedge(q, q_dot))

    def complete(self, series: Series) -> Series:
        """Return series along the principal axes of A in the body axes; spheroconic coordinates
        only where they were found.
        """
        if self.axes is None:
            return series
        rotated = {name: self.to_body_axes(series[name]) for name in ("q_dot", "frame")}
        return {**series, **rotated}

    def integrals(self, series: Series) -> dict[str, Array]:
        """Return the integrals of motion along states in the body axes, by name, first axis the
        times.

        ``energy`` h; ``q_norm`` (q,q); ``q_p`` (q,p)/|p|; ``neumann`` F_1…F_n; ``linear`` l_2…l_n;
        ``constants`` c_2…c_{n−1}.
        """
        q_dot = series["q_dot"]
        frame = series["frame"]
        if self.axes is not None:
            q_dot = q_dot @ self.axes
            frame = self.axes.T @ frame
        q = frame[..., 0]
        p = integrals.momentum(self.A, q, q_dot)
        velocity = integrals.neumann_velocity(self.A, q, q_dot)
        size = np.linalg.norm(p, axis=-1)
        return {
            "energy": integrals.energy(self.A, q, q_dot),
            "q_norm": (q * q).sum(axis=-1),
            "q_p": np.divide((q * p).sum(axis=-1), size, out=np.zeros_like(size), where=size > 0),
            "neumann": integrals.uhlenbeck_integrals(self.A, q, velocity),
            "linear": integrals.linear_integrals(p, frame),
            "constants": integrals.moser_eigenvalues(self.A, q, velocity)[..., 1:],
        }

    def to_body_axes(self, vectors: Array) -> Array:
        """Return components along the given body axes of vectors (..., n) or column matrices (...,
        n, k) in principal axes.
        """
        if self.axes is None:
            return vectors
        return np.asarray(
            vectors @ self.axes.T if vectors.ndim < 3 else self.axes @ vectors, dtype=np.float64
        )


def _moderate_inertia(A: Any) -> tuple[tuple[Fraction, ...], WideAxes | None]:
    """Return ``principal_inertia``; raises InvalidInput unless det A is moderate."""
    diagonal, axes = principal_inertia(A)
    product = math.prod(diagonal, start=Fraction(1))
    if not _LEAST_PRODUCT <= product <= 1 / _LEAST_PRODUCT:
        required = "numbers whose product is from 1e-200 to 1e200 (choose another unit)"
        raise InvalidInput(("A",), required, f"one of {round_to_text(product)}")
    return diagonal, axes
