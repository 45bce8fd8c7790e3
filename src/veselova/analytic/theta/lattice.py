"""The lattice of a theta sum: its points in an ellipsoid, and the coordinates in which the sum is
short.
"""

from __future__ import annotations

import math

import flint
import numpy as np
from numpy.typing import NDArray

from veselova.analytic.theta.siegel_reduction import reduce_form
from veselova.mechanics.core.enclosures import precision
from veselova.mechanics.core.errors import Unsolved

__all__ = [
    "RADIUS",
    "largest_corner",
    "lattice_points",
    "points_near_cell",
    "points_within",
    "short_sum",
]

Array = NDArray[np.float64]
#: Radius, in the norm of T or T⁻¹, of the terms above e^(−39) = 1e-17 of the largest; the others
#: are left out.
RADIUS = math.sqrt(39.0 / math.pi)

#: Derived: least eigenvalue of S for waves: there θ(z)/θ(0) stays above
#: ((1−2e^(−π/2))/(1+2e^(−π/2)))^|F| = 0.42^|F|.
_WAVE_FLOOR = 0.5

#: Derived: bits in which a basis of doubles is reduced.
_BASIS_BITS = 128


def short_sum(T: Array) -> tuple[NDArray[np.int64], list[int]]:
    """Return a basis U ∈ GL(g, Z), as rows, and the coordinates F in which the sum of the real T
    has waves and not Gaussians: those in which it is short and does not cancel.

    With m = Uᵀm', θ[ε;δ](z; T) = θ[U⁻ᵀε; Uδ](Uz; UTUᵀ). Poisson summation over the other
    coordinates, G, turns their waves into Gaussians,

        θ[ε;δ](z) = det T_GG^{−1/2} Σ_{x∈Z^F+ε_F} Σ_{k∈Z^G} e^{−π xᵀSx − π dᵀT_GG⁻¹d}
            cos 2π[x·(z_F+δ_F + Cd) + k·ε_G],   d = k−z_G−δ_G,  C = T_FG T_GG⁻¹,  S = T_FF − C T_GF,

    which does not cancel where S is not small. Near a separatrix T has a nearly null vector; in a
    reduced basis it is a coordinate of its own, which one Gaussian serves.
    """
    g = len(T)
    with precision(_BASIS_BITS):
        basis = reduce_form(np.array(list(map(flint.arb, T.flat))).reshape(T.shape))
    if basis is None:
        raise Unsolved("beyond-floats", "the Riemann matrix is not positive definite in doubles")
    U = np.array(basis.tolist(), dtype=np.int64)
    U = U[np.argsort(np.diagonal(U @ T @ U.T), kind="stable")]
    lower = np.linalg.cholesky(U @ T @ U.T)
    lengths = np.diagonal(lower)

    def cost(gaussians: int) -> float:
        rest = lower[gaussians:, gaussians:]
        if len(rest) and np.linalg.eigvalsh(rest @ rest.T)[0] < _WAVE_FLOOR:
            return math.inf
        axes = RADIUS * np.concatenate([lengths[:gaussians], 1 / lengths[gaussians:]])
        return float(np.prod(1 + 2 * axes))

    return U, list(range(min(range(g + 1), key=cost), g))


def points_within(form: Array, radius: float) -> float:
    """Return about how many points of Z^d lie in a ball of this radius in the norm of the form: its
    volume, in cells, or one.
    """
    axes = radius / np.diag(np.linalg.cholesky(form))
    half = len(axes) / 2
    unit_ball = math.exp(half * math.log(math.pi) - math.lgamma(half + 1))
    return max(1.0, unit_ball * float(np.prod(axes)))


def largest_corner(form: Array) -> float:
    """Return max rᵀ form r over the cell |r_i| ≤ ½, a convex function: the maximum over its
    corners.
    """
    size = len(form)
    corners = (np.arange(2**size)[:, None] >> np.arange(size) & 1) - 0.5
    return float(((corners @ form) * corners).sum(axis=1).max())


def points_near_cell(form: Array, radius: float) -> Array:
    """Return the k ∈ Z^d that matter to some r of the cell |r_i| ≤ ½: |k−r|² ≤ radius² + min_k
    |k−r|² in the norm of the form.

    Zero is no nearer than the nearest, so |k|² − 2k·r ≤ radius², whose least value over the cell is
    |k|² − Σ|(form k)_i|.
    """
    corner = largest_corner(form)
    k = lattice_points(
        form, math.sqrt(radius * radius + corner) + math.sqrt(corner), np.zeros(form.shape[0])
    )
    projected = k @ form
    return np.asarray(k[(projected * k - np.abs(projected)).sum(axis=1) <= radius * radius])


def lattice_points(form: Array, radius: float, shift: Array) -> Array:
    """Return the points x ∈ Z^d + shift with xᵀ form x ≤ radius², shape (K, d), by descent through
    the Cholesky factor.
    """
    dimension = form.shape[0]
    if dimension == 0:
        return np.zeros((1, 0))
    upper = np.linalg.cholesky(form).T
    points = np.zeros((1, 0))
    left = np.array([radius * radius])
    for i, offset in zip(range(dimension - 1, -1, -1), shift[::-1].tolist(), strict=True):
        length = float(upper[i, i])
        # of the whole numbers x_i − shift_i
        centre = points @ (upper[i, i + 1 :] / -length) - offset
        reach = np.sqrt(left) / length
        first = np.ceil(centre - reach)
        counts = (np.floor(centre + reach) - first).astype(np.int64) + 1
        parent = np.repeat(np.arange(len(points)), counts)
        ends = np.cumsum(counts)
        whole = (first - (ends - counts))[parent] + np.arange(len(parent))
        left = np.maximum(left[parent] - (length * (whole - centre[parent])) ** 2, 0.0)
        points = np.concatenate([whole[:, None] + offset, points[parent]], axis=1)
    return points
