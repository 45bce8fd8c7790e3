"""Motions in separable potentials, integrated by heyoka in binary128 (34 digits) from the exact
data: q and vectors that are carried along q without turning about it.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.flow import Operations
from veselova.mechanics.flows.separable_flow import SeparableFlow

__all__ = ["true_motion_in_potential"]

Array = NDArray[np.float64]

#: Steps from one time to the next before giving up.
MOST_STEPS = 20_000

_CONTEXT = mpmath.MPContext()
_CONTEXT.dps = 45


@lru_cache(maxsize=64)
def _integrator(n: int, walls: tuple[bool, ...], vectors: int) -> Any:
    import heyoka as hy

    quad = hy.real128

    def dot(a: Any, b: Any) -> Any:
        return hy.sum([x * y for x, y in zip(a, b, strict=True)])

    states = np.array(hy.make_vars(*[f"x{i}" for i in range(2 * n)]), dtype=object)
    parameters = np.array([hy.par[i] for i in range(3 * n + 2)], dtype=object)
    live = np.concatenate([np.ones(2 * n), np.array(walls, dtype=float), np.ones(2)])
    flow = SeparableFlow(live, 1.0, np.ones(2 * n))
    field = flow.field(states, parameters, Operations(hy.sqrt, dot, None))  # type: ignore[arg-type]
    equations = list(zip(states, field, strict=True))
    q, velocity = states[:n], field[:n]
    for k in range(vectors):
        e = hy.make_vars(*[f"e{k}_{i}" for i in range(n)])
        along_q, along_v = dot(q, e), dot(velocity, e)
        equations += [(e[i], velocity[i] * along_q - q[i] * along_v) for i in range(n)]
    zeros = [quad(1)] * len(equations)
    # A weak wall is nothing to an integrator that steps across its plane.
    planes = [hy.t_event(states[i], fp_type=quad) for i in range(n) if walls[i]]
    return hy.taylor_adaptive(
        equations,
        zeros,
        fp_type=quad,
        compact_mode=True,
        opt_level=0,
        pars=[quad(1)] * (3 * n + 2),
        t_events=planes,
    )


def true_motion_in_potential(
    A: Sequence[Fraction],
    q: Sequence[Fraction],
    q_dot: Sequence[Fraction],
    potential: tuple[Fraction, Fraction, Sequence[Fraction]],
    times: Array,
    vectors: Array | None = None,
    most_steps: int = MOST_STEPS,
) -> tuple[Array, Array]:
    """Return q (N, n) and the vectors (N, n, K) at times, rounded to double from 34 digits; raises
    TimeoutError.

    q may have any length, and q̇ belongs to |q| = 1; ``vectors`` (n, K) are doubles.
    """
    import heyoka as hy

    mp, n = _CONTEXT, len(A)
    exact = [[mp.mpf(x.numerator) / x.denominator for x in row] for row in (A, q, q_dot)]
    a, x, v = exact
    size = mp.sqrt(mp.fsum(y * y for y in x))
    x = [y / size for y in x]
    slope = mp.fsum(y * z for y, z in zip(x, v, strict=True))
    v = [z - slope * y for y, z in zip(x, v, strict=True)]
    qAq = mp.fsum(c * y * y for c, y in zip(a, x, strict=True))
    qAv = mp.fsum(c * y * z for c, y, z in zip(a, x, v, strict=True))
    p = [c * (z * qAq - qAv * y) for c, y, z in zip(a, x, v, strict=True)]
    det = mp.fprod(a)
    forces = [*potential[2], potential[0], potential[1]]
    forces = [mp.mpf(y.numerator) / y.denominator * det for y in forces]
    carried = [] if vectors is None else [mp.mpf(float(y)) for y in vectors.T.ravel()]
    count = len(carried) // n
    integrator = _integrator(n, tuple(bool(y) for y in potential[2]), count)

    def quad(y: Any) -> Any:
        return hy.real128(mp.nstr(y, 36))

    used = len(integrator.pars)
    integrator.pars[:] = [quad(y) for y in (*a, *(1 / c for c in a), *forces)][:used]
    results = np.empty((times.size, len(x) * (2 + count)))
    for direction in (1, -1):
        integrator.time = hy.real128(0)
        integrator.state[:] = [quad(y) for y in (*x, *p, *carried)]
        later = times >= 0
        indices = np.flatnonzero(later) if direction > 0 else np.flatnonzero(~later)
        for index in sorted(indices, key=lambda i: abs(times[i])):
            outcome = integrator.propagate_until(
                hy.real128(float(times[index])), max_steps=most_steps
            )[0]
            if outcome != hy.taylor_outcome.time_limit:
                raise TimeoutError(f"integration in binary128 ended with {outcome}")
            results[index] = [float(y) for y in integrator.state]
    carried_along = results[:, 2 * n :].reshape(len(times), count, n).transpose(0, 2, 1)
    return results[:, :n], carried_along
