"""What a document of a motion asks for beside its torus: the attitude at half periods, and how
steep the frame is anywhere.
"""

from typing import Any

import numpy as np

from .abel import abel
from .arithmetic import jit, pi
from .error import set_sensitivity
from .frame import set_frame
from .rate import even_rate


@jit
def set_half_periods(torus: Any, room: Any, halves: Any, entries: Any, rates: Any) -> Any:
    """Fill the ν ∈ {0, 1}^g, (2^g, g), and at the angles πν, the half periods z = ν/2, where every
    λ_s is a branch point, q, v_k = (q', n_k) and (n_k)_i with i before k, (2^g, n + g + ng), k over
    c_2 … c_g, c_1; and d(time)/dτ₁ but for its odd part, (2^g,).
    """
    g = torus.z.size
    n, psi = g + 1, np.zeros(g)
    for h in range(halves.shape[0]):
        for k in range(g):
            halves[h, k] = (h >> k) & 1
            psi[k] = pi * halves[h, k]
        set_frame(torus, psi, room, room.frame, room.velocity)
        rates[h] = even_rate(torus, psi)
        for i in range(n):
            entries[h, i] = room.frame[i, 0]
            for k in range(g):
                entries[h, n + g + i * g + k] = room.frame[i, k + 1]
        for k in range(g):
            entries[h, n + k] = room.v[(k + 1) % g]


@jit
def set_phases(torus: Any, psi: Any, room: Any, z: Any) -> Any:
    """Fill the phases (N, g) at ψ (N, g)."""
    for i in range(psi.shape[0]):
        abel(torus.angles, psi[i], z[i], room.slopes)


@jit
def set_sensitivities(torus: Any, psi: Any, room: Any, found: Any) -> Any:
    """Fill the sensitivities of the frame and of X at ψ (N, g), (N, 2, 5) doubles."""
    n = torus.z.size + 1
    nearby, at, moved = np.zeros(n - 1), np.zeros((n, n + 1)), np.zeros((n, n + 1))
    for i in range(psi.shape[0]):
        set_sensitivity(torus, psi[i], room, nearby, at, moved, found[i])
