"""What ball arithmetic costs, and which work is begun: seconds on one core, from measurements.

Estimates were between 0.6 and 1.6 times what was measured, for n = 2 … 6 and 20 … 1000 digits
(``python benchmarks/costs_in_balls.py``).
"""

from __future__ import annotations

from dataclasses import dataclass

from veselova.mechanics.core.budget import checkpoint, has_budget, stated_s
from veselova.mechanics.core.errors import OverBudget, Unsolved, two_digits
from veselova.tunings import (
    BALL_DIGITS,
    BALL_ENTRY,
    BALL_FIRST_TERMS,
    BALL_GENUS,
    BALL_INVERSION,
    BALL_MODE,
    BALL_MODE_AT_TIME,
    BALL_MODE_FIXED,
    BALL_MODE_GENUS_GROWTH,
    BALL_MODE_GENUS_ONE,
    BALL_MODE_GROWTH,
    BALL_NODES,
    BALL_SET_UP,
    BALL_TERM_DIGITS,
    BALL_THETA,
    BALL_THETA_GROWTH,
    BALL_TIME,
)

__all__ = ["CostsInBalls"]

#: Budget: seconds of work that is begun without a budget; and by how much an estimate may exceed a
#: budget, as it may be twice too large.
_LONGEST_S = 30.0
_SLACK = 2.0


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
        return min(self.genus, BALL_GENUS)

    @property
    def _inversion(self) -> float:
        growth = (BALL_TERM_DIGITS + self.digits) / (BALL_TERM_DIGITS + BALL_DIGITS)
        return (1 + self.genus**2) * (BALL_FIRST_TERMS + self.terms) * BALL_INVERSION * growth

    @property
    def set_up(self) -> float:
        """Return the seconds of everything that does not depend on times."""
        return BALL_SET_UP * self._inversion

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
        growth: float = (self.digits / BALL_DIGITS) ** BALL_THETA_GROWTH
        return _grow(BALL_THETA[part], self._kind) * growth

    def modes(self, count: float, nodes: int, times: int) -> float:
        """Return the seconds of a Fourier time map of so many modes, and of its inverse at times.

        ``nodes``: the most that a cut takes in doubles.
        """
        mode = BALL_MODE * BALL_MODE_GENUS_GROWTH ** (self._kind - 3)
        mode *= BALL_MODE_GENUS_ONE if self.genus == 1 else 1.0
        growth = (self.digits / BALL_DIGITS) ** BALL_MODE_GROWTH * (nodes / BALL_NODES) ** 2
        at_times = times * (count * BALL_MODE_AT_TIME * mode + BALL_TIME)
        return float(count * mode * (BALL_MODE_FIXED + growth) + at_times)

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


def _grow(cost: tuple[float, float], genus: int) -> float:
    """Return a cost at a genus, from that at genus 1 and its growth."""
    first, growth = cost
    seconds: float = first * growth ** (genus - 1)
    return seconds
