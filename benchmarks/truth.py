"""The true motion: the Neumann form in physical time, integrated by heyoka in binary128 (34
digits).

It shares nothing with the engines under test: other equations (Neumann's, not the extended system),
other arithmetic, and the start rounded to 34 digits straight from the exact input. Operations of
binary128 are calls of functions: nothing is gained where the compiler is let to optimize them.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.systems.torus_problem import TorusProblem

Array = NDArray[np.float64]

#: Steps from one time to the next before giving up: minutes. A's over many orders of magnitude can
#: ask for as many.
MOST_STEPS = 20_000

_CONTEXT = mpmath.MPContext()
_CONTEXT.dps = 45


@lru_cache(maxsize=16)
def _integrator(n: int, time: str = "t") -> Any:
    import heyoka as hy

    quad = hy.real128
    q, v = (list(hy.make_vars(*[f"{name}{i}" for i in range(n)])) for name in ("q", "v"))
    E = [[hy.make_vars(f"e{i}_{k}") for k in range(1, n)] for i in range(n)]
    tau1 = hy.make_vars("tau1")
    A, inverse, W = [hy.par[i] for i in range(n)], [hy.par[n + i] for i in range(n)], hy.par[2 * n]

    def dot(*factors: Any) -> Any:
        return hy.sum([np.prod(list(terms)) for terms in zip(*factors, strict=True)])

    rate = {"t": hy.sqrt(W / dot(A, q, q)), "s": W * dot(A, q, q), "tau1": W}[time]  # dτ₁/d(time)
    multiplier = (dot(inverse, q, q) - dot(v, v)) / dot(q, q)
    equations = [(a, rate * b) for a, b in zip(q, v, strict=True)]
    equations += [(b, rate * (multiplier - c) * a) for a, b, c in zip(q, v, inverse, strict=True)]
    for k in range(n - 1):
        column = [row[k] for row in E]
        along_q, along_v = dot(q, column), dot(v, column)
        equations += [(column[i], rate * (v[i] * along_q - q[i] * along_v)) for i in range(n)]
    equations.append((tau1, rate))
    zeros = [quad(0)] * (2 * n + n * (n - 1) + 1)
    return hy.taylor_adaptive(
        equations, zeros, fp_type=quad, compact_mode=True, opt_level=0, pars=[quad(1)] * (2 * n + 1)
    )


def true_motion(
    problem: TorusProblem, times: Array, frame: Any = None, most_steps: int = MOST_STEPS
) -> tuple[Array, Array, Array]:
    """Return (frame, velocity, τ₁) at the problem's own times, rounded to double from 34 digits;
    ``frame``: exact strings.

    A frame left to the problem is taken as the problem's own doubles, made orthogonal in high
    precision. The velocity is dq/dt, or dq/dτ₁ but for Veselova's system.
    """
    import heyoka as hy

    mp = _CONTEXT
    exact, n = problem.exact, problem.n
    # the motion does not know the unit of A, and time is counted in units of 1/max|q̇|
    unit = max(exact.A)
    A = [mp.mpf((a / unit).numerator) / (a / unit).denominator for a in exact.A]
    q = [mp.mpf(x.numerator) / x.denominator for x in exact.q]
    q_dot = [mp.mpf(x.numerator) / x.denominator for x in exact.q_dot]
    length = mp.sqrt(mp.fsum(x * x for x in q))
    q = [x / length for x in q]
    slope = mp.fsum(x * y for x, y in zip(q, q_dot, strict=True))
    q_dot = [y - slope * x for x, y in zip(q, q_dot, strict=True)]
    wedge, rate, speed, q_dot = _start(
        problem.time, A, q, q_dot, mp.sqrt(mp.mpf(unit.numerator) / unit.denominator)
    )
    columns = [q]
    source = problem.frame if frame is None else frame
    for k in range(1, n):
        column = [
            mp.mpf(str(source[i][k]) if isinstance(source[i][k], str) else float(source[i][k]))
            for i in range(n)
        ]
        for _ in range(2):
            for other in columns:
                overlap = mp.fsum(x * y for x, y in zip(other, column, strict=True))
                column = [x - overlap * y for x, y in zip(column, other, strict=True)]
        size = mp.sqrt(mp.fsum(x * x for x in column))
        columns.append([x / size for x in column])

    def quad(x: Any) -> Any:
        return hy.real128(mp.nstr(x, 36))

    start = [
        *q,
        *(y / rate for y in q_dot),
        *(columns[k][i] for k in range(1, n) for i in range(n)),
        mp.zero,
    ]
    parameters = [*A, *(1 / a for a in A), wedge]
    integrator = _integrator(n, problem.time)
    integrator.pars[:] = [quad(x) for x in parameters]
    results = np.empty((times.size, len(start)))
    for direction in (1, -1):
        integrator.time = hy.real128(0)
        integrator.state[:] = [quad(x) for x in start]
        indices = np.flatnonzero(times >= 0) if direction > 0 else np.flatnonzero(times < 0)[::-1]
        for index in indices:
            outcome = integrator.propagate_until(
                quad(mp.mpf(float(times[index])) * speed), max_steps=most_steps
            )[0]
            if outcome != hy.taylor_outcome.time_limit:
                raise TimeoutError(f"integration in binary128 ended with {outcome}")
            results[index] = [float(x) for x in integrator.state]
    true_frame = np.empty((times.size, n, n))
    true_frame[:, :, 0] = results[:, :n]
    # The equations list the frame column by column, in the order of the state.
    true_frame[:, :, 1:] = results[:, 2 * n : -1].reshape(-1, n - 1, n).transpose(0, 2, 1)
    velocity = results[:, n : 2 * n]
    root = float(mp.sqrt(mp.mpf(unit.numerator) / unit.denominator))
    if problem.time != "t":
        return true_frame, velocity / root, results[:, -1] * root
    weight = np.sum(results[:, :n] ** 2 * np.array([float(a) for a in A]), axis=1)
    velocity = velocity * (np.sqrt(float(wedge) / weight)[:, None] * float(speed))
    return true_frame, velocity, results[:, -1] * root


def _start(time: str, A: Any, q: Any, q_dot: Any, root: Any) -> tuple[Any, Any, Any, Any]:
    """Return (W, by what the velocity is to be divided, one over the unit of time, the velocity);
    ``root``: of the unit of A.

    With w the A-orthogonal part of q̇: (dτ₁/dt)² = (w,Aw) = W/(q,Aq), and dτ₁/ds = √J (q,Aq), J =
    (w,Aw)/((Aw,Aw)(q,Aq)).
    """
    mp, n = _CONTEXT, len(A)
    if time == "tau1":  # in units of root
        return mp.one, 1 / root, 1 / root, q_dot
    speed = max(abs(y) for y in q_dot)
    v = [y / speed for y in q_dot]
    wedge = mp.fsum(
        A[i] * A[j] * (q[i] * v[j] - q[j] * v[i]) ** 2 for j in range(n) for i in range(j)
    )
    qAq, qAv = (mp.fsum(a * x * y for a, x, y in zip(A, q, other, strict=True)) for other in (q, v))
    rate = mp.sqrt(wedge / qAq)
    if time == "t":
        return wedge, rate, speed, v
    w = [y - qAv / qAq * x for x, y in zip(q, v, strict=True)]
    return (
        rate / mp.sqrt(qAq * mp.fsum((a * x) ** 2 for a, x in zip(A, w, strict=True))),
        rate,
        1 / root,
        v,
    )
