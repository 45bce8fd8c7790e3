"""heyoka's adaptive Taylor method as an integrator of a flow (extra ``fast``)."""

from __future__ import annotations

import copy
import threading
from collections.abc import Hashable, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.budget import checkpoint, has_budget
from veselova.mechanics.core.errors import InvalidInput, Unsolved, needs
from veselova.mechanics.core.flow import Flow, Operations
from veselova.numeric.integrator import Integrator
from veselova.tunings import COMPACT_EQUATIONS, COMPACT_OPERATIONS

__all__ = ["Taylor"]

Array = NDArray[np.float64]

#: Budget: compiled fields that are kept.
_MOST_COMPILED = 64


class Taylor(Integrator):
    """Taylor series of order about 20 with the step chosen from the tolerance, of all flows in one
    batch, whose lanes share the instructions of the processor.
    """

    #: At 2⁻⁵² the method's own error is below rounding.
    tolerance: ClassVar[float] = 2.0**-52

    neighbours: ClassVar[tuple[float, ...]] = (1.0, -1.0)
    safety: ClassVar[float] = 4.0

    def __init__(self, flows: Sequence[Flow]) -> None:
        self._flows = flows
        self._integrator = _of_this_thread(flows[0], len(flows))
        used = len(self._integrator.pars)  # the last ones may have dropped out of the field
        self._parameters = np.stack([flow.parameters[:used] for flow in flows], axis=1)
        self._steps = 0

    def advance(
        self, states: Array, start: float, stop: float, wanted: Array
    ) -> tuple[Array, Array]:
        """Return the states at the wanted times (B, N, m), and at stop (B, m)."""
        for flow, state in zip(self._flows, states, strict=True):
            if flow.clearance(state) <= 0:
                raise flow.ending(start, state)
        integrator = self._integrator
        integrator.pars[:] = self._parameters
        integrator.set_time(start)
        integrator.state[:] = states.T
        watched = has_budget() or not self._flows[0].endless
        # Not propagate_until with c_output: that compiles a continuous output in every call.
        grid = np.concatenate([[start], wanted, [stop]])
        places = np.append(True, np.diff(grid) != 0)
        _, found = integrator.propagate_grid(
            np.repeat(grid[places][:, None], len(states), axis=1),
            callback=self._goes_on if watched else None,
        )
        outcomes = integrator.propagate_res
        self._require_end()
        for outcome, *_ in outcomes:
            if "time_limit" not in str(outcome):
                raise Unsolved(
                    "integration-failed",
                    f"the Taylor method stopped between t = {start:.6g} and {stop:.6g} (scaled): "
                    f"{outcome}",
                )
        self._steps += outcomes[0][3]
        rows = np.cumsum(places) - 1
        return found.transpose(2, 0, 1)[:, rows[1:-1]], found[-1].T

    def _goes_on(self, integrator: Any) -> bool:
        checkpoint()
        return all(
            flow.endless or flow.clearance(state) > 0
            for flow, state in zip(self._flows, integrator.state.T, strict=True)
        )

    def _require_end(self) -> None:
        """Raise the named outcome of a motion that has ended on the way."""
        if self._flows[0].endless:
            return
        integrator = self._integrator
        for flow, time, state in zip(self._flows, integrator.time, integrator.state.T, strict=True):
            if not flow.clearance(state) > 0:
                raise flow.ending(float(time), np.array(state))

    @property
    def steps(self) -> int:
        """Return the number of steps that the answer has taken so far."""
        return self._steps


class _Own(threading.local):
    """The integrators of one thread."""

    def __init__(self) -> None:
        self.integrators: dict[tuple[Hashable, int], Any] = {}


#: Compiled integrators by structure and lanes, and those of one thread, which nothing else uses
#: while it advances.
_known: dict[tuple[Hashable, int], Any] = {}
_own = _Own()


def _of_this_thread(flow: Flow, lanes: int) -> Any:
    """Return a compiled integrator of a field that no other thread uses; state, time and parameters
    are set at each use.
    """
    with needs("heyoka", "method='taylor'"):
        import heyoka as hy
    own = _own.integrators
    key = flow.structure, lanes
    if key not in own:
        if len(own) >= _MOST_COMPILED:
            own.clear()
        own[key] = copy.copy(_compile(hy, flow, lanes))
    return own[key]


def _compile(hy: Any, flow: Flow, lanes: int) -> Any:
    """Return heyoka's compiled integrator of a field for so many lanes, its parameters left open;
    one is kept for every structure.
    """
    if flow.structure is None:
        raise InvalidInput(("method",), "dop853 (this field has no symbolic form)", "taylor")
    key = flow.structure, lanes
    if key not in _known:
        variables = hy.make_vars(*[f"x{i}" for i in range(flow.initial.size)])
        parameters = [hy.par[i] for i in range(flow.parameters.size)]
        derivatives = flow.field(
            np.array(variables, dtype=object), np.array(parameters, dtype=object), _symbols(hy)
        )
        equations = [hy.expression(dx) if isinstance(dx, float) else dx for dx in derivatives]
        if len(_known) >= _MOST_COMPILED:
            _known.clear()
        compact = (
            len(equations) >= COMPACT_EQUATIONS
            or sum(len(dx) for dx in equations) >= COMPACT_OPERATIONS
        )
        _known[key] = hy.taylor_adaptive_batch(
            list(zip(variables, equations, strict=True)),
            np.ones((len(variables), lanes)),
            tol=Taylor.tolerance,
            compact_mode=compact,
        )
    return _known[key]


def _symbols(hy: Any) -> Operations:
    """Return the operations on arrays of heyoka's expressions; its own sums compile ten times
    faster than chains of additions.
    """

    def dot(a: Any, b: Any) -> Any:
        rows = np.atleast_2d(a)
        columns = np.atleast_2d(b.T)
        product = np.empty((len(rows), len(columns)), dtype=object)
        for i, row in enumerate(rows):
            product[i] = [
                hy.sum([x * y for x, y in zip(row, column, strict=True)]) for column in columns
            ]
        flat = product.reshape(a.shape[:-1] + b.shape[1:])
        return flat[()] if flat.ndim == 0 else flat

    def solve(a: Any, b: Any) -> Any:
        lower = np.array(a)
        inverse = []
        right = np.array(b).reshape(len(a), -1)
        for k in range(len(lower)):  # a definite matrix needs no pivots
            inverse.append(1.0 / lower[k, k])
            factors = lower[k + 1 :, k] * inverse[k]
            lower[k + 1 :, k + 1 :] = lower[k + 1 :, k + 1 :] - np.outer(factors, lower[k, k + 1 :])
            right[k + 1 :] = right[k + 1 :] - np.outer(factors, right[k])
        for k in reversed(range(len(lower))):
            right[k] = right[k] * inverse[k]
            right[:k] = right[:k] - np.outer(lower[:k, k], right[k])
        return right.reshape(b.shape)

    return Operations(hy.sqrt, dot, solve)
