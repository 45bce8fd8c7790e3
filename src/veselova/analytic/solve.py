"""The analytic engine's answer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from veselova.analytic.closed.area_veselova import AreaVeselova, area_torus
from veselova.analytic.closed.bodies import AreaBody, MotionOfBody
from veselova.analytic.closed.motion import TorusMotion
from veselova.analytic.closed.shell_motion import ShellMotion
from veselova.analytic.separable.motions import BodyMotion, PointMotion
from veselova.mechanics.core.arguments import FEWEST_DIGITS, beyond_double
from veselova.mechanics.core.errors import InvalidInput, show
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.results.trajectory import Trajectory
from veselova.mechanics.systems.ball_on_sphere import RubberBallOnSphere
from veselova.mechanics.systems.rolling_ball_n import RollingBallN
from veselova.mechanics.systems.rubber_ball import RubberBall
from veselova.mechanics.systems.separable_veselova import SeparableVeselova
from veselova.mechanics.systems.torus_problem import TorusProblem
from veselova.mechanics.systems.veselova_so3 import VeselovaSO3

__all__ = ["METHODS", "solve"]

#: A motion as a function of time.
_Motion = Callable[[TimeGrid], Trajectory]

#: The routes from phases to the attitude.
METHODS = ("theta", "angles")

#: Calibrated: sine of the angle between momentum and γ below which an area constant has 15 digits:
#: the axes of the torus are not defined there.
_NEARLY_UPRIGHT = 1e-5


@dataclass(frozen=True)
class _Options:
    """The options of ``solve``."""

    method: str | None
    time_map: str | None
    digits: int
    certified: bool
    beyond_double: bool

    def require(self, where: str, methods: tuple[str, ...], time_maps: tuple[str, ...]) -> None:
        """Raise InvalidInput for a method or time map that is not served there."""
        for field, served in (("method", methods), ("time_map", time_maps)):
            given = getattr(self, field)
            if given is not None and given not in served:
                raise InvalidInput((field,), f"{' or '.join(served) or 'none'}{where}", show(given))

    def needs_doubles(self, what: str) -> InvalidInput:
        """Return the refusal of more than doubles for something."""
        if self.digits > FEWEST_DIGITS:
            required = f"{FEWEST_DIGITS}, not certified, for {what}"
            return InvalidInput(("digits",), required, str(self.digits))
        required = f"false, with {FEWEST_DIGITS} digits, for {what}"
        return InvalidInput(("certified",), required, "true")

    def require_served_in_balls(self) -> None:
        """Raise InvalidInput for what digits, or certified errors, do not have."""
        if self.certified:
            self.require(", where errors are certified", ("angles",), ())
        self.require(f", where digits > {FEWEST_DIGITS}", METHODS, ())


def solve(
    problem: TorusProblem | AreaBody | RollingBallN | SeparableVeselova | RubberBallOnSphere,
    times: Any,
    *,
    method: str | None = None,
    time_map: str | None = None,
    digits: int = FEWEST_DIGITS,
    certified: bool = False,
) -> Trajectory:
    """Return the motion at the given times in closed form.

    ``method``: ``theta`` (every entry of the attitude a theta quotient) or ``angles`` (Abel–Jacobi
    inversion, then the algebraic frame); None takes the cheaper.
    ``time_map``: ``fourier`` or ``panels``; None takes the cheaper. Any time costs the same by
    ``fourier``.
    Every start is served: equal A's, frozen directions, coinciding constants, rest. On a separatrix
    the start is moved by 1e-60, and the error grows like e^(rate·t) from there.
    ``digits`` > 15, or ``certified``: in ball arithmetic, data taken exactly; see
    Trajectory.decimals.
    Raises InvalidInput for bad times or names, Unsolved where a time is too far or the data leave
    no digit of the answer.
    ``error`` bounds the true error of every component of the bounded series at each time:
    true ≤ error. The true error is about 1e-14 at t of order 10².
    """
    beyond = beyond_double(digits, certified)
    grid = TimeGrid.of(times, beyond)
    options = _Options(method, time_map, digits, certified, beyond)
    options.require("", METHODS, ("fourier", "panels"))
    for kind, motion_of in _SYSTEMS:
        if isinstance(problem, kind):
            return motion_of(problem, options)(grid)
    raise InvalidInput(("problem",), "a system with a closed form", type(problem).__name__)


def _point(problem: TorusProblem, options: _Options, body: AreaBody | None = None) -> _Motion:
    """Return the motion of a rank-one problem, Neumann's, or a geodesic; in balls that of a body on
    the torus of the problem.
    """
    if not options.beyond_double:
        return TorusMotion(problem, options.method, options.time_map)
    options.require_served_in_balls()
    from veselova.analytic.digits.motion import MotionInBalls

    return MotionInBalls(problem, options.digits, options.certified, options.method, body)


def _body(problem: AreaBody, options: _Options) -> _Motion:
    """Return the motion of a body in space, of a ball that neither slips nor twists, or of
    Chaplygin's ball.
    """
    if not problem.has_torus:
        return _in_potential(problem, options)
    if not options.beyond_double:
        return MotionOfBody(problem, options.method, options.time_map)
    if isinstance(problem, VeselovaSO3) and problem.linear == 0:
        _require_digits(problem, options, area=False)
        return _point(problem.rank_one(), options, problem)
    _require_digits(problem, options, area=True)
    return _point(area_torus(problem, options.digits), options, problem)


def _require_digits(problem: AreaBody, options: _Options, area: bool) -> None:
    """Raise InvalidInput where more than doubles are asked for of a body, and there are none;
    ``area``: whether it has an area constant.
    """
    name, rolls = f"system {problem.system}", isinstance(problem, RubberBall)
    name += " with (Ω,γ) ≠ 0" if area and isinstance(problem, VeselovaSO3) else ""
    if options.certified and (area or rolls):
        reason = "dt/dτ₁ has no proven strip of analyticity there"
        if not area:
            reason = "the attitude alone has them: system veselova-so3 with inertia I + ma²"
        what = name if area else "the contact point"
        raise InvalidInput(("certified",), f"false for {what} ({reason})", "true")
    if not problem.moves and (area or rolls):
        raise options.needs_doubles(f"{name} at rest")
    if problem.axes is not None:
        field = "digits" if options.digits > FEWEST_DIGITS else "certified"
        required = "inertia as 3 principal moments or a diagonal matrix (others have no exact axes)"
        raise InvalidInput((field,), required, "inertia as a matrix")
    torus = problem.on_torus() if area else None
    if isinstance(torus, AreaVeselova) and torus.angle < _NEARLY_UPRIGHT:
        where = f"where the momentum is along γ to {_NEARLY_UPRIGHT:g}"
        raise options.needs_doubles(f"system {problem.system} {where}")


def _ball_n(problem: RollingBallN, options: _Options) -> _Motion:
    """Return the motion of a ball in ℝⁿ."""
    if options.beyond_double:
        further = "" if problem.twists else ": the attitude alone has more, system veselova"
        raise options.needs_doubles(f"the contact point{further}")
    return MotionOfBody(problem, options.method, options.time_map)


def _in_potential(problem: Any, options: _Options) -> _Motion:
    """Return the motion in a separable potential; it has one method and no choice of time maps."""
    if options.beyond_double:
        raise options.needs_doubles(f"system {problem.system} with a potential")
    options.require(f" for system {problem.system}", ("angles",), ())
    return BodyMotion(problem) if isinstance(problem, VeselovaSO3) else PointMotion(problem)


def _shell(problem: RubberBallOnSphere, options: _Options) -> _Motion:
    """Return the motion of a shell around a sphere of half its radius."""
    if options.beyond_double:
        raise options.needs_doubles("a ball over a sphere")
    options.require(" for balls over spheres", ("angles",), ("fourier",))
    return ShellMotion(problem)


#: How each kind of problem is solved: the first row that it fits.
_SYSTEMS: tuple[tuple[Any, Callable[..., _Motion]], ...] = (
    (TorusProblem, _point),
    (AreaBody, _body),
    (RollingBallN, _ball_n),
    (SeparableVeselova, _in_potential),
    (RubberBallOnSphere, _shell),
)
