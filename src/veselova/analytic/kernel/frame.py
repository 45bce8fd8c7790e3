"""The attitude from the angles (equations (S_n) and (wurzel)), along sorted axes.

With the unit eigenvectors m_s of A⁻¹ on q⊥ (eigenvalue λ_s) and signed roots

    q_i = ς_i √|U(I_i)/Ψ'(I_i)|,   (m_s)_i = q_i y_s/(λ_s−I_i),
    v_k = (q', n_k) = √|U(c_k)/ψ'(c_k)|,   (n_k, m_s) = x_s v_k/(λ_s−c_k),
    n_k = Σ_s (n_k, m_s) m_s

every entry is a product of √|λ_s−b| over √|b−b'| and √|λ_s−λ_t|: b of one kind, I or c. The root
of a cut's own end comes along sn or cn with its sign, so entries are analytic where a coordinate
turns.
"""

from typing import Any

from .arithmetic import jit, sqrt
from .elliptic import roots
from .rate import rate


@jit
def set_norms(d: Any, places: Any, norms: Any) -> Any:
    """Fill Π_{o≠i} |b_i−b_o|^{−1/2} over the branch points of one kind, at ``places``."""
    for k in range(places.size):
        i = places[k]
        norm = 1.0
        for o in places:
            if o != i:
                norm = norm / sqrt(d[min(i, o), max(i, o)])
        norms[k] = norm


@jit
def set_roots(d: Any, cuts: Any, psi: Any, roots_to: Any, between: Any) -> Any:
    """Fill √|λ_s−b_i| (g, 2g+1), signed at the ends of the own cut, and √|λ_s−λ_t| (g, g)."""
    g = psi.size
    for s in range(g):
        j = 2 * s + 1
        low, high = roots(psi[s], cuts[s])
        below, above = low * low, high * high
        roots_to[s, j], roots_to[s, j + 1] = low, high
        for i in range(2 * g + 1):
            if i < j:
                roots_to[s, i] = sqrt(d[i, j] + below)
            elif i > j + 1:
                roots_to[s, i] = sqrt(d[j + 1, i] + above)
    for s in range(g):
        above = roots_to[s, 2 * s + 2] * roots_to[s, 2 * s + 2]
        for t in range(s + 1, g):
            below = roots_to[t, 2 * t + 1] * roots_to[t, 2 * t + 1]
            between[s, t] = sqrt(above + d[2 * s + 2, 2 * t + 1] + below)
            between[t, s] = between[s, t]


@jit
def set_orthogonal(
    places: Any, norms: Any, roots_to: Any, between: Any, lines: Any, column: Any
) -> Any:
    """Fill ``lines`` (g, m), (m_s)_i or (n_k, m_s), and ``column`` (m,), q_i or v_k, of one kind
    of b.

    ``norms`` carry the signs ς_i.
    """
    g = between.shape[0]
    for k in range(places.size):
        i = places[k]
        value = norms[k]
        for s in range(g):
            entry = norms[k]
            for t in range(g):
                if t != s:
                    entry = entry * (roots_to[t, i] / between[s, t])
            for o in places:
                if o != i:
                    entry = entry * roots_to[s, o]
            lines[s, k] = entry if i <= 2 * s + 1 else -entry
            value = value * roots_to[s, i]
        column[k] = value


@jit
def set_frame(torus: Any, psi: Any, room: Any, frame: Any, velocity: Any) -> Any:
    """Fill [q n_2 … n_{n−1} γ] (n, n) and q' (n,) at ψ."""
    g = psi.size
    set_roots(torus.d, torus.cuts, psi, room.roots, room.between)
    set_orthogonal(torus.of_I, torus.norms_I, room.roots, room.between, room.lines, room.q)
    set_orthogonal(torus.of_c, torus.norms_c, room.roots, room.between, room.rows, room.v)
    for i in range(g + 1):
        frame[i, 0] = room.q[i]
        total_velocity = 0.0
        for k in range(g):  # n_2 … n_{n−1} and then γ, which belongs to c_1 = 0
            column = (k + 1) % g
            total = 0.0
            for s in range(g):
                total = total + room.lines[s, i] * room.rows[s, column]
            frame[i, k + 1] = total
            total_velocity = total_velocity + total * room.v[column]
        velocity[i] = total_velocity


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
