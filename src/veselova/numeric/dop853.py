"""SciPy's DOP853 (Dormand–Prince, order 8) as an integrator of a flow."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from veselova.mechanics.core.budget import checkpoint, has_budget
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.core.flow import Flow
from veselova.numeric.integrator import Integrator

__all__ = ["Dop853"]

Array = NDArray[np.float64]


class Dop853(Integrator):
    """DOP853 at a relative tolerance, absolute tolerance a tenth of it (states are of
    order one).
    """

    #: 100 ε is the least that SciPy takes; against 1e-13 integrals drift four times less, for a
    #: tenth more steps.
    tolerance: ClassVar[float] = 2.3e-14
    neighbours: ClassVar[tuple[float, ...]] = (1.0,)
    safety: ClassVar[float] = 8.0

    #: Of the neighbours: the looser tolerance shows the error of the method.
    looser: ClassVar[float] = 2e-13

    def __init__(self, flows: Sequence[Flow], tolerance: float = tolerance) -> None:
        self._runs = [_Run(flow, self.looser if i else tolerance) for i, flow in enumerate(flows)]

    def advance(
        self, states: Array, start: float, stop: float, wanted: Array
    ) -> tuple[Array, Array]:
        """Return the states at the wanted times (B, N, m), and at stop (B, m)."""
        found = [
            run.advance(state, start, stop, wanted)
            for run, state in zip(self._runs, states, strict=True)
        ]
        return np.stack([at for at, _ in found]), np.stack([end for _, end in found])

    @property
    def steps(self) -> int:
        """Return the number of steps that the answer has taken so far."""
        return self._runs[0].steps


class _Run:
    """One integration of a flow at one tolerance."""

    def __init__(self, flow: Flow, tolerance: float) -> None:
        self._flow = flow
        self._tolerance = tolerance
        self.steps = 0

    def advance(
        self, state: Array, start: float, stop: float, wanted: Array
    ) -> tuple[Array, Array]:
        """Return (states at the wanted times, state at stop)."""
        if self._flow.clearance(state) <= 0:
            raise self._flow.ending(start, state)
        outputs = wanted if wanted.size and wanted[-1] == stop else np.append(wanted, stop)
        # Where a state stands SciPy divides zero by zero, and takes a smaller step.
        with np.errstate(invalid="ignore"):
            answer = solve_ivp(
                self._stoppable if has_budget() else self._flow.vector_field,
                (start, stop),
                state,
                method="DOP853",
                t_eval=outputs,
                rtol=self._tolerance,
                atol=self._tolerance / 10,
                events=None if self._flow.endless else _Ending(self._flow),
            )
        if answer.status == 1:
            raise self._flow.ending(float(answer.t_events[0][0]), answer.y_events[0][0])
        if not answer.success:
            raise Unsolved(
                "integration-failed",
                f"DOP853 stopped between t = {start:.6g} and {stop:.6g} (scaled): {answer.message}",
            )
        self.steps += answer.nfev // 12  # twelve stages a step
        states = np.ascontiguousarray(answer.y.T)
        return states[: wanted.size], states[-1]

    def _stoppable(self, time: float, state: Array) -> Array:
        """Return the field at a state: a stiff one takes many steps between two projections."""
        checkpoint()
        return self._flow.vector_field(time, state)


class _Ending:
    """The event that a motion ends, for ``solve_ivp``."""

    terminal = True

    def __init__(self, flow: Flow) -> None:
        self._flow = flow

    def __call__(self, _time: float, state: Array) -> float:
        return self._flow.clearance(state)
