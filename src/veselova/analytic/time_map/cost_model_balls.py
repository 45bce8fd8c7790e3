"""What ball arithmetic costs, and which work is begun: seconds on one core, from measurements.

Estimates were between 0.6 and 1.6 times what was measured, for n = 2 … 6 and 20 … 1000 digits
(``python benchmarks/costs_in_balls.py``).
"""

from __future__ import annotations

from dataclasses import dataclass

from veselova.analytic.time_map.tuned_costs import (
    BALL_ENTRY,
    BALL_INVERSION,
    BALL_MODE,
    BALL_THETA,
    grow,
)
from veselova.mechanics.core.budget import checkpoint, has_budget, stated_s
from veselova.mechanics.core.errors import OverBudget, Unsolved, two_digits

__all__ = ["CostsInBalls"]

#: Budget: seconds of work that is begun without a budget; and by how much an estimate may exceed a
#: budget, as it may be twice too large.
_LONGEST_S = 30.0
_SLACK = 2.0

#: Tuning: terms of an angle series that take as long as what a series begins with; the digits at
#: which a term takes twice what it takes at few; and what a set-up takes in inversions.
_FIRST_TERMS = 30
_TERM_DIGITS = 35.0
_SET_UP = 30.0

#: Tuning: the digits and nodes of the costs measured, and by what powers of the digits they grow.
_DIGITS = 60
_NODES = 24
_THETA_GROWTH = 1.3
_MODE_GROWTH = 2.0

#: Tuning: how the cost of a mode grows with the genus, and the part of it that no digits enter; a
#: mode at a time against a mode; at genus 1, where sums are formed in balls, all take so many times
#: as long.
_MODE_GENUS_GROWTH = 1.9
_FIXED = 0.5
_MODE_AT_TIME = 2e-3
_IN_BALLS = 10.0

#: Tuning: seconds of a time, whatever the modes.
_TIME = 1e-4

#: Tuning: largest genus of the formulas: higher ones cost as much.
_HIGHEST_GENUS = 4


@dataclass(frozen=True)
class CostsInBalls:
    """The seconds that the parts of a motion take in balls.

    - genus
    - digits: the working ones
    - terms: of the longest angle series
    - by_theta: whether rate and attitude come from theta functions
    - rate_of_state: whether dt/dτ₁ takes an attitude
    """

    genus: int
    digits: int
    terms: int
    by_theta: bool
    rate_of_state: bool = False

    @property
    def _kind(self) -> int:
        return min(self.genus, _HIGHEST_GENUS)

    @property
    def _inversion(self) -> float:
        of_term = BALL_INVERSION * (_TERM_DIGITS + self.digits) / (_TERM_DIGITS + _DIGITS)
        return (1 + self.genus**2) * (_FIRST_TERMS + self.terms) * of_term

    @property
    def set_up(self) -> float:
        """Return the seconds of everything that does not depend on times."""
        return _SET_UP * self._inversion

    @property
    def rate(self) -> float:
        """Return the seconds of dt/dτ₁ at one point."""
        if self.rate_of_state:
            return self.state
        return self._by_theta("rate") if self.by_theta else self._inversion

    @property
    def state(self) -> float:
        """Return the seconds of an attitude at one point."""
        return self._by_theta("state") if self.by_theta else self._inversion

    def output(self, n: int) -> float:
        """Return the seconds that a state takes on its way into the series of a trajectory."""
        return BALL_ENTRY * n * n

    def _by_theta(self, part: str) -> float:
        growth: float = (self.digits / _DIGITS) ** _THETA_GROWTH
        return grow(BALL_THETA[part], self._kind) * growth

    def modes(self, count: float, nodes: int, times: int) -> float:
        """Return the seconds of a Fourier time map of so many modes, and of its inverse at times.

        ``nodes``: the most that a cut takes in doubles.
        """
        mode = BALL_MODE * _MODE_GENUS_GROWTH ** (self._kind - 3)
        mode *= _IN_BALLS if self.genus == 1 else 1.0
        growth = (self.digits / _DIGITS) ** _MODE_GROWTH * (nodes / _NODES) ** 2
        at_times = times * (count * _MODE_AT_TIME * mode + _TIME)
        return float(count * mode * (_FIXED + growth) + at_times)

    def is_affordable(self, seconds: float) -> bool:
        """Return whether work of so many seconds is begun: within the budget, or a default."""
        return seconds <= (_SLACK * stated_s() if has_budget() else _LONGEST_S)

    def require_affordable(self, seconds: float, outcome: str = "too-costly") -> None:
        """Raise OverBudget where the work is beyond the budget, Unsolved without a budget.

        ``outcome``: the name of the refusal without a budget.
        """
        checkpoint()
        if self.is_affordable(seconds):
            return
        fewer = f"with {self.digits} working digits; ask for fewer digits, or nearer or fewer times"
        if has_budget():
            raise OverBudget(stated_s(), seconds, f", {fewer}, or allow more")
        wanted = f"about {two_digits(seconds)} s of work, as estimated, {fewer}"
        allowed = f"allow it by budget_s={two_digits(_SLACK * seconds)}"
        raise Unsolved(outcome, f"{wanted}, or {allowed} ({_LONGEST_S:g} s without a budget)")
