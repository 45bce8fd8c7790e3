"""Waves of g phases of the Kadomtsev–Petviashvili equation, from the expansions of normalised
differentials at infinity.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from veselova import curves, theta


def vectors_at_infinity(curve: curves.RealHyperelliptic) -> list[Any]:
    """Return U, V, W: v_j = −(U_j + V_j ζ + W_j ζ² + …)dζ with ζ = 1/λ, on w² = +Π(λ−b)."""
    b = curve.branch_points
    root = [1.0, b.sum() / 2, b.sum() ** 2 / 8 + b @ b / 4]  # of 1/√Π(1−bζ)
    c = np.pad(curve.normalized_differentials[:, ::-1], ((0, 0), (0, 2)))
    return [sum(root[i] * c[:, n - i] for i in range(n + 1)) for n in range(3)]


@pytest.mark.parametrize(
    ("points", "size"),
    [
        ([-1, 1, 2, 3], 32),
        ([-2, -1.1, -0.3, 0.6, 1.2, 2], 36),
        (["0", "1", "1.7", "3", "4.5", "5"], 36),
        ([-3, -2.2, -1, -0.3, 0.6, 1.2, 2.1, 3], 32),
    ],
)
def test_a_wave_solves_the_kp_equation_on_the_whole_torus(points: list[Any], size: int) -> None:
    """(4u_t − 6uu_x − u_xxx)_x = 3u_yy for u = 2∂_x² log θ(Ux + Vy + Wt), but for a constant in u,
    which is one number for all points of the torus.
    """
    curve = curves.RealHyperelliptic(points, sign=1)
    g = curve.genus
    U, V, W = vectors_at_infinity(curve)
    grid = np.stack(np.meshgrid(*[np.arange(size) / size] * g, indexing="ij"), axis=-1)
    values, first, second = (
        theta.riemann_theta(grid.reshape(-1, g), curve.riemann_matrix, derivatives=k)
        for k in range(3)
    )
    u = 2 * (second @ U @ U / values - (first @ U / values) ** 2).real.reshape([size] * g)
    m = np.stack(np.meshgrid(*[np.fft.fftfreq(size, 1 / size)] * g, indexing="ij"), axis=-1)

    def derive(field: Any, *directions: Any) -> Any:
        factor = np.prod([2j * np.pi * (m @ v) for v in directions], axis=0)
        return np.fft.ifftn(factor * np.fft.fftn(field)).real

    over_y, fourth = derive(u, V, V), derive(u, U, U, U, U)
    left = 4 * derive(u, U, W) - 3 * derive(u * u, U, U) - fourth - 3 * over_y
    bend = derive(u, U, U)
    rest = left - np.vdot(bend, left) / np.vdot(bend, bend) * bend
    assert np.max(np.abs(rest)) < 1e-9 * np.max(np.abs(fourth))
    assert np.max(np.abs(3 * over_y)) > 0.05 * np.max(np.abs(fourth))
