"""What given times ask of a solution: how many cycles off they lie, by which clock they are
reached, and in which windows.
"""

from __future__ import annotations

from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.dense_output.chebyshev_window import NODES
from veselova.analytic.dense_output.interpolation import FEW_TIMES, Windows
from veselova.analytic.motion.torus_solution import WIDEST_RATE, Solution
from veselova.analytic.time_map.cost_model import GUARD_DIGITS, GUARDED_FROM, PANEL_CYCLES, Costs
from veselova.analytic.time_map.panels import ChebyshevTimeMap
from veselova.analytic.time_map.rate import TimeMap, UniformTimeMap
from veselova.mechanics.core.errors import Unsolved

__all__ = ["EvaluationPlan"]

Array = NDArray[np.float64]

#: Cycles from which guarded frequencies leave no digit of the phases.
_MOST_CYCLES = 1e28


class EvaluationPlan:
    """Times (N,), increasing, at which one solution is wanted; ``method``: the route to the
    attitude, None for the default.

    remainders: what exact times are beyond the doubles · cycles: the most that any phase makes
    between t = 0 and the times
    """

    def __init__(
        self,
        solution: Solution,
        times: Array,
        method: str | None = None,
        remainders: Array | None = None,
    ) -> None:
        self.solution = solution
        self.times = times
        self.method = method
        self.remainders = remainders
        self.cycles = solution.fastest * max(abs(times.item(0)), abs(times.item(-1)))

    @property
    def is_guarded(self) -> bool:
        """Return whether frequencies for these times carry guard digits."""
        return self.cycles > GUARDED_FROM

    @cached_property
    def costs(self) -> Costs:
        """Return what the clocks cost."""
        solution = self.solution
        return Costs(solution.curve.genus, solution.modes, self.cycles, self._in_angles)

    @cached_property
    def _in_angles(self) -> bool:
        """Return whether panels take dt/dτ₁ from angles."""
        return self.solution.takes_rate_from_angles(self.method, self.cycles)

    @cached_property
    def inversions(self) -> int:
        """Return how often a Fourier clock is asked at least: at every time, or at the starts of
        windows.
        """
        return (
            self.times.size if self.times.size < FEW_TIMES else self.windows("fourier").inversions
        )

    def windows(self, time_map: str) -> Windows:
        """Return the windows in which many times are interpolated where that is cheaper with the
        clock and the method has any.
        """
        none = self.times.size < FEW_TIMES or self.method in ("products", "nufft")
        fewest = self.times.size + 1 if none else self.costs.fewest_in_window(NODES, time_map)
        return Windows(self.times, self.solution.fastest, fewest, self.remainders)

    def time_map(self, name: str | None = None) -> TimeMap:
        """Return a clock for the times: ``fourier`` or ``panels``, by cost where no name is given.

        Panels take dt/dτ₁ along the orbit by the method that is given, or by the cheaper one.
        Raises Unsolved (``too-far``, ``beyond-floats``).
        """
        solution = self.solution
        if not self.cycles <= _MOST_CYCLES:
            known = f"frequencies are known to {GUARD_DIGITS} digits"
            raise Unsolved("too-far", f"{self.cycles:.3g} cycles of the fastest phase; {known}")
        if solution.problem.time == "tau1":
            return UniformTimeMap(
                solution.precise_flows[1] if self.is_guarded else solution.in_time,
                solution.mean_rate,
            )
        if name is None and solution.moving.rate_variation > WIDEST_RATE:
            name = "fourier" if self.cycles > PANEL_CYCLES else "panels"
        if (
            name or self.costs.cheaper_clock(self.inversions, not solution.near_separatrix)
        ) == "fourier":
            return solution.fourier_time_map(self.is_guarded)
        if self.cycles > PANEL_CYCLES:
            reached = f"panels go to {PANEL_CYCLES:.0e} and Fourier clocks to n = 6"
            raise Unsolved(
                "too-far",
                f"{self.cycles:.3g} cycles of the fastest phase at n = {solution.problem.n}; "
                f"{reached}",
            )
        in_tau1 = solution.precise_flows[0] if self.is_guarded else solution.in_tau1
        rate = partial(solution.rate_at, in_angles=self._in_angles)
        return ChebyshevTimeMap(rate, solution.mean_rate, in_tau1, *self.windows("panels").span)
