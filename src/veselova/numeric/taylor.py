"""heyoka's adaptive Taylor method as an integrator of a flow (extra ``fast``)."""

from __future__ import annotations

import copy
from collections.abc import Hashable
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.budget import checkpoint, has_budget
from veselova.mechanics.core.errors import BackendMissing, InvalidInput, Unsolved
from veselova.mechanics.core.flow import Flow, Operations
from veselova.numeric.integrator import Integrator

__all__ = ["Taylor"]

Array = NDArray[np.float64]

#: From this many equations, or operations in them (shared ones counted wherever they occur), on the
#: compact mode: it compiles in a second where unrolled code takes minutes, and runs up to 2×
#: slower.
_COMPACT_FROM = 20
_COMPACT_OPERATIONS = 3000

#: Compiled fields that are kept.
_MOST_COMPILED = 64


class Taylor(Integrator):
    """Taylor series of order about 20 with the step chosen from the tolerance."""

    #: At 2⁻⁵² the method's own error is below rounding; the second run takes other steps, so their
    #: difference shows the rounding.
    tolerances: ClassVar[tuple[float, float]] = (2.0**-52, 1e-14)
    method: ClassVar[str] = "taylor"

    def __init__(self, flow: Flow, tolerance: float) -> None:
        self._integrator = copy.copy(_compile(flow, tolerance))
        used = len(self._integrator.pars)  # the last ones may have dropped out of the field
        self._integrator.pars[:] = flow.parameters[:used]
        self._flow = flow
        self._steps = 0

    def advance(
        self, state: Array, start: float, stop: float, wanted: Array
    ) -> tuple[Array, Array]:
        """Return (states at the wanted times, state at stop)."""
        if self._flow.clearance(state) <= 0:
            raise self._flow.ending(start, state)
        integrator = self._integrator
        integrator.time = start
        integrator.state[:] = state
        watched = has_budget() or not self._flow.endless
        ending = self._goes_on if watched else None
        outcome, _, _, steps, dense, _ = integrator.propagate_until(
            stop, c_output=wanted.size > 0, callback=ending
        )
        if "cb_stop" in str(outcome):
            raise self._flow.ending(float(integrator.time), np.array(integrator.state))
        if "time_limit" not in str(outcome):
            raise Unsolved(
                "integration-failed",
                f"the Taylor method stopped between t = {start:.6g} and {stop:.6g} (scaled): "
                f"{outcome}",
            )
        self._steps += steps
        states = np.array(dense(wanted)) if wanted.size else np.empty((0, state.size))
        return states, np.array(integrator.state)

    def _goes_on(self, integrator: Any) -> bool:
        checkpoint()
        return self._flow.endless or self._flow.clearance(integrator.state) > 0

    @property
    def steps(self) -> int:
        """Return the number of steps taken so far."""
        return self._steps


_known: dict[tuple[Hashable, float], Any] = {}


def _compile(flow: Flow, tolerance: float) -> Any:
    """Return heyoka's compiled integrator of a field, its parameters left open; one is kept for
    every structure.
    """
    try:
        import heyoka as hy
    except ImportError:
        raise BackendMissing("heyoka", "method='taylor'", "pip install heyoka") from None
    if flow.structure is None:
        raise InvalidInput(("method",), "dop853 (this field has no symbolic form)", "taylor")
    key = flow.structure, tolerance
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
            len(equations) >= _COMPACT_FROM
            or sum(len(dx) for dx in equations) >= _COMPACT_OPERATIONS
        )
        system = list(zip(variables, equations, strict=True))
        _known[key] = hy.taylor_adaptive(
            system, np.ones(len(variables)), tol=tolerance, compact_mode=compact
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
