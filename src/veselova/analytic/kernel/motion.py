"""Frames at times and at nodes, from the angles that a time map gives."""

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
        slowness = rate(torus, psi[t], room.frame)
        for i in range(g + 1):
            frames[t, order[i], 0] = room.frame[i, 0]
            velocities[t, order[i]] = room.velocity[i] / slowness
            for c in range(g):
                total = 0.0
                for k in range(g):
                    total = total + room.frame[i, k + 1] * turn[k, c]
                frames[t, order[i], c + 1] = total


@jit
def set_entries(
    slowness: Any,
    directions: Any,
    turn: Any,
    rest: Any,
    room: Any,
    values: Any,
    j: Any,
) -> Any:
    """Fill column j of values (n + n², N) with a velocity in the problem's time and a frame, from
    those of ``room``.

    - slowness: d(time)/dτ₁ there
    - directions: (n, m) what moves; turn: (m−1, n−1) ℜ, (e_2 … e_n) = (n_2 … γ) ℜ along it
    - rest: (n, n−1) what stays of e_2 … e_n
    """
    n, m = directions.shape
    for i in range(n):
        velocity, q = 0.0, 0.0
        for k in range(m):
            velocity = velocity + directions[i, k] * room.velocity[k]
            q = q + directions[i, k] * room.frame[k, 0]
        values[i, j], values[n + n * i, j] = velocity / slowness, q
        for c in range(n - 1):
            values[n + n * i + c + 1, j] = rest[i, c]
        for k in range(m - 1):
            along = 0.0
            for o in range(m):
                along = along + directions[i, o] * room.frame[o, k + 1]
            for c in range(n - 1):
                entry = n + n * i + c + 1
                values[entry, j] = values[entry, j] + along * turn[k, c]
