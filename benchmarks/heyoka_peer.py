"""heyoka as its own users call it: the peer that the scripts in ``benchmarks/`` compare
with.

The field is compiled once for every n, with A as parameters. ``propagate_grid`` yields the states,
and (q, p) is put back on the manifold every ten radians. The attitude comes from q and p where they
determine it (n ≤ 3); there is no error estimate.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.systems.veselova import Veselova
from veselova.tunings import COMPACT_EQUATIONS

__all__ = ["HeyokaPeer"]

Array = NDArray[np.float64]

#: Method: radians between two projections, the starting speed being one.
_SEGMENT = 10.0

#: Budget: states that turn into attitudes at once: their arrays stay in the processor's cache.
_BLOCK = 4096


class HeyokaPeer:
    """One motion of a moving body by heyoka's Taylor method, τ₁, velocity and frame, without an
    error estimate.

    In space p is at rest, and so are vectors u with u̇ = −(q̇,u) q: (q, p/|p|, u₃, …, uₙ) is the
    frame up to a constant rotation. For n = 3 the last one is q × p/|p|; for n ≥ 4 heyoka
    integrates n − 2 of them besides (q, p, τ₁).
    """

    def __init__(self, problem: Veselova) -> None:
        flow = problem.flow()
        n = flow.n
        self._flow, self._integrator = flow, compile_integrator(n)
        self._integrator.pars[:] = flow.parameters
        p = flow.initial[:n]
        frame = flow.initial[n:-1].reshape(n, n)
        basis = np.linalg.qr(np.column_stack([frame[:, 0], p, np.eye(n)]))[0][:, :n]
        basis[:, 0], basis[:, 1] = frame[:, 0], p / np.linalg.norm(p)
        carried = basis[:, 2:].T if n > 3 else np.empty((0, n))
        self._start = np.concatenate([frame[:, 0], p, carried.ravel(), [0.0]])
        self._constant = self._basis(self._start[:, None])[:, :, 0].T @ frame

    def __call__(self, times: Array) -> tuple[Array, Array, Array]:
        """Return (τ₁, q̇, frame) of shapes (N,), (N, n) and (N, n, n) at increasing times that are
        not negative.
        """
        flow = self._flow
        n = self._flow.n
        states = self._states(times / flow.time_unit)
        q_dot = np.empty((times.size, n))
        frame = np.empty((times.size, n, n))
        for first in range(0, times.size, _BLOCK):
            part = slice(first, first + _BLOCK)
            block = np.ascontiguousarray(states[part].T)
            q_dot[part] = self._velocity(block).T
            frame[part] = (self._constant.T @ self._basis(block)).transpose(2, 0, 1)
        return states[:, -1] * flow.tau1_unit, q_dot, frame

    def _velocity(self, block: Array) -> Array:
        """Return q̇ of shape (n, N), from states of shape (·, N)."""
        flow = self._flow
        n = self._flow.n
        q = block[:n]
        A, inverse = flow.parameters[:n], flow.parameters[n:-1]
        p_inverse = inverse[:, None] * block[n : 2 * n]
        sliding = p_inverse - np.sum(p_inverse * q, axis=0) * q
        return np.asarray(sliding / (A @ (q * q) * flow.time_unit))

    def _states(self, times: Array) -> Array:
        """Return the states at scaled times, in stretches of ten radians."""
        integrator = self._integrator
        integrator.time, integrator.state[:] = 0.0, self._start
        found = np.empty((times.size, self._start.size))
        ends = np.append(np.arange(_SEGMENT, times[-1], _SEGMENT), times[-1])
        begins = np.append(0, np.searchsorted(times, ends, side="right"))
        for end, first, last in zip(ends, begins[:-1], begins[1:], strict=True):
            grid = np.concatenate([[integrator.time], times[first:last], [end]])
            keep = np.append(True, np.diff(grid) > 0)
            rows = np.cumsum(keep) - 1
            found[first:last] = integrator.propagate_grid(grid[keep])[-1][rows[1:-1]]
            self._project(integrator.state)
        return found

    def _project(self, state: Array) -> None:
        """Put (q, p) back on the manifold: (q,q) = 1, (q,p) = 0, p rescaled to the energy."""
        flow = self._flow
        n = self._flow.n
        q = state[:n]
        p = state[n : 2 * n]
        q /= np.sqrt(q @ q)
        p -= (p @ q) * q
        A, inverse, twice_energy = np.split(flow.parameters, [n, 2 * n])
        p *= np.sqrt(twice_energy * (q @ (A * q)) / (p @ (inverse * p)))

    def _basis(self, block: Array) -> Array:
        """Return the matrices with columns q, p/|p|, u₃, …, uₙ, as (row, column, N), from states of
        shape (·, N).
        """
        n = self._flow.n
        q = block[:n]
        p = block[n : 2 * n]
        basis = np.empty((n, n, block.shape[1]))
        basis[:, 0] = q
        basis[:, 1] = p / np.sqrt(np.sum(p * p, axis=0))
        if n == 3:
            for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
                basis[i, 2] = q[j] * basis[k, 1] - q[k] * basis[j, 1]
        elif n > 3:
            basis[:, 2:] = block[2 * n : -1].reshape(n - 2, n, -1).transpose(1, 0, 2)
        return basis


@cache
def compile_integrator(n: int) -> Any:
    """Return heyoka's integrator of (q, p, u₃, …, uₙ, τ₁), or (q, p, τ₁) for n ≤ 3, with the
    parameters A, A⁻¹ and W.
    """
    import heyoka as hy

    others = n - 2 if n > 3 else 0
    x = np.array(hy.make_vars(*[f"x{i}" for i in range(2 * n + others * n + 1)]), dtype=object)
    A, inverse = ([hy.par[first + i] for i in range(n)] for first in (0, n))
    q = x[:n]
    p = x[n : 2 * n]
    p_inverse = inverse * p
    qAq = hy.sum([a * b * b for a, b in zip(A, q, strict=True)])
    along = hy.sum(list(p_inverse * q))
    q_dot = (p_inverse - along * q) / qAq
    equations = [*q_dot, *(-(hy.sum(list(p * q_dot)) * q))]
    for u in x[2 * n : -1].reshape(others, n):
        equations.extend(-(hy.sum(list(q_dot * u)) * q))
    equations.append(hy.sqrt(hy.par[2 * n] / qAq))
    system = list(zip(x, equations, strict=True))
    return hy.taylor_adaptive(
        system, np.ones(x.size), tol=2.0**-52, compact_mode=x.size >= COMPACT_EQUATIONS
    )
