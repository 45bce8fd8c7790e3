"""The invariant torus of a motion: its curve, periods, frequencies and the phases of the start."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Torus"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Torus:
    """The torus of one motion. g = n−1, less one for every direction that does not move.

    - energy: h, that of Neumann's motion for that system, ½ for a geodesic; None where it leaves
      the range of a float
    - constants: c_2 ≤ … ≤ c_{n−1}, with c_1 first for Neumann's system
    - branch_points: (2g+1,) b_0 < … < b_{2g}, with b_0 = c_1 = 0 but for Neumann's system
    - origins: (2g+1,) which of them is an I_i (``I3``: that of the third body axis) and which a
      c_k (``c1`` is 0)
    - periods: (g, g) a_{ks} = (−1)^{g−s} ∮ λ^{k−1}dλ/(2√|R|) over cut s, which scale like
      A^{g+½−k}; None where one of them leaves the range of a float
    - riemann_matrix: (g, g) T; the Riemann matrix is iT
    - riemann_matrix_residual: max |T − Tᵀ|/max |T| before symmetrisation
    - actions: (g,) J_s = (1/2π)∮ p_s dλ_s of the Neumann motion, p_s = ½√|λ Π(λ−c_k)/Π(λ−I_i)|
    - frequencies_tau1: (g,) cycles per unit of τ₁
    - frequencies_t: (g,) cycles per unit of the problem's own time (t, s or τ₁)
    - rotation_numbers: (g,) Ω_s/Ω_1
    - phases: (g,) z⁰ in [0, 1)
    - mean_rate: mean of d(time)/dτ₁
    - signs: (n,) of the q_i at the start (of q̇_i where q_i = 0). With energy, constants and
      phases they determine the start
    - regime: ``generic``, ``closed-cut`` (directions that do not move, or equal A's) or
      ``separatrix`` (some c_k = I_i: periods are infinite there, and the torus is that of a
      start 1e-40 away)
    """

    n: int
    energy: float | None
    constants: Array
    branch_points: Array
    origins: tuple[str, ...]
    periods: Array | None
    actions: Array
    rotation_numbers: Array
    signs: NDArray[np.int64]
    riemann_matrix: Array
    riemann_matrix_residual: float
    frequencies_tau1: Array
    frequencies_t: Array
    phases: Array
    mean_rate: float
    regime: str

    def as_dict(self) -> dict[str, Any]:
        """Return the torus as a JSON-ready dictionary (arrays as nested lists)."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return {
            name: np.asarray(v).tolist() if isinstance(v, (np.ndarray, tuple)) else v
            for name, v in values.items()
        }

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><th style='text-align:left'>{k}</th><td><pre>{v}</pre></td></tr>"
            for k, v in self.as_dict().items()
        )
        return f"<table>{rows}</table>"
