"""The two engines behind one call. An engine is imported when it is asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from decimal import Decimal
from fractions import Fraction
from importlib import import_module
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from veselova.mechanics.core.arguments import (
    FEWEST_DIGITS,
    read_precision,
    require_name,
    takes_arrays,
)
from veselova.mechanics.core.budget import Progress, limits
from veselova.mechanics.core.errors import Faults, InvalidInput, Unsolved, show
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.core.times import TimeGrid
from veselova.mechanics.results.comparison import Comparison
from veselova.mechanics.results.trajectory import Trajectory

if TYPE_CHECKING:
    from veselova.mechanics.results.closed_form import ClosedForm
    from veselova.mechanics.results.torus import Torus
    from veselova.mechanics.systems.veselova import Veselova

__all__ = ["ENGINES", "closed_form", "compare", "from_torus", "solve", "torus"]

#: Engine → the module whose ``solve`` it is.
ENGINES: Mapping[str, str] = {
    "analytic": "veselova.analytic.solve",
    "numeric": "veselova.numeric.solve",
}


@takes_arrays
def solve(
    problem: Problem,
    times: ArrayLike | Sequence[Any] | Mapping[str, Any] | TimeGrid,
    engine: str | None = None,
    method: str | None = None,
    *,
    digits: int = FEWEST_DIGITS,
    certified: bool = False,
    formulation: str | None = None,
    budget_s: float | None = None,
    progress: Progress = None,
) -> Trajectory:
    """Return the motion of a problem at the given times, in the order in which they are given; the
    start is t = 0.

    ``times``: a number, a list or array of numbers in any order, or a mapping of start, stop and
    count. A text ("0.1", "1/3"), a Fraction, a Decimal or a whole number is taken exactly where
    ``digits`` are asked for. In doubles it is the nearest one, and ``error`` has the difference.
    The points between start and stop are those of ``numpy.linspace`` where both ends are doubles,
    else exact.

    ``engine``: ``analytic`` (closed form) or ``numeric`` (integration), see ``problem.engines``;
    None takes the closed form where the problem has one, ``problem.default_engine``, and
    integration for a motion that runs into a plane where the potential is −∞. ``method``:
    None for the engine's default; analytic: ``theta`` or ``angles``;
    numeric: ``dop853`` or ``taylor``; ``taylor`` with the extra ``fast``.
    ``formulation`` (numeric): which of ``problem.formulations`` is integrated.
    ``digits`` (15 … 1000, analytic): beyond 15 every number of the answer also comes as a decimal
    with that many digits after the point in q and frame, ``trajectory.decimals``. Data are taken at
    their word: strings exactly, doubles as the dyadic numbers they store. ``certified`` (analytic):
    the error of every such number is a proven bound.

    ``budget_s``: seconds after which the work stops; None for no limit. ``progress``: None shows
    the progress of long work on standard error where that is a terminal or a notebook; True shows
    it anywhere, False nowhere; a function is called with (done, total) of each step.
    Raises InvalidInput for bad input, Unsolved where the engine cannot serve the problem,
    OverBudget when the budget is used up, BackendMissing without the engine's library.
    """
    with limits(budget_s, progress):
        return _solve(
            problem,
            times,
            engine,
            method,
            digits=digits,
            certified=certified,
            formulation=formulation,
        )


def _solve(
    problem: Problem,
    times: Any,
    engine: str | None,
    method: str | None,
    *,
    digits: int = FEWEST_DIGITS,
    certified: bool = False,
    formulation: str | None = None,
) -> Trajectory:
    _require_problem(problem)
    chosen = engine is not None or method is not None
    # what is wrong with them, ``require_options`` says with all else
    beyond = bool(Faults().attempt(read_precision, digits, certified))
    if engine is None:
        # The closed form says why it has no digits where others have.
        engine = "analytic" if beyond and "analytic" in problem.engines else problem.default_engine
    faults = Faults()
    faults.attempt(require_options, type(problem), engine, method, formulation, digits, certified)
    grid = faults.attempt(TimeGrid.of, times, beyond)
    faults.require_none()
    options: dict[str, Any] = {} if method is None else {"method": method}
    if formulation is not None:
        options["formulation"] = formulation
    if beyond:
        options |= {"digits": int(digits), "certified": certified}
    answer: Trajectory
    try:
        answer = import_module(ENGINES[engine]).solve(problem, grid, **options)
    except Unsolved as refusal:
        if chosen or beyond or engine == "numeric" or refusal.outcome != "collision":
            raise
        # Integration serves a motion up to its collision, and names the time of it.
        answer = import_module(ENGINES["numeric"]).solve(problem, grid)
    return answer


def require_options(
    system: type[Problem],
    engine: Any,
    method: Any,
    formulation: Any,
    digits: Any = FEWEST_DIGITS,
    certified: Any = False,
) -> None:
    """Raise InvalidInput, with all faults, unless an engine of a system has this method,
    formulation, and precision.
    """
    faults = Faults()
    known = list(system.engines)
    served = faults.attempt(require_name, engine, ("engine",), known, f"for system {system.system}")
    if served is not None:
        if method is not None:
            faults.attempt(require_name, method, ("method",), system.engines[served])
        if formulation is not None and served == "analytic":
            faults.add(("formulation",), "none (the closed form has one)", show(formulation))
        elif formulation is not None:
            faults.attempt(require_name, formulation, ("formulation",), system.formulations)
    faults.attempt(_require_precision, served or "analytic", digits, certified)
    faults.require_none()


def _require_precision(engine: str, digits: Any, certified: Any) -> None:
    """Raise InvalidInput unless the engine has these digits, and bounds where they
    are asked for.
    """
    read_precision(digits, certified)
    faults = Faults()
    if engine != "analytic" and digits > FEWEST_DIGITS:
        faults.add(("digits",), f"{FEWEST_DIGITS} (the engine {engine} has no more)", str(digits))
    if engine != "analytic" and certified:
        faults.add(("certified",), f"false (the engine {engine} bounds no errors)", "true")
    faults.require_none()


@takes_arrays
def compare(
    problem: Problem,
    times: ArrayLike | Sequence[Any] | Mapping[str, Any] | TimeGrid,
    method: str | None = None,
    *,
    formulation: str | None = None,
    budget_s: float | None = None,
    progress: Progress = None,
) -> Comparison:
    """Return both engines' answers and their differences. For a problem that integration alone
    solves: those of two formulations, the first of ``problem.formulations`` and another.

    ``method`` is the numerical one (``dop853`` or ``taylor``), ``formulation`` what the numerical
    engine, or the other of two integrations, takes; None for the first, or the second. Raises as
    ``solve``, and Unsolved (``no-closed-form``) where one formulation is all that there is.
    """
    _require_problem(problem)
    kind = type(problem)
    faults = Faults()
    grid = faults.attempt(TimeGrid.of, times)
    faults.attempt(require_comparison, kind, method, formulation)
    faults.require_none()
    with limits(budget_s, progress):
        if problem.default_engine == "analytic":
            return Comparison(
                _solve(problem, grid, "analytic", None),
                _solve(problem, grid, "numeric", method, formulation=formulation),
            )
        one, *others = kind.formulations
        if not others:
            reason = f"{problem.without_closed_form}; there is no other formulation to compare with"
            raise Unsolved("no-closed-form", reason)
        names = (one, formulation if formulation in others else others[0])
        first, second = (
            _solve(problem, grid, "numeric", method, formulation=name) for name in names
        )
        return Comparison(first, second, names)


def require_comparison(system: type[Problem], method: Any, formulation: Any) -> None:
    """Raise InvalidInput unless motions of a system can be compared with this method and
    formulation.
    """
    faults = Faults()
    faults.attempt(require_options, system, "numeric", method, formulation)
    first = isinstance(formulation, str) and formulation == system.formulations[0]
    if len(system.engines) < len(ENGINES) and first:
        others = ", ".join(system.formulations[1:])
        required = f"another formulation than the first of system {system.system}: {others}"
        faults.add(("formulation",), required, show(formulation))
    faults.require_none()


@takes_arrays
def from_torus(
    A: ArrayLike | Sequence[Any],
    energy: ArrayLike | Fraction | Decimal,
    constants: ArrayLike | Sequence[Any],
    phases: ArrayLike | Sequence[Any],
    signs: ArrayLike | Sequence[Any],
    frame: ArrayLike | Sequence[Any] | None = None,
) -> Veselova:
    """Return the Veselova problem whose motion has these constants and phases, as ``torus`` gives
    them.

    - A: n distinct positive numbers
    - energy: h > 0
    - constants: (n−2,) c_2 … c_{n−1}, with c_1 = 0 and the sorted I_i interlacing as
      max(c_s, I_s) < min(c_{s+1}, I_{s+1})
    - phases: (n−1,) z⁰ of the start, modulo 1
    - signs: n times 1 or −1, of q_i at the start, or of q̇_i where q_i = 0
    - frame: as a Veselova problem takes it

    Raises InvalidInput where no real motion has them, Unsolved (``beyond-floats``). Round trip
    to 1e-13 for n = 2…8, ratios of A up to 100.
    """
    from veselova.analytic.closed.start_from_torus import start_on_torus
    from veselova.mechanics.systems.veselova import Veselova

    q, q_dot = start_on_torus(A, energy, constants, phases, signs)
    return Veselova(A, q, q_dot, frame, normalize=True)


@takes_arrays
def closed_form(
    problem: Problem,
    accuracy: float | None = None,
    *,
    budget_s: float | None = None,
    progress: Progress = None,
) -> ClosedForm:
    """Return the motion of a problem as data: a document of a few kilobytes that any language can
    evaluate at any time.

    ``accuracy``: the error that modes left out of the time map may make; 1e-12 when left out.
    Raises InvalidInput for a system without a torus and for bad arguments, Unsolved where theta
    functions do not serve (rest, a separatrix, too many modes).
    """
    _require_problem(problem)
    from veselova.analytic.closed.closed_form import closed_form as closed_form_of

    with limits(budget_s, progress):
        return closed_form_of(problem, accuracy)


@takes_arrays
def torus(problem: Problem, *, budget_s: float | None = None, progress: Progress = None) -> Torus:
    """Return the invariant torus of a problem: curve, periods, frequencies, phases. Raises as the
    analytic engine does.
    """
    _require_problem(problem)
    from veselova.analytic.closed.shell_motion import ShellMotion
    from veselova.analytic.closed.torus import torus as torus_of
    from veselova.mechanics.systems.ball_on_sphere import RubberBallOnSphere

    with limits(budget_s, progress):
        if isinstance(problem, RubberBallOnSphere):
            return ShellMotion(problem).torus
        return torus_of(problem)


def _require_problem(problem: Any) -> None:
    if not isinstance(problem, Problem):
        required = "a problem, such as veselova.Veselova(A, q, q_dot)"
        raise InvalidInput(("problem",), required, show(problem))
