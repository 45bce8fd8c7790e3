"""The attitude from the angles (equations (S_n) and (wurzel)), along sorted axes, and its error.

With the unit eigenvectors m_s of A⁻¹ on q⊥ (eigenvalue λ_s) and signed roots

    q_i = ς_i √|U(I_i)/Ψ'(I_i)|,   (m_s)_i = q_i y_s/(λ_s−I_i),
    v_k = (q', n_k) = √|U(c_k)/ψ'(c_k)|,   (n_k, m_s) = x_s v_k/(λ_s−c_k),
    n_k = Σ_s (n_k, m_s) m_s

every entry is a product of √|λ_s−b| over √|b−b'| and √|λ_s−λ_t|: b of one kind, I or c. The root
of a cut's own end comes along sn or cn with its sign, so entries are analytic where a coordinate
turns.

The error of a state is estimated: roundings of the phases and of the time, times the sensitivity
of the frame E to them, and what the series leave out.

    ε [ EVALUATION n + PHASE √Σ_k(κ_k∂E/∂z_k)² + FLOW Σ_k κ_k|f_kτ₁ ∂E/∂z_k| + TIME |t| |dE/dt| ]
      + LEFT_OUT (tails of the angle series) Σ_k|∂E/∂z_k| + MAP (error of the time map) |dE/dt|

κ_k says how much cancels in z_k. FLOW and TIME fall away where f and F_0 have guard digits. The
point X = Aq/√(q,Aq) of a geodesic has the same with its own sensitivities, in longest semiaxes.
Integrals along the orbit of functions of order one are off by that of τ₁, and by those of the
phases over the τ₁ that panels go.
"""

from typing import Any

import numpy as np

from .abel import abel
from .arithmetic import EPSILON, assign, jit, jit_making, largest, solve, sqrt
from .elliptic import roots
from .rate import ARC, rate
from .series import tail

#: Derived: the step of a difference quotient, the root of EPSILON.
STEP = 2.0**-24

#: Budget: times at which sensitivities are looked at.
MOST_LOCAL = 24

#: Calibrated: by how much a sensitivity may be larger between these times.
BETWEEN = 1.5

#: Calibrated: 520 random starts, n = 2…6, A-ratios to 10⁴, |t| to 10³, against 20 digits: with all
#: of them one the largest true over estimated error is 3.8, with these 0.71.
EVALUATION, PHASE, FLOW, TIME, LEFT_OUT, MAP = 8.0, 8.0, 4.0, 6.0, 8.0, 6.0

#: Derived: the part of the extent from which second orders of an error count.
LARGEST_ERROR = 1e-6

#: What is kept: √Σ_k(κ_k∂E/∂z_k)², Σ_k κ_k|f_k ∂E/∂z_k|, Σ_k|∂E/∂z_k|, |dE/dt|, |dτ₁/dt|.
TOGETHER, BY_FLOW, ADDED, BY_TIME, PACE = 0, 1, 2, 3, 4


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


@jit
def set_frame_and_point(torus: Any, psi: Any, room: Any, entries: Any) -> Any:
    """Fill the frame at ψ, and beside it X of a geodesic in longest semiaxes, (n, n+1)."""
    set_frame(torus, psi, room, room.frame, room.velocity)
    n = psi.size + 1
    for i in range(n):
        assign(room.frame[i], entries[i])
    if torus.time[0] == ARC:
        smallest = torus.points[torus.of_I[0]]
        total = 0.0
        for i in range(n):
            total = total + room.frame[i, 0] * room.frame[i, 0] / torus.points[torus.of_I[i]]
        for i in range(n):
            I = torus.points[torus.of_I[i]]
            entries[i, n] = room.frame[i, 0] / I * np.sqrt(abs(smallest / total))


@jit_making
def sensitivity_room(g: Any) -> Any:
    """Return room for ``set_sensitivity``."""
    n = g + 1
    return np.zeros(g), np.zeros((n, n + 1)), np.zeros((n, n + 1)), np.zeros((2, n, 3))


@jit
def set_sensitivity(torus: Any, psi: Any, room: Any, of_error: Any, found: Any) -> Any:
    """Fill found (2, 5) of the frame and of X, doubles, the largest row each, by differences at ψ.

    of_error: ``sensitivity_room``
    """
    g, n = psi.size, psi.size + 1
    nearby, at, moved, sums = of_error
    set_frame_and_point(torus, psi, room, at)
    found[:], sums[:] = 0.0, 0.0
    slowness = abs(rate(torus, psi, room.frame))
    found[:, PACE] = 1 / slowness
    for k in range(g + 1):  # each phase, and along the flow
        abel(torus.angles, psi, room.z, room.slopes)
        for j in range(g):
            room.target[j] = torus.frequencies[j] if k == g else 1.0 * (j == k)
        solve(room.slopes, room.target, room.step)
        step = STEP / max(1.0, largest(room.step))
        for j in range(g):
            nearby[j] = psi[j] + room.step[j] * step
        set_frame_and_point(torus, nearby, room, moved)
        for i in range(n):
            along_q, along_normals = abs(moved[i, 0] - at[i, 0]), 0.0
            for c in range(1, n):
                along_normals += abs(moved[i, c] - at[i, c]) ** 2
            for part in range(2):
                slope = max(along_q, np.sqrt(along_normals)) / step
                if part == 1:
                    slope = abs(moved[i, n] - at[i, n]) / step
                if k == g:
                    found[part, BY_TIME] = max(found[part, BY_TIME], slope / slowness)
                else:
                    off = torus.cancellation[k] * slope
                    sums[part, i, 0] += off * off
                    sums[part, i, 1] += off * abs(torus.frequencies[k])
                    sums[part, i, 2] += slope
    for part in range(2):
        for i in range(n):
            found[part, TOGETHER] = max(found[part, TOGETHER], np.sqrt(sums[part, i, 0]))
            found[part, BY_FLOW] = max(found[part, BY_FLOW], sums[part, i, 1])
            found[part, ADDED] = max(found[part, ADDED], sums[part, i, 2])


@jit
def series_tail(torus: Any) -> Any:
    """Return what the angle series leave out of a phase."""
    g = torus.z.size
    worst = 0.0
    for k in range(g):
        total = 0.0
        for s in range(g):
            total += tail(torus.angles.sines[k, s], torus.angles.counts[s])
        worst = max(worst, total)
    return worst


@jit_making
def set_errors(
    torus: Any, times: Any, tau: Any, psi: Any, off: Any, exact: Any, room: Any, errors: Any
) -> Any:
    """Fill the errors of the frame, of X, of τ₁, and those that phases make in functions (4, T).

    off: (T,) what the time map leaves in t; exact: whether f and F_0 have guard digits.

    Of more than MOST_LOCAL times so many spread over them are looked at, and the largest
    sensitivities hold for all.
    """
    n, count, rest = torus.z.size + 1, times.size, series_tail(torus)
    of_error = sensitivity_room(n - 1)
    local = np.zeros((min(count, MOST_LOCAL), 2, 5))
    for i in range(local.shape[0]):
        t = i * (count - 1) // max(local.shape[0] - 1, 1)
        set_sensitivity(torus, psi[t], room, of_error, local[i])
    most = np.zeros((2, 5))
    for i in range(local.shape[0]):
        for part in range(2):
            for j in range(5):
                most[part, j] = max(most[part, j], BETWEEN * local[i, part, j])
    loose = 0.0 if exact else 1.0
    for t in range(count):
        for part in range(2):
            s = local[t, part] if count <= MOST_LOCAL else most[part]
            phases = PHASE * s[TOGETHER] + FLOW * abs(tau[t]) * loose * s[BY_FLOW]
            phases = EPSILON * phases + LEFT_OUT * rest * s[ADDED]
            time = EPSILON * TIME * abs(times[t]) * loose + MAP * off[t]
            errors[part, t] = EPSILON * EVALUATION * n + phases + time * s[BY_TIME]
            if part == 0:
                errors[2, t], errors[3, t] = time * s[PACE], phases
