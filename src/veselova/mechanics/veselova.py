"""The integrable rank-one Veselova problem: a body with inertia (4.5) and its state at t = 0."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics import integrals
from veselova.mechanics.errors import InvalidInput, shown
from veselova.mechanics.exact import exact_matrix, exact_vector, is_matrix, plain, to_float
from veselova.mechanics.flow import ReducedFlow
from veselova.mechanics.natural_frame import natural_frame, orthonormalized, refined
from veselova.mechanics.spheroconic import to_spheroconic

__all__ = ["Veselova"]

Array = NDArray[np.float64]

#: How far from unit length, tangency and orthogonality an input may be: ten-digit data pass, typing errors do not.
INPUT_TOLERANCE = 1e-9


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Veselova:
    """An n-dimensional rigid body with inertia 𝓘(E_i∧E_j) = (A_iA_j/det A) E_i∧E_j under the constraint (44), n ≥ 2.

    A        n positive numbers, or a symmetric positive definite n × n matrix, which is diagonalised: the body axes then
             stay the given ones, and A, q, q_dot, frame below are in the principal axes (``axes`` maps back)
    q        the unit vector e_1 at t = 0, seen from the body, (n,)
    q_dot    its velocity, tangent to the sphere, (n,); zero is a body at rest
    frame    the frame [e_1 … e_n] at t = 0, (n, n), columns e_i, e_1 = q; None for the natural frame (Theorem recon0)

    q must have unit length and q_dot be tangent to 1e-9; with ``normalize=True`` q is scaled and q_dot projected first.
    Every number may be given as a string ("0.7", "7/10") and is then taken exactly. What is off the manifold by less than
    the tolerance is projected onto it. Raises InvalidInput, which names the field, what was required and what was given.
    """

    A: Array
    q: Array
    q_dot: Array
    frame: Array
    axes: Array | None
    exact: ExactState
    given: Mapping[str, Any]

    system: ClassVar[str] = "veselova"

    def __init__(self, A: Any, q: Any, q_dot: Any, frame: Any = None, *, normalize: bool = False) -> None:
        if not isinstance(normalize, bool):
            raise InvalidInput(("normalize",), "true or false", shown(normalize))
        diagonal, axes = _principal_inertia(A)
        n = len(diagonal)
        exact_q = exact_vector(q, ("q",), n)
        exact_q_dot = exact_vector(q_dot, ("q_dot",), n)
        if not any(exact_q):
            raise InvalidInput(("q",), "a vector of unit length", "the zero vector")
        largest = max(abs(x) for x in exact_q)
        position, velocity = to_float([x / largest if normalize else x for x in exact_q]), to_float(exact_q_dot)
        if not normalize:
            _require_on_sphere(position, velocity)
        exact_frame = None if frame is None else exact_matrix(frame, ("frame",), n)
        given_frame = None if exact_frame is None else to_float(exact_frame)
        if axes is not None:
            with np.errstate(over="ignore", invalid="ignore"):  # refused below
                position, velocity = axes.T @ position, axes.T @ velocity
            given_frame = None if given_frame is None else axes.T @ given_frame
            _require_finite(velocity, exact_q_dot)
            exact_q, exact_q_dot = tuple(map(Fraction, position.tolist())), tuple(map(Fraction, velocity.tolist()))
        exact = ExactState(diagonal, exact_q, exact_q_dot, exact_frame)
        position, velocity = _unit(position), _rounded(exact.tangent)
        A_float = to_float(diagonal)
        _require_representable_energy(A_float, position, velocity)
        if given_frame is None:
            start_frame = refined(natural_frame(A_float, position, velocity), exact.A, exact.q, exact.tangent)
        else:
            start_frame = _admissible_frame(given_frame, position)
        self._set(A=A_float, q=position, q_dot=velocity, frame=start_frame, axes=axes)
        object.__setattr__(self, "exact", exact)
        given = {"A": A, "q": q, "q_dot": q_dot, "frame": frame, "normalize": normalize}
        object.__setattr__(self, "given", {name: plain(value) for name, value in given.items() if value is not None})

    @classmethod
    def from_torus(cls, A: Any, energy: Any, constants: Any, phases: Any, signs: Any, frame: Any = None) -> Veselova:
        """Return the problem whose motion has these constants and phases, as ``veselova.torus`` gives them.

        A       n distinct positive numbers · energy  h > 0 · constants (n−2,) c_2 … c_{n−1}, with c_1 = 0 and the sorted I_i
                interlacing as max(c_s, I_s) < min(c_{s+1}, I_{s+1}) · phases (n−1,) z⁰ of the start, modulo 1
        signs   n times 1 or −1: of q_i at the start, or of q̇_i where q_i = 0 · frame as above

        Raises InvalidInput where no real motion has them. Round trip to 1e-13 for n = 2…8, ratios of A up to 100.
        """
        from veselova.engines import start_on_torus

        q, q_dot = start_on_torus(A, energy, constants, phases, signs)
        return cls(A, q, q_dot, frame, normalize=True)

    def _set(self, **arrays: Array | None) -> None:
        for name, value in arrays.items():
            if value is not None:
                value = np.array(value)
                value.setflags(write=False)
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        # Vectors along the principal axes, to the digits that recognise them.
        parts = (f"{name}={np.array2string(getattr(self, name), precision=6, threshold=8)}" for name in ("A", "q", "q_dot"))
        return f"Veselova({', '.join(parts)})".replace("\n", "")

    @property
    def n(self) -> int:
        """Return the dimension of the body."""
        return int(self.A.size)

    @property
    def moves(self) -> bool:
        """Return whether the body moves at all (q̇ ≠ 0)."""
        return bool(np.any(self.q_dot))

    @cached_property
    def energy(self) -> float:
        """Return the kinetic energy h, equation (redL)."""
        return float(integrals.energy(self.A, self.q, self.q_dot))

    @cached_property
    def constants(self) -> Array:
        """Return c_2 ≤ … ≤ c_{n−1}, the nonzero roots of the invariant polynomial N(λ), shape (n−2,)."""
        return _read_only(integrals.constants_of_motion(self.A, self.q, self.q_dot))

    @cached_property
    def spheroconic(self) -> Array:
        """Return the spheroconic coordinates λ_1 ≤ … ≤ λ_{n−1} at t = 0, shape (n−1,)."""
        return _read_only(to_spheroconic(self.A, self.q))

    @cached_property
    def flow(self) -> ReducedFlow:
        """Return the reduced flow (extended) with the frame, in units of this problem; the body must move."""
        return ReducedFlow.of(self.A, self.q, self.q_dot, self.frame)

    def integrals(self, q_dot: Array, frame: Array) -> dict[str, Array]:
        """Return the integrals of motion along states in the body axes, by name, first axis the times.

        ``energy`` h; ``q_norm`` (q,q); ``q_p`` (q,p)/|p|; ``neumann`` F_1…F_n; ``linear`` l_2…l_n; ``constants`` c_2…c_{n−1}.
        """
        if self.axes is not None:
            q_dot, frame = q_dot @ self.axes, self.axes.T @ frame
        q = frame[..., 0]
        p = integrals.momentum(self.A, q, q_dot)
        size = integrals.norm(p)
        return {
            "energy": integrals.energy(self.A, q, q_dot),
            "q_norm": np.sum(q * q, axis=-1),
            "q_p": np.divide(np.sum(q * p, axis=-1), size, out=np.zeros_like(size), where=size > 0),
            "neumann": integrals.neumann_integrals(self.A, q, q_dot),
            "linear": integrals.linear_integrals(p, frame),
            "constants": integrals.constants_of_motion(self.A, q, q_dot),
        }

    def as_dict(self) -> dict[str, Any]:
        """Return the problem as given, JSON-ready: floats as they are, exact numbers as strings."""
        return {"system": self.system, **self.given}

    def conditioning_floor(self, times: Array) -> Array:
        """Return ε·max(1, |ω|·|t|): how far one rounding of the data moves the state, which no method can better."""
        return np.asarray(np.finfo(float).eps * np.maximum(1.0, np.linalg.norm(self.q_dot) * np.abs(times)), dtype=np.float64)

    def to_body_axes(self, vectors: Array) -> Array:
        """Return components along the given body axes of vectors (..., n) or column matrices (..., n, k) in principal axes."""
        if self.axes is None:
            return vectors
        return np.asarray(vectors @ self.axes.T if vectors.ndim < 3 else self.axes @ vectors, dtype=np.float64)


@dataclass(frozen=True)
class ExactState:
    """The data as exact rationals in principal axes, q not yet scaled and q_dot not yet projected.

    frame: rows of the frame as given (along the body axes, where A was a matrix), None where the natural one was left to us
    """

    A: tuple[Fraction, ...]
    q: tuple[Fraction, ...]
    q_dot: tuple[Fraction, ...]
    frame: tuple[tuple[Fraction, ...], ...] | None

    @property
    def natural(self) -> bool:
        """Return whether the frame was left to us, so that the constant rotation ℜ of (orth) is a sign matrix."""
        return self.frame is None

    @cached_property
    def tangent(self) -> tuple[Fraction, ...]:
        """Return q̇ − (q,q̇)/(q,q) q: exactly zero where q̇ is along q."""
        along = sum((a * b for a, b in zip(self.q, self.q_dot)), Fraction()) / sum((a * a for a in self.q), Fraction())
        return tuple(b - along * a for a, b in zip(self.q, self.q_dot))


def _principal_inertia(A: Any) -> tuple[tuple[Fraction, ...], Array | None]:
    """Return the diagonal of A as exact numbers, and the principal axes as columns when A was given as a matrix."""
    if not is_matrix(A):
        diagonal = exact_vector(A, ("A",))
        if len(diagonal) < 2:
            raise InvalidInput(("A",), "at least 2 numbers (n ≥ 2)", f"{len(diagonal)}")
        for i, value in enumerate(diagonal):
            if value <= 0 or float(value) == 0:
                raise InvalidInput(("A", i), "a finite number greater than 0", shown(A[i]))
        return diagonal, None
    n = len(A)
    if n < 2:
        raise InvalidInput(("A",), "at least 2 rows (n ≥ 2)", f"{n}")
    matrix = to_float(exact_matrix(A, ("A",), n))
    asymmetry = np.abs(matrix - matrix.T)
    if np.max(asymmetry) > INPUT_TOLERANCE * np.max(np.abs(matrix)):
        i, j = divmod(int(np.argmax(asymmetry)), n)
        raise InvalidInput(("A", i, j), "a symmetric matrix", f"{matrix[i, j]} against {matrix[j, i]} across the diagonal")
    values, axes = np.linalg.eigh((matrix + matrix.T) / 2)
    if values[0] <= n * np.finfo(float).eps * values[-1]:
        raise InvalidInput(("A",), "a positive definite matrix", f"one with eigenvalue {values[0]:.3g}")
    return tuple(map(Fraction, values.tolist())), axes


def _read_only(array: Array) -> Array:
    array.setflags(write=False)
    return array


def _unit(vector: Array) -> Array:
    scaled = vector / np.max(np.abs(vector))  # squares of very large or small entries would leave the float range
    return np.asarray(scaled / np.linalg.norm(scaled), dtype=np.float64)


def _rounded(tangent: tuple[Fraction, ...]) -> Array:
    try:
        return to_float(tangent)
    except OverflowError:
        given = f"{len(tangent)} entries beyond it"
        raise InvalidInput(("q_dot",), "a tangential part within the range of a float", given) from None


def _require_finite(velocity: Array, given: tuple[Fraction, ...]) -> None:
    if not np.all(np.isfinite(velocity)):
        largest = f"entries up to {float(max(abs(x) for x in given)):.3g}"
        raise InvalidInput(("q_dot",), "components along the principal axes within the range of a float", largest)


def _require_on_sphere(q: Array, q_dot: Array) -> None:
    length = float(np.linalg.norm(q))
    if abs(length - 1) > INPUT_TOLERANCE:
        raise InvalidInput(("q",), "a vector of unit length to 1e-9 (or normalize=True)", f"length {length!r}")
    largest = float(np.max(np.abs(q_dot)))
    if largest > 0:
        slope = float((q_dot / largest) @ q) / float(np.linalg.norm(q_dot / largest))
        if abs(slope) > INPUT_TOLERANCE:
            raise InvalidInput(
                ("q_dot",), "a vector orthogonal to q to 1e-9 of its length (or normalize=True)", f"cosine {slope:.3g} with q"
            )


def _require_representable_energy(A: Array, q: Array, q_dot: Array) -> None:
    energy = float(integrals.energy(A, q, q_dot))
    if not np.isfinite(energy) or (energy == 0 and np.any(q_dot)):
        raise InvalidInput(("q_dot",), "a kinetic energy within the range of a float", f"one of {energy}")


def _admissible_frame(frame: Array, q: Array) -> Array:
    """Return the given frame made exactly orthogonal with first column q; raises InvalidInput beyond the tolerance."""
    defect = float(np.max(np.abs(frame.T @ frame - np.eye(q.size))))
    if not defect <= INPUT_TOLERANCE:
        raise InvalidInput(("frame",), "an orthogonal matrix to 1e-9", f"one with |EᵀE − 1| up to {defect:.3g}")
    offset = float(np.max(np.abs(frame[:, 0] - q)))
    if offset > INPUT_TOLERANCE:
        raise InvalidInput(("frame",), "first column e_1 equal to q to 1e-9", f"a difference of {offset:.3g}")
    rest = frame[:, 1:] - np.outer(q, q @ frame[:, 1:])
    return orthonormalized(np.column_stack([q, rest]))
