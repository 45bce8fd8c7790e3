"""Frames at times, from the angles that a time map gives."""

from typing import Any

from .arithmetic import jit, number, positive, size, whole, zeros, zeros2
from .frame import set_frame
from .linear import eliminate
from .rate import rate

#: Calibrated: a component of q' along a normal whose sign rounding leaves no doubt of, against the
#: largest.
CERTAIN = 1e-9


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


@jit
def set_turn(torus: Any, given: Any, natural: Any, turn: Any, room: Any) -> Any:
    """Fill ℜ = [n_2 … γ]ᵀ[e_2 … e_n] at the start (g, g); ``given`` (n, n) along sorted axes, entries
    of a natural frame's ℜ rounded to 0 and ±1.
    """
    g = turn.shape[0]
    set_frame(torus, torus.psi, room, room.frame, room.velocity)
    for k in range(g):
        for c in range(g):
            total = 0 * room.q[0]
            for i in range(g + 1):
                total = total + room.frame[i, k + 1] * given[i, c + 1]
            turn[k, c] = number(whole(total)) if natural else total


@jit
def new_turn(torus: Any, given: Any, natural: Any, room: Any) -> Any:
    """Return ℜ (g, g)."""
    g = torus.z.size
    turn = zeros2(g, g)
    set_turn(torus, given, natural, turn, room)
    return turn


@jit
def set_natural_turn(torus: Any, order: Any, turn: Any, room: Any) -> Any:
    """Fill ℜ of the natural frame (g, g), in which (q', e_k) ≥ 0 for k > 2, and that of e_2 makes a
    right-handed frame along the axes as they were given; return whether all signs are certain.
    """
    g = turn.shape[0]
    set_frame(torus, torus.psi, room, room.frame, room.velocity)
    along, unused, largest, least = zeros2(g + 1, g + 1), zeros(g + 1), 0.0, 1e300
    for k in range(g):
        component = room.v[(k + 1) % g]  # that of c_1 = 0, γ, is the last normal
        largest, least = max(largest, size(component)), min(least, size(component))
        for c in range(g):
            turn[k, c] = number(0)
        turn[k, k] = -number(1) if positive(-component) else number(1)
    for i in range(g + 1):
        along[order[i], 0] = room.frame[i, 0]
        for c in range(g):
            along[order[i], c + 1] = room.frame[i, c + 1] * turn[c, c]
    if positive(-eliminate(along, unused)):
        turn[0, 0] = -turn[0, 0]
    return least > CERTAIN * largest
