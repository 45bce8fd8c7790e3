"""The reduced LR flow on T*V(r,n): an n-dimensional body under the constraints (4.1, printed 5.3),
seen through its first r vectors.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.bodies.stiefel_inertia import BodyInertia, body_inertia
from veselova.mechanics.core.arguments import entry_count, is_matrix
from veselova.mechanics.core.errors import Faults, InvalidInput, show
from veselova.mechanics.core.exact_input import Numbers, exact_matrix, require_moderate, to_float
from veselova.mechanics.core.flow import FLOATS, Flow
from veselova.mechanics.core.problem import Problem, Series
from veselova.mechanics.flows.cotangent_flow import CotangentFlow, MomentumFlow
from veselova.mechanics.geometry.sphere import INPUT_TOLERANCE
from veselova.mechanics.geometry.stiefel import (
    ad_invariants,
    angular_velocity,
    cotangent,
    momentum_map,
    nearest_orthonormal,
    product,
    tangent_part,
    trace_integrals,
)

__all__ = ["StiefelFlow"]

Array = NDArray[np.float64]


class StiefelFlow(Problem):
    """The reduced LR flow Ẋ = −ωX, Ṗ = −ωP on T*V(r,n), equation (dot_P, printed 5.22), for any
    inertia and every rank 1 ≤ r ≤ n.

    - inertia: {"special": [A_1 … A_n]} for 𝓘(E_i∧E_j) = (A_iA_j/det A) E_i∧E_j, or {"matrix":
      …}, symmetric and positive definite, on the coefficients of E_i∧E_j, i < j, in
      lexicographic order
    - X: (e_1 … e_r) at t = 0, (n, r), orthonormal columns
    - P: the momentum ∂L/∂Ẋ, equation (dotX->P), (n, r), with XᵀP + PᵀX = 0, (condX); or
    - X_dot: the velocity Ẋ, (n, r), with XᵀẊ + ẊᵀX = 0, equation (cond_X, printed 5.16)

    The constraints must hold to 1e-9; with ``normalize=True`` X becomes the nearest orthonormal
    matrix and P or X_dot is projected first. What is off by less is projected too. Raises
    InvalidInput, which names the field, what was required and what was given. Tested for n = 2…6
    and every rank.
    """

    X: Array
    P: Array
    inertia: BodyInertia

    system: ClassVar[str] = "stiefel"
    outputs: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "X": ("axis", "vector"),
        "P": ("axis", "vector"),
        "omega": ("axis", "axis_2"),
    }
    derived: ClassVar[tuple[str, ...]] = ("omega",)
    bounded: ClassVar[tuple[str, ...]] = ("X",)
    shown: ClassVar[tuple[str, ...]] = ("X", "P")
    portrait: ClassVar[str] = "X"
    formulations: ClassVar[tuple[str, ...]] = ("reduced", "momentum")
    vanishing = frozenset({"X_P"})

    def __init__(
        self,
        inertia: Numbers | Mapping[str, Any],
        X: Numbers,
        P: Numbers | None = None,
        *,
        X_dot: Numbers | None = None,
        normalize: bool = False,
    ) -> None:
        faults = Faults()
        if (P is None) == (X_dot is None):
            faults.add(("P",), "either P or X_dot", "neither" if P is None else "both")
        name, values = ("P", P) if X_dot is None else ("X_dot", X_dot)
        shape = faults.attempt(_shape, X)
        n = shape[0] if shape is not None else entry_count(values)
        operator = faults.attempt(body_inertia, inertia, n) if n >= 2 else None
        columns = given = tangent = None
        if shape is not None:
            columns = faults.attempt(_columns, X, shape, normalize)
            if values is not None:
                given = faults.attempt(exact_matrix, values, (name,), *shape)
        if columns is not None and given is not None:
            tangent = faults.attempt(_tangent, columns, to_float(given), name, normalize)
        faults.require_none()
        assert operator is not None
        assert tangent is not None
        require_moderate(tangent.ravel().tolist(), (name,))
        momentum = tangent if X_dot is None else _momentum(operator, columns, tangent)
        self._set(inertia=operator, X=columns, P=momentum)

    @property
    def n(self) -> int:
        """Return the dimension of the body."""
        return int(self.X.shape[0])

    @property
    def rank(self) -> int:
        """Return r, the number of vectors in whose planes the body may turn."""
        return int(self.X.shape[1])

    @cached_property
    def omega(self) -> Array:
        """Return the angular velocity ω(X,P) ∈ 𝓓_r at the start."""
        return self._angular_velocity(self.X, self.P)

    @property
    def size(self) -> str:
        """Return the dimension and the rank."""
        return f"n = {self.n}, r = {self.rank}"

    @property
    def moves(self) -> bool:
        """Return whether the body moves at all."""
        return bool(np.any(self.P))

    @property
    def turning(self) -> float:
        """Return the fastest rate at which ω turns a vector."""
        return float(np.linalg.norm(self.omega, 2))

    @property
    def start(self) -> Series:
        """Return the series at t = 0."""
        return {"X": self.X[None], "P": self.P[None]}

    def flow(self, formulation: str = "reduced") -> Flow:
        """Return the field (dot_P, printed 5.22), or for ``momentum`` (4.1c, printed 5.6) with
        (4.2a, printed 5.8), in units of this problem; the body must move.
        """
        kind = CotangentFlow if formulation == "reduced" else MomentumFlow
        return kind.of(self.inertia, self.X, self.omega)

    def derive(self, name: str, series: Series) -> Array:
        """Return ω(X,P)."""
        return self._angular_velocity(series["X"], series["P"])

    def _angular_velocity(self, X: Array, P: Array) -> Array:
        largest = float(np.max(np.abs(P))) or 1.0
        omega = self.inertia.angular_velocity(X, P / largest, self.inertia.parameters, FLOATS)
        return np.asarray(np.ldexp(omega * largest, -self.inertia.exponent), dtype=np.float64)

    def integrals(self, series: Series) -> dict[str, Array]:
        """Return the integrals of motion along the series, by name.

        ``energy`` ½⟨𝓘ω,ω⟩; ``X_X`` XᵀX; ``X_P`` XᵀP/|P|, which is skew; ``P_P`` PᵀP; ``traces`` the
        coefficients of tr(𝓜+λΓ)^k, k ≤ n, see ``trace_integrals``; ``invariants`` the singular
        values of 𝓜, its Ad-invariants.
        """
        X = series["X"]
        P = series["P"]
        momentum = momentum_map(X, P)
        transposed = np.swapaxes(X, -1, -2)
        size = np.linalg.norm(P, axis=(1, 2))[:, None, None]
        return {
            "energy": product(momentum, self.derive("omega", series)) / 2,
            "X_X": transposed @ X,
            "X_P": np.divide(
                transposed @ P, size, out=np.zeros((len(X), self.rank, self.rank)), where=size > 0
            ),
            "P_P": np.swapaxes(P, -1, -2) @ P,
            "traces": trace_integrals(X, momentum),
            "invariants": ad_invariants(momentum),
        }


def _columns(given: Any, shape: tuple[int, int], normalize: bool) -> Array:
    """Return the columns of X made exactly orthonormal; raises InvalidInput where they are not, or
    not independent.
    """
    X = to_float(exact_matrix(given, ("X",), *shape))
    largest = float(np.max(np.abs(X))) or 1.0
    if normalize:
        values = np.linalg.svd(X / largest, compute_uv=False)
        if values[-1] <= X.shape[0] * np.finfo(float).eps * values[0]:
            least = f"a smallest singular value of {values[-1] * largest:.3g}"
            raise InvalidInput(("X",), "linearly independent columns", least)
        return nearest_orthonormal(X / largest)
    with np.errstate(over="ignore", invalid="ignore"):
        defect = float(np.max(np.abs(X.T @ X - np.eye(X.shape[1]))))
    if not defect <= INPUT_TOLERANCE:
        required = "orthonormal columns to 1e-9 (or normalize=True)"
        raise InvalidInput(("X",), required, f"|XᵀX − 1| up to {defect:.3g}")
    return nearest_orthonormal(X)


def _tangent(X: Array, values: Array, name: str, normalize: bool) -> Array:
    """Return the part of values that meets (cond_X, printed 5.16), (condX, printed 5.20); raises
    InvalidInput where it is not all.
    """
    largest = float(np.max(np.abs(values))) or 1.0
    scaled = values / largest
    along = X.T @ scaled
    defect = float(np.max(np.abs(along + along.T)))
    if not normalize and defect > INPUT_TOLERANCE:
        required = f"Xᵀ{name} skew to 1e-9 of its size (or normalize=True)"
        raise InvalidInput((name,), required, f"a symmetric part up to {defect / 2 * largest:.3g}")
    return tangent_part(X, scaled) * largest


def _momentum(inertia: BodyInertia, X: Array, X_dot: Array) -> Array:
    """Return P = ∂L/∂Ẋ, equation (dotX->P, printed 5.19)."""
    largest = float(np.max(np.abs(X_dot))) or 1.0
    P = cotangent(X, inertia.apply(angular_velocity(X, X_dot / largest)))
    return np.asarray(np.ldexp(P * largest, inertia.exponent), dtype=np.float64)


def _shape(X: Any) -> tuple[int, int]:
    """Return n and r of the rows of X; raises InvalidInput unless 1 ≤ r ≤ n, n ≥ 2."""
    if not is_matrix(X) or len(X) < 2:
        raise InvalidInput(("X",), "a list of n ≥ 2 rows of r numbers", show(X))
    n = len(X)
    r = len(X[0])
    if not 1 <= r <= n:
        raise InvalidInput(("X", 0), f"from 1 to {n} numbers (1 ≤ r ≤ n)", f"{r}")
    return n, r
