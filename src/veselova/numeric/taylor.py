"""heyoka's adaptive Taylor method as an integrator of the reduced flow (extra ``fast``)."""

from __future__ import annotations

import copy
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.errors import BackendMissing, Unsolved
from veselova.mechanics.flow import ReducedFlow
from veselova.numeric.integrator import Integrator

__all__ = ["Taylor"]

Array = NDArray[np.float64]

#: From this dimension on the compact mode: it compiles in 0.2 s where unrolled code takes seconds, and runs up to 2× slower.
_COMPACT_FROM = 4


class Taylor(Integrator):
    """Taylor series of order about 20 with the step chosen from the tolerance."""

    #: At 2⁻⁵² the method's own error is below rounding; the second run takes other steps, so their difference shows the rounding.
    tolerances: ClassVar[tuple[float, float]] = (2.0**-52, 1e-14)
    method: ClassVar[str] = "taylor"

    def __init__(self, flow: ReducedFlow, tolerance: float) -> None:
        self._integrator = copy.copy(_compiled(flow.n, tolerance))
        self._integrator.pars[:] = np.concatenate([flow.A, flow.inverse, [flow.twice_energy]])
        self._steps = 0

    def advance(self, state: Array, start: float, stop: float, wanted: Array) -> tuple[Array, Array]:
        """Return (states at the wanted times, state at stop)."""
        integrator = self._integrator
        integrator.time = start
        integrator.state[:] = state
        outcome, _, _, steps, dense, _ = integrator.propagate_until(stop, c_output=wanted.size > 0)
        if "time_limit" not in str(outcome):
            raise Unsolved(
                "integration-failed", f"the Taylor method stopped between t = {start:.6g} and {stop:.6g} (scaled): {outcome}"
            )
        self._steps += steps
        states = np.array(dense(wanted)) if wanted.size else np.empty((0, state.size))
        return states, np.array(integrator.state)

    @property
    def steps(self) -> int:
        """Return the number of steps taken so far."""
        return self._steps


@lru_cache(maxsize=32)
def _compiled(n: int, tolerance: float) -> Any:
    """Return heyoka's compiled integrator of the field of ReducedFlow: A, A⁻¹ and W are its run-time parameters."""
    try:
        import heyoka as hy
    except ImportError:
        raise BackendMissing("heyoka", "method='taylor'", "pip install 'veselova[fast]'") from None
    p = hy.make_vars(*[f"p{i}" for i in range(n)])
    E = np.array(hy.make_vars(*[f"e{i}_{k}" for i in range(n) for k in range(n)])).reshape(n, n)
    tau1 = hy.make_vars("tau1")
    A, inverse, twice_energy = [hy.par[i] for i in range(n)], [hy.par[n + i] for i in range(n)], hy.par[2 * n]
    q = list(E[:, 0])

    def dot(x: Any, y: Any) -> Any:
        return hy.sum([a * b for a, b in zip(x, y, strict=True)])

    Aq, p_inverse = [a * x for a, x in zip(A, q)], [b * x for b, x in zip(inverse, p)]
    qAq, qq = dot(q, Aq), dot(q, q)
    along = dot(p_inverse, q)
    q_dot = [(a - along / qq * x) / qAq for a, x in zip(p_inverse, q)]
    multiplier = -(dot(p, p_inverse) * qq - dot(p, q) * along) / (qAq * qq * qq)
    equations = [(a, multiplier * x) for a, x in zip(p, q)]
    normal, turning = [dot(q, E[:, k]) for k in range(n)], [dot(q_dot, E[:, k]) for k in range(n)]
    equations += [(E[i, k], q_dot[i] * normal[k] - q[i] * turning[k]) for i in range(n) for k in range(n)]
    equations.append((tau1, hy.sqrt(twice_energy / qAq)))
    return hy.taylor_adaptive(
        equations, np.ones(n + n * n + 1), tol=tolerance, compact_mode=n >= _COMPACT_FROM, pars=np.ones(2 * n + 1)
    )
