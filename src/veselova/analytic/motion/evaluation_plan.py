"""The evaluation plan: by which method and time map one solution serves given times.

It is decided here and nowhere else. Values, error bound and provenance read it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.motion.torus_solution import WIDEST_RATE, Solution
from veselova.analytic.time_map.cost_model import GUARD_DIGITS, GUARDED_FROM, PANEL_CYCLES, Costs
from veselova.analytic.time_map.panels import ChebyshevTimeMap
from veselova.analytic.time_map.rate import TimeMap, UniformTimeMap
from veselova.mechanics.core.errors import Unsolved

__all__ = ["EvaluationPlan", "Samples"]

Array = NDArray[np.float64]

#: Derived: cycles from which frequencies in extended precision leave no digit of the phases.
_MOST_CYCLES = 1e28


@dataclass(frozen=True)
class Samples:
    """A motion at N times: τ₁ (N,) and its series; ``time_map``: the one that was used."""

    tau1: Array
    series: tuple[Array, ...]
    time_map: TimeMap


@dataclass(frozen=True)
class EvaluationPlan:
    """How one solution serves increasing times.

    - times, remainders: (N,) the doubles, and what exact times are beyond them
    - method: ``theta`` or ``angles``, from phases to the attitude
    - time_map: ``fourier``, ``panels`` or ``uniform``
    - rate_in_angles: whether dt/dτ₁ along the orbit comes from angles, not from theta functions
    - cycles: the most that any phase makes between t = 0 and the times
    - estimates: the seconds of each time map that were compared
    """

    times: Array
    remainders: Array | None
    method: str
    time_map: str
    rate_in_angles: bool
    cycles: float
    estimates: Mapping[str, float]

    @classmethod
    def of(
        cls,
        solution: Solution,
        times: Array,
        method: str | None = None,
        time_map: str | None = None,
        remainders: Array | None = None,
    ) -> EvaluationPlan:
        """Return the plan for times (N,): with the given method and time map, or the cheapest.

        Raises Unsolved (``too-far``) where neither time map reaches the times.
        """
        cycles = solution.fastest * max(abs(times.item(0)), abs(times.item(-1)))
        in_angles = solution.takes_rate_from_angles(method, cycles)
        costs = Costs(solution.curve.genus, solution.modes, cycles, in_angles)
        estimates: Mapping[str, float] = {}
        if solution.problem.time == "tau1":
            _require_known_phases(cycles)
            chosen = "uniform"
        else:
            estimates = costs.estimates(times.size)
            chosen = _choose(solution, costs, times.size, time_map)
        return cls(
            times,
            remainders,
            solution.choose_method(method),
            chosen,
            in_angles,
            cycles,
            estimates,
        )

    @property
    def is_guarded(self) -> bool:
        """Return whether frequencies for these times are those in extended precision."""
        return self.cycles > GUARDED_FROM

    def make_time_map(self, solution: Solution) -> TimeMap:
        """Return the time map of the plan; raises Unsolved (``beyond-floats``)."""
        if self.time_map == "fourier":
            return solution.fourier_time_map(self.is_guarded)
        if self.time_map == "uniform":
            flow = solution.precise_flows[1] if self.is_guarded else solution.in_time
            return UniformTimeMap(flow, solution.mean_rate)
        in_tau1 = solution.precise_flows[0] if self.is_guarded else solution.in_tau1
        rate = partial(solution.rate_at, in_angles=self.rate_in_angles)
        span = float(self.times[0]), float(self.times[-1])
        return ChebyshevTimeMap(rate, solution.mean_rate, in_tau1, *span)


def _require_known_phases(cycles: float) -> None:
    """Raise Unsolved where frequencies leave no digit of the phases."""
    if not cycles <= _MOST_CYCLES:
        known = f"frequencies are known to {GUARD_DIGITS} digits"
        raise Unsolved("too-far", f"{cycles:.3g} cycles of the fastest phase; {known}")


def _choose(solution: Solution, costs: Costs, inversions: int, given: str | None) -> str:
    """Return ``fourier`` or ``panels``: the one given, else the cheaper one."""
    cycles = costs.cycles
    _require_known_phases(cycles)
    if given is None and solution.rate_variation > WIDEST_RATE:
        given = "fourier" if cycles > PANEL_CYCLES else "panels"
    chosen = given or costs.cheaper_time_map(inversions, not solution.near_separatrix)
    if chosen == "panels" and cycles > PANEL_CYCLES:
        reached = f"panels go to {PANEL_CYCLES:.0e} and Fourier time maps to n = 6"
        raise Unsolved(
            "too-far",
            f"{cycles:.3g} cycles of the fastest phase at n = {solution.problem.n}; {reached}",
        )
    return chosen
