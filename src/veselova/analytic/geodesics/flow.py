"""A geodesic and its Jacobi fields by Taylor series, where b is one: the direct problem.

r″ = −λ r/A,   λ = Σv²/A / Σr²/A²,   m″ = −Km,   K = 1/(A₁A₂A₃ (Σr²/A²)²)
"""

from math import exp, log, sqrt
from typing import Any

from veselova.analytic.kernel.compiler import jit, jit_making

from .arithmetic import ORDER, SMALLEST, convolve, midpoint, size, zeros

#: The rows of a state: r, v, m and m′ with m = 0, m′ = 1 at the start, M and M′ with M = 1, M′ = 0.
POINT, TANGENT, REDUCED, SCALE, ROWS = 0, 3, 6, 8, 10

#: Budget: steps along one geodesic; a needle of 1e6 takes 1e4 a turn.
MOST_STEPS = 100_000


@jit
def set_series(axes: Any, rows: Any, own: Any) -> Any:
    """Fill Taylor's coefficients (10, N+1) of a state from the first; axes: (3,) A; room (5, N+1)
    of Σr²/A², its inverse, Σv²/A, λ and K.
    """
    square, inverse, kinetic, force, curvature = own
    product = axes[0] * axes[1] * axes[2]
    last = rows.shape[1] - 1
    for n in range(last + 1):
        q, w = 0 * product, 0 * product
        for i in range(3):
            q = q + convolve(rows[i], rows[i], n) / (axes[i] * axes[i])
            w = w + convolve(rows[3 + i], rows[3 + i], n) / axes[i]
        square[n], kinetic[n] = q, w
        if n == 0:
            inverse[0], force[0] = 1 / q, w / q
        else:
            u = convolve(square[1:], inverse, n - 1)
            x = w - convolve(square[1:], force, n - 1)
            inverse[n], force[n] = -u * inverse[0], x * inverse[0]
        curvature[n] = convolve(inverse, inverse, n) / product
        if n == last:
            return
        for i in range(3):
            total = convolve(force, rows[i], n)
            rows[i, n + 1] = rows[3 + i, n] / (n + 1)
            rows[3 + i, n + 1] = -total / axes[i] / (n + 1)
        for i in (REDUCED, SCALE):
            total = convolve(curvature, rows[i], n)
            rows[i, n + 1], rows[i + 1, n + 1] = rows[i + 1, n] / (n + 1), -total / (n + 1)


@jit
def step_of(rows: Any, own: Any) -> Any:
    """Return a length over which the series leave out SMALLEST of their values."""
    last, result = rows.shape[1] - 1, 1e300
    for n in (last - 1, last):
        rest = size(own[4, n] / own[4, 0])
        for i in range(3):
            rest += size(rows[TANGENT + i, n])
        if rest > 0:
            result = min(result, exp(log(SMALLEST / rest) / n))
    return result


@jit
def sum_series(rows: Any, length: Any, state: Any) -> Any:
    """Fill the state (10,) at a length from the series' beginning."""
    for i in range(ROWS):
        value = 0 * length
        for n in range(rows.shape[1] - 1, -1, -1):
            value = value * length + rows[i, n]
        state[i] = value


@jit
def project(axes: Any, state: Any) -> Any:
    """Bring the state back to the ellipsoid and to unit speed."""
    total = 0 * axes[0]
    for i in range(3):
        total = total + state[i] * state[i] / axes[i]
    along, norm = 0 * axes[0], 0 * axes[0]
    for i in range(3):
        state[i] = state[i] / sqrt(total)
        normal = state[i] / axes[i]
        along, norm = along + state[3 + i] * normal, norm + normal * normal
    speed = 0 * axes[0]
    for i in range(3):
        state[3 + i] = state[3 + i] - along / norm * (state[i] / axes[i])
        speed = speed + state[3 + i] * state[3 + i]
    for i in range(3):
        state[3 + i] = state[3 + i] / sqrt(speed)


@jit_making
def follow(axes: Any, point: Any, tangent: Any, lengths: Any, states: Any) -> Any:
    """Fill the states (T, 10) at lengths (T,), which go away from zero; return how many were
    reached within MOST_STEPS.
    """
    rows, own, state = zeros((ROWS, ORDER + 1)), zeros((5, ORDER + 1)), zeros(ROWS)
    for i in range(3):
        state[POINT + i], state[TANGENT + i] = point[i], tangent[i]
    state[REDUCED + 1], state[SCALE] = 1.0, 1.0
    project(axes, state)
    begin, reach, done = 0 * lengths[0], -1.0, 0
    for _ in range(MOST_STEPS):
        for i in range(ROWS):
            rows[i, 0] = midpoint(state[i])
        set_series(axes, rows, own)
        reach = midpoint(step_of(rows, own))
        while done < lengths.size and size(lengths[done] - begin) <= reach:
            sum_series(rows, lengths[done] - begin, states[done])
            project(axes, states[done])
            done += 1
        if done == lengths.size:
            break
        step = reach if lengths[done] > begin else -reach
        sum_series(rows, step, state)
        project(axes, state)
        begin = begin + step
    return done
