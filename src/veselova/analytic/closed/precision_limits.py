"""Which motions of bodies have more digits than a double, and certified errors."""

from __future__ import annotations

from veselova.analytic.closed.bodies import AreaBody
from veselova.mechanics.core.decimals import FEWEST_DIGITS
from veselova.mechanics.core.errors import InvalidInput
from veselova.mechanics.systems.area_veselova import AreaVeselova
from veselova.mechanics.systems.chaplygin_ball import ChaplyginBall
from veselova.mechanics.systems.rubber_ball import RubberBall

__all__ = ["needs_doubles", "require_digits", "require_exact_axes"]

#: Calibrated: sine of the angle between momentum and γ below which an area constant has 15 digits:
#: the axes of the torus are not defined there.
_NEARLY_UPRIGHT = 1e-5


def require_digits(problem: AreaBody, digits: int, certified: bool) -> None:
    """Raise InvalidInput where more than doubles are asked for with an area constant, and there are
    none.
    """
    of = "" if isinstance(problem, ChaplyginBall) else " with (Ω,γ) ≠ 0"
    require_exact_axes(problem, digits, certified)
    if certified:
        reason = "dt/dτ₁ has no proven strip of analyticity there"
        required = f"false for system {problem.system}{of} ({reason})"
        raise InvalidInput(("certified",), required, "true")
    if not problem.moves:
        raise needs_doubles(digits, f"system {problem.system}{of} at rest")
    torus = problem.on_torus()
    assert isinstance(torus, AreaVeselova)
    if torus.angle < _NEARLY_UPRIGHT:
        what = f"system {problem.system} where the momentum is along γ to {_NEARLY_UPRIGHT:g}"
        raise needs_doubles(digits, what)


def needs_doubles(digits: int, what: str) -> InvalidInput:
    """Return the refusal of more than doubles for something."""
    if digits > FEWEST_DIGITS:
        return InvalidInput(("digits",), f"{FEWEST_DIGITS}, not certified, for {what}", str(digits))
    return InvalidInput(("certified",), f"false, with {FEWEST_DIGITS} digits, for {what}", "true")


def require_exact_axes(problem: AreaBody, digits: int, certified: bool) -> None:
    """Raise InvalidInput where more than doubles are asked for along axes that are known in double
    precision.
    """
    if isinstance(problem, RubberBall) and problem.linear == 0 and certified:
        further = "the attitude alone has them: system veselova-so3 with inertia I + ma²"
        raise InvalidInput(("certified",), f"false for the contact point ({further})", "true")
    if isinstance(problem, RubberBall) and not problem.moves:
        raise needs_doubles(digits, f"system {problem.system} at rest")
    if problem.axes is not None:
        field = "digits" if digits > FEWEST_DIGITS else "certified"
        required = "inertia as 3 principal moments or a diagonal matrix (others have no exact axes)"
        raise InvalidInput((field,), required, "inertia as a matrix")
