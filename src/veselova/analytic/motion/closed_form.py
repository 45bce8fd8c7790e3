"""The closed form of a motion as a document: the numbers of its solution, and of its time map, by
their names.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.motion.area_solution import AreaSolution, solution_of
from veselova.analytic.motion.ball_n_motion import ball_fields
from veselova.analytic.motion.closed_form_area import (
    area_fields,
    error_of_body,
    largest_modes,
    places_of,
    rounded,
)
from veselova.analytic.motion.displacement import AlongMomentum
from veselova.analytic.motion.error_bound import ErrorBound
from veselova.analytic.motion.evaluation_plan import EvaluationPlan
from veselova.analytic.motion.steepness import steepness_in_time
from veselova.analytic.motion.torus_solution import Solution
from veselova.analytic.theta.riemann_theta import Theta
from veselova.analytic.time_map.fourier import find_modes
from veselova.analytic.time_map.fourier_modes import largest_first
from veselova.analytic.time_map.rate import TIME_RATE_POWERS
from veselova.analytic.time_map.torus_series import NormalComponent, find_series
from veselova.mechanics.core.decimals import FEWEST_DIGITS
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.core.problem import Problem
from veselova.mechanics.results.closed_form import ClosedForm, require_accuracy
from veselova.mechanics.results.closed_form_schema import AREA_FORMAT
from veselova.mechanics.systems.chaplygin_ball import ChaplyginBall
from veselova.mechanics.systems.rolling_ball_n import RollingBallN
from veselova.mechanics.systems.rolling_veselova import RollingVeselova
from veselova.mechanics.systems.rubber_ball import RubberBall
from veselova.mechanics.systems.torus_problem import on_torus
from veselova.mechanics.systems.veselova_so3 import VeselovaSO3
from veselova.version import __version__

__all__ = ["closed_form"]


#: Budget: modes from which a document is refused: some ten megabytes.
_MOST_MODES = 400_000

#: Derived: least eigenvalue of T for which the plain sum keeps its digits: θ(z) stays above
#: exp(−π/(4·0.2)) = 0.02 of θ(0).
_LEAST_EIGENVALUE = 0.2

#: Derived: cycles of the fastest phase over which the growth of the error is taken: fewer than
#: those from which the engine carries frequencies with more digits than a document has.
_CYCLES = 100.0

#: Calibrated: by how much the document's own arithmetic may be off more than the engine's: products
#: of times and rates are rounded once more.
_OWN_ROUNDING = 2.0

#: Derived: part of Σ|m_k f_k| below which m·f has lost digits that the error has to tell of.
_SLOW = 1e-3

#: Budget: cycles of the fastest phase up to which the error of a document in doubles holds.
_FAR_CYCLES = 1e7


def closed_form(given: Problem, accuracy: float | None = None) -> ClosedForm:
    """Return the motion of a problem as a document.

    ``accuracy``: the error that modes left out of the time map may make in q and the frame,
    1e-12 when left out. Raises InvalidInput for another number, Unsolved at rest, on a
    separatrix (``no-closed-form``) and where theta functions or modes are too many.
    """
    accuracy = require_accuracy(accuracy)
    problem = on_torus(given)
    solution = solution_of(problem)
    if solution.separatrices:
        reason = (
            "the start lies on a separatrix, which no torus describes for long; solve at "
            "times instead"
        )
        raise Unsolved("no-closed-form", reason)
    head = {
        "format": AREA_FORMAT if isinstance(solution, AreaSolution) else ClosedForm.format,
        "version": __version__,
        "time": problem.time,
        "digits": FEWEST_DIGITS,
    }
    # The problem stands last, so that a reader without a JSON parser finds the field that it looks
    # for.
    steepest = steepness_in_time(solution)
    parts = {
        **_attitude(solution),
        **_time_map(solution, steepest, accuracy),
        "error": _error(solution, steepest, accuracy),
    }
    if isinstance(solution, AreaSolution):
        assert isinstance(given, (VeselovaSO3, ChaplyginBall))
        parts |= area_fields(solution, steepest, given, accuracy)
        parts["error"] = error_of_body(parts["error"], given)
        parts["axes"] = None if given.axes is None else given.axes.tolist()
    elif isinstance(given, (RubberBall, RollingBallN)):
        parts |= {"path": _path(solution, given, accuracy)}
        if isinstance(given, RollingBallN):
            parts |= {"ball": ball_fields(given)}
        parts["error"] = {key: given.ball.size * x for key, x in parts["error"].items()}
    growth = _growth_of_slow_modes(solution, steepest, parts)
    parts["error"]["per_unit_time"] += growth
    parts["error"]["per_cycle"] += growth / solution.fastest
    return ClosedForm({**head, **parts, "problem": given.as_dict()})


def _attitude(solution: Solution) -> dict[str, Any]:
    """Return the fields from phases to the attitude."""
    quotients = solution.quotients
    unit = solution.tau1_unit
    axes = solution.problem.axes
    g = solution.curve.genus
    m = solution.moving.size
    pairs = [
        [place, value]
        for place, value in zip(
            quotients.places.tolist(), quotients.constants.tolist(), strict=True
        )
    ]
    columns = [pairs[m + g + k :: g] for k in range(g)]
    return {
        "genus": g,
        "A": solution.problem.A.tolist(),
        "axes": None if axes is None else axes.tolist(),
        "riemann_matrix": np.asarray(solution.periods.riemann_matrix).tolist(),
        "reduction": _reduction(solution),
        "characteristics": [
            [[e / 2 for e in c.epsilon], [d / 2 for d in c.delta]] for c in quotients.functions
        ],
        "q": pairs[:m],
        "q_prime": [[place, value / unit] for place, value in pairs[m : m + g]],
        "normals": columns[:-1],
        "gamma": columns[-1],
        "rotation": solution.rotation.tolist(),
        "directions": solution.moving.directions.tolist(),
        "frozen": (
            solution.frozen_part if solution.moving.frozen else 0 * solution.frozen_part
        ).tolist(),
    }


def _time_map(solution: Solution, steepest: float, accuracy: float) -> dict[str, Any]:
    """Return the fields from times to phases."""
    unit = solution.tau1_unit
    time = solution.problem.time
    modes, coefficients = _modes(solution, steepest, accuracy)
    of_gamma = int(solution.quotients.places[solution.moving.size + solution.curve.genus - 1])
    return {
        "phases": solution.in_tau1.start.tolist(),
        "frequencies": (solution.in_tau1.rates / unit).tolist(),
        "mean_rate": solution.mean_rate / unit,
        "modes": modes.tolist(),
        "coefficients": coefficients,
        "rate": {
            "characteristic": of_gamma,
            "constant": solution.rate_constant / unit,
            "power": TIME_RATE_POWERS[time],
        },
        "units": {"time": time, "phases": "cycles", "frequencies": "cycles per unit of tau1"},
    }


def _modes(
    solution: Solution, steepest: float, accuracy: float
) -> tuple[NDArray[Any], list[float]]:
    """Return the modes m (M, g) that the accuracy asks for, largest first, and F_m per unit of the
    problem's τ₁.

    A mode moves τ₁ by at most |F_m|/(π|m·f|) over dt/dτ₁, and the frame by its sensitivity along
    the flow times that. The smallest are left out as long as their sum is below the accuracy.
    Coefficients are rounded to what it asks for as well.
    """
    g = solution.curve.genus
    if solution.problem.time == "tau1":
        return np.empty((0, g), dtype=np.int64), []
    solution.fourier_time_map(False)  # raises where the rate varies too much, or modes are too many
    modes, coefficients, *_ = find_modes(solution.rate)
    rates = solution.in_tau1.rates
    # at a resonance m·f is zero to rounding
    pace = np.maximum(np.abs(modes @ rates), np.finfo(float).eps * (np.abs(modes) @ np.abs(rates)))
    reach = 2 / (np.pi * pace * solution.mean_rate) * steepest
    effects = np.abs(coefficients) * reach
    selected = largest_first(effects, accuracy / 2)
    if len(selected) > _MOST_MODES:
        raise Unsolved(
            "too-many-modes",
            f"the time map has {len(selected)} modes above {accuracy:g}, and {_MOST_MODES} "
            "can be kept",
        )
    values = coefficients[selected] / solution.tau1_unit
    places = places_of(reach[selected], accuracy, solution.tau1_unit)
    return modes[selected], rounded(values, places)


def _path(solution: Solution, ball: RubberBall | RollingBallN, accuracy: float) -> dict[str, Any]:
    """Return the contact point: the speed along the momentum, and the modes across it that the
    accuracy asks for, largest first.
    """
    assert isinstance(solution.problem, RollingVeselova)
    side = AlongMomentum(solution).side
    components = (
        NormalComponent.of(solution.frame, solution.inversion, k)
        for k in range(1, solution.curve.genus)
    )
    transverse = [
        largest_modes(find_series(component).scaled(side), solution, 1.0, accuracy)
        for component in components
    ]
    return {
        "radius": float(ball.ball.radius),
        "position": [float(x) for x in ball.ball.contact],
        "speed": solution.problem.speed,
        "transverse": transverse,
    }


def _reduction(solution: Solution) -> dict[str, Any] | None:
    """Return the basis and the waves in which theta sums do not cancel, where the plain sum would;
    None elsewhere.
    """
    T = np.asarray(solution.periods.riemann_matrix)
    if float(np.linalg.eigvalsh(T)[0]) >= _LEAST_EIGENVALUE:
        return None
    coordinates = Theta(T).coordinates
    return {"basis": coordinates.U.tolist(), "waves": list(coordinates.harmonics)}


def _error(solution: Solution, steepest: float, accuracy: float) -> dict[str, float]:
    """Return the bound of q and the frame at every time: that of the engine wherever on the torus
    the state is, and how it grows, and what modes left out may make.
    """
    cycle = 1 / solution.fastest
    far = _CYCLES * cycle
    plan = EvaluationPlan.of(solution, np.array([cycle, far]), "theta", "fourier")
    bound = ErrorBound(solution, "theta").anywhere(plan, plan.make_time_map(solution), steepest)
    at_start, later = (_OWN_ROUNDING * bound).tolist()
    of_rates = (float(solution.sensitivity.by_rates) + steepest) / solution.mean_rate
    growth = max(later - at_start, 2 * _OWN_ROUNDING * np.finfo(float).eps * of_rates * far)
    return {
        # Neumann's time has no modes
        "at_start": at_start + (accuracy if solution.problem.time != "tau1" else 0.0),
        "per_unit_time": growth / far,
        "per_cycle": growth / _CYCLES,
    }


def _growth_of_slow_modes(solution: Solution, steepest: float, parts: dict[str, Any]) -> float:
    """Return by how much the error grows in a unit of time because frequencies are doubles: m·f of
    a mode that nearly stands, as at a resonance, is off by roundings of each f.

    Over a time τ₁ a mode 2c cos is then off by 2c τ₁ min(τ₁, 1/(πm·f)) of them. The bound is linear
    up to _FAR_CYCLES.
    """
    f = np.array(parts["frequencies"])
    mean = float(parts["mean_rate"])
    body = steepest / solution.tau1_unit
    longest = _FAR_CYCLES / float(np.max(np.abs(f)))

    def growth(modes: Any, coefficients: list[float]) -> float:
        orders = np.array(modes, dtype=float).reshape(-1, len(f))
        sizes = np.abs(orders) @ np.abs(f)
        pace = np.abs(orders @ f)
        slow = pace < _SLOW * sizes
        reaches = np.pi / (np.pi * pace[slow] + 1 / longest)
        off = 2 * np.finfo(float).eps * sizes[slow] * reaches
        return float(2 * np.abs(np.array(coefficients)[slow]) @ off) / mean

    of_time = growth(parts["modes"], parts["coefficients"])
    if "area" in parts:
        of_time += growth(parts["area"]["odd"]["modes"], parts["area"]["odd"]["coefficients"])
    found = body * of_time / mean
    if "path" not in parts:
        return found
    found += sum(growth(x["modes"], x["coefficients"]) for x in parts["path"]["transverse"])
    return max(1.0, float(parts["path"]["radius"])) * found
