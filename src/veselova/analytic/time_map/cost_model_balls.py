"""What ball arithmetic costs, and which work is begun: seconds on one core, from measurements.

Estimates were between a third and twice what was measured, for n = 2 … 8 and 20 … 1000 digits
(``python benchmarks/costs_in_balls.py``).
"""

from __future__ import annotations

from dataclasses import dataclass

from veselova.mechanics.core.budget import checkpoint, has_budget, stated_s
from veselova.mechanics.core.errors import OverBudget, Unsolved, two_digits

__all__ = ["CostsInBalls"]

#: Seconds of work that is begun without a budget; and by how much an estimate may exceed a budget,
#: as it may be twice too large.
_LONGEST_S = 30.0
_SLACK = 2.0

#: Seconds of an inversion of one point: at all, for each series, and for a term of a series, with
#: what it takes more for each digit.
_POINT = 6e-5
_SERIES = 2e-5
_TERM = 0.25e-6
_TERM_DIGIT = 0.0072e-6

#: Seconds of an entry of the frame, and of the other series with it.
_ENTRY = 6e-6

#: What a set-up takes in inversions.
_SET_UP = 30.0

#: The digits at which the following were measured, and by what power of the digits they grow.
_DIGITS = 60
_THETA_GROWTH = 1.3
_MODE_GROWTH = {1: 1.8, 2: 2.0}

#: Seconds of dt/dτ₁, and of a state, by theta functions, by genus, the last for all above.
_THETA_RATE = {1: 5e-5, 2: 1.3e-4, 3: 4e-4, 4: 2e-3}
_THETA_STATE = {1: 9e-5, 2: 4e-4, 3: 2.1e-3, 4: 1e-2}

#: Seconds of a Fourier mode, by genus: at all, and where no cut takes more than so many nodes in
#: doubles, with whose square it grows; of a mode at a time, and of a time.
_MODE = {1: 0.0, 2: 7e-5, 3: 6e-5, 4: 6e-5}
_MODE_SUMS = {1: 6.5e-4, 2: 7e-5, 3: 1.2e-4, 4: 3e-4}
_MODE_NODES = 24
_MODE_AT_TIME = {1: 1.5e-6, 2: 1e-7, 3: 2e-7, 4: 6e-7}
_TIME = 1e-4


@dataclass(frozen=True)
class CostsInBalls:
    """The seconds that the parts of a motion take in balls.

    - genus
    - digits: the working ones
    - terms: of the longest angle series
    - by_theta: whether rate and attitude come from theta functions
    """

    genus: int
    digits: int
    terms: int
    by_theta: bool

    @property
    def _kind(self) -> int:
        return min(self.genus, max(_MODE))

    @property
    def _inversion(self) -> float:
        of_series = _SERIES + self.terms * (_TERM + _TERM_DIGIT * self.digits)
        return _POINT + self.genus**2 * of_series

    @property
    def set_up(self) -> float:
        """Return the seconds of everything that does not depend on times."""
        return _SET_UP * self._inversion

    @property
    def rate(self) -> float:
        """Return the seconds of dt/dτ₁ at one point."""
        return self._by_theta(_THETA_RATE) if self.by_theta else self._inversion

    @property
    def state(self) -> float:
        """Return the seconds of an attitude at one point."""
        return self._by_theta(_THETA_STATE) if self.by_theta else self._inversion

    def output(self, n: int) -> float:
        """Return the seconds that a state takes on its way into the series of a trajectory."""
        return _ENTRY * n * n

    def _by_theta(self, seconds: dict[int, float]) -> float:
        growth: float = (self.digits / _DIGITS) ** _THETA_GROWTH
        return seconds[self._kind] * growth

    def modes(self, count: float, nodes: int, times: int) -> float:
        """Return the seconds of a Fourier time map of so many modes, and of its inverse at times.

        ``nodes``: the most that a cut takes in doubles.
        """
        kind = self._kind
        growth: float = (self.digits / _DIGITS) ** _MODE_GROWTH.get(kind, 2.0)
        each = _MODE[kind] + _MODE_SUMS[kind] * growth * (nodes / _MODE_NODES) ** 2
        return count * each + times * (count * _MODE_AT_TIME[kind] + _TIME)

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
