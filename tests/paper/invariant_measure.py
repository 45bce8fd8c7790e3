"""Densities of the invariant measures of LR systems (section 3 and (IM3, printed 5.10) ff.), and
the divergence by which they are checked.

Every density is real-analytic in its arguments and takes complex ones, so that ``divergence`` can
use complex steps.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.bodies.inertia_operator import Inertia, apply_operator
from veselova.mechanics.flows.lr_flow import multipliers_of
from veselova.mechanics.groups.distribution import Distribution
from veselova.mechanics.groups.matrix_group import MatrixGroup

__all__ = [
    "constraint_field",
    "density",
    "divergence",
    "duality_defect",
    "frame_field",
    "momentum_density",
    "momentum_field",
    "plucker_coordinates",
    "plucker_form",
    "restricted_determinant",
    "rho",
    "solve",
    "special_density",
    "special_determinant",
]

Array = NDArray[np.float64]

#: Complex steps have no cancellation; the square of this underflows against any double.
_STEP = 1e-30


def restricted_determinant(operator: Any, rows: Any) -> Any:
    """Return det⟨X_i, operator X_j⟩ for coordinate rows X_i (…, k, D); 1 for no rows."""
    return np.linalg.det(operator(rows) @ np.swapaxes(rows, -1, -2))


def solve(inertia: Inertia) -> Callable[[Any], Any]:
    """Return 𝓘⁻¹ on coordinate rows."""
    return partial(apply_operator, inertia.inverse)


def density(inertia: Inertia, F: Any) -> Any:
    """Return μ = √det⟨ℱ_s, 𝓘⁻¹ℱ_l⟩, equation (measure1, printed 3.1), for the rows ℱ_s (…, m, D):
    (EPS1, printed 2.5) keeps μ dω∧dℱ_1∧…∧dℱ_m.
    """
    return np.sqrt(restricted_determinant(solve(inertia), F))


def momentum_density(inertia: Inertia, W: Any) -> Any:
    """Return μ̃ = √det⟨𝒲_i, 𝓘𝒲_j⟩, equation (tilded_den, printed 3.3), for the rows 𝒲_k (…, d, D).

    (mom_eq1, printed 2.9) keeps μ̃ dω∧d𝒲_1∧…∧d𝒲_d = μ̃⁻¹ d𝓜∧d𝒲_1∧…∧d𝒲_d, equation (measure2,
    printed 3.2); on SO(n), 𝒲 = e_i∧e_p, it is (IM3, printed 5.10).
    """
    return np.sqrt(restricted_determinant(inertia, W))


def duality_defect(distribution: Distribution, inertia: Inertia, g: Array) -> Array:
    """Return μ² det 𝓘/μ̃² − 1, zero by (duality, printed 3.4), at group elements (…, N, N)."""
    W, F = distribution.in_body(g)
    total = np.prod(inertia.moments)
    return np.asarray(
        restricted_determinant(solve(inertia), F) * total / restricted_determinant(inertia, W) - 1
    )


def plucker_coordinates(X: Any) -> Any:
    """Return the minors (e_1∧…∧e_r)_I of the columns of X (n, r), I in lexicographic order."""
    n, r = X.shape
    return np.array([np.linalg.det(X[list(rows)]) for rows in combinations(range(n), r)])


def plucker_form(A: Array, X: Any) -> Any:
    """Return Σ_I A_{i_1}…A_{i_r} (e_1∧…∧e_r)_I² for the columns e_i of X (n, r): it is det XᵀAX."""
    weights = np.array([np.prod(A[list(rows)]) for rows in combinations(range(A.size), X.shape[1])])
    return np.sum(weights * plucker_coordinates(X) ** 2)


def rho(n: int, r: int) -> int:
    """Return the integer ϱ of Theorem IM_A, which the paper leaves open: r(r+3)/2 − rn.

    Both sides of (det_sp, printed 5.12) are homogeneous in A: (2−n)(rn − r(r+1)/2) = nϱ + r(n−r−1).
    """
    return r * (r + 3) // 2 - r * n


def special_determinant(A: Array, X: Any) -> Any:
    """Return det(𝓘|_{𝒟_r}) = (det A)^ϱ [Σ_I A_I (e_1∧…∧e_r)_I²]^{n−r−1}, equation (det_sp, printed
    5.12), for the inertia (4.5, printed 5.11).
    """
    n, r = X.shape
    return np.prod(A) ** float(rho(n, r)) * plucker_form(A, X) ** (n - r - 1)


def special_density(A: Array, X: Any) -> Any:
    """Return [Σ_I A_I (e_1∧…∧e_r)_I²]^{−(n−r−1)/2}, the density of d𝓜∧de_1∧…∧de_r in (true)."""
    n, r = X.shape
    return plucker_form(A, X) ** (-(n - r - 1) / 2)


def divergence(measure: Callable[[Any], Any], field: Callable[[Any], Any], point: Array) -> float:
    """Return div(measure · field)/Σ|∂_i(measure · field)_i| at a point, zero where the field keeps
    the measure.

    The derivatives are complex steps, exact to rounding: what is left is about 1e-16 times the
    number of coordinates.
    """
    slopes = np.empty(point.size)
    for i in range(point.size):
        shifted = point.astype(complex)
        shifted[i] += 1j * _STEP * max(1.0, abs(point[i]))
        slopes[i] = (measure(shifted) * field(shifted)[i]).imag / (_STEP * max(1.0, abs(point[i])))
    size = np.sum(np.abs(slopes))
    return float(np.sum(slopes) / size) if size > 0 else 0.0


def constraint_field(group: MatrixGroup, inertia: Inertia, state: Any) -> Any:
    """Return the field (EPS1, printed 2.5) at rows (ω, ℱ_1 … ℱ_m), flat or (1+m, D): ω̇ =
    𝓘⁻¹([𝓘ω,ω] + Σ λ_sℱ_s), ℱ̇_s = [ℱ_s,ω].
    """
    rows = state.reshape(-1, group.dimension)
    omega = rows[0]
    F = rows[1:]
    force = group.bracket(inertia(omega), omega)
    multipliers, rotated = multipliers_of(inertia.inverse, F, force)
    omega_dot = solve(inertia)(force) + multipliers @ rotated
    return np.vstack([omega_dot, group.bracket(F, np.broadcast_to(omega, F.shape))]).reshape(
        state.shape
    )


def _velocity(inertia: Inertia, M: Any, W: Any) -> Any:
    """Return the ω with 𝓜 = ω + Σ ⟨𝓘ω − ω, 𝒲_k⟩ 𝒲_k."""
    return np.linalg.solve(np.eye(M.size) + W.T @ (inertia(W) - W), M)


def momentum_field(group: MatrixGroup, inertia: Inertia, state: Any) -> Any:
    """Return the field (mom_eq1, printed 2.9) at rows (𝓜, 𝒲_1 … 𝒲_d), flat or (1+d, D): 𝓜̇ = [𝓜,ω],
    𝒲̇_k = [𝒲_k,ω].
    """
    rows = state.reshape(-1, group.dimension)
    omega = _velocity(inertia, rows[0], rows[1:])
    return group.bracket(rows, np.broadcast_to(omega, rows.shape)).reshape(state.shape)


def frame_field(group: MatrixGroup, inertia: Inertia, state: Any) -> Any:
    """Return the field (4.1c, printed 5.6), (4.2, printed 5.7), (Po, printed 5.1) on SO(n) at a
    flat (𝓜, e_1 … e_r): 𝓜̇ = [𝓜,ω], ė_i = −ωe_i.
    """
    D = group.dimension
    # rows e_i
    M = state[:D]
    rows = state[D:].reshape(-1, group.size)
    Gamma = rows.T @ rows
    excess = group.element(inertia.matrix - np.eye(D))  # (𝓘 − 1)Y_a
    along = group.coordinates(excess @ Gamma + Gamma @ excess - Gamma @ excess @ Gamma)
    omega = np.linalg.solve(np.eye(D) + along.T, M)
    # (−ωe)ᵀ = eᵀω
    return np.concatenate([group.bracket(M, omega), (rows @ group.element(omega)).ravel()])
