"""Frames at times, from the angles that a time map gives."""

from typing import Any

from .arithmetic import jit
from .frame import set_frame
from .rate import rate


@jit
def set_frames(
    torus: Any, psi: Any, order: Any, turn: Any, frames: Any, velocities: Any, room: Any
) -> Any:
    """Fill the frames (T, n, n) and velocities in the problem's time (T, n) at ψ (T, g).

    - order: (n,) which axis is the k-th largest A
    - turn: (g, g) ℜ, (e_2 … e_n) = (n_2 … γ) ℜ
    """
    g = turn.shape[0]
    for t in range(psi.shape[0]):
        set_frame(torus, psi[t], room, room.frame, room.velocity)
        slowness = rate(torus, psi[t])
        for i in range(g + 1):
            frames[t, order[i], 0] = room.frame[i, 0]
            velocities[t, order[i]] = room.velocity[i] / slowness
            for c in range(g):
                total = 0 * room.q[0]
                for k in range(g):
                    total = total + room.frame[i, k + 1] * turn[k, c]
                frames[t, order[i], c + 1] = total
