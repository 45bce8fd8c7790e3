"""The closed form of a motion on its torus as a document: the kernel's numbers by their names."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.closed.motion import KernelMotion
from veselova.analytic.closed.quotients import Quotients
from veselova.analytic.closed.series import ODD, RATE, Series, series_of
from veselova.analytic.kernel import document as kernel_document
from veselova.analytic.kernel import frame as kernel_frame
from veselova.analytic.kernel.rate import NEUMANN
from veselova.analytic.theta.siegel_terms import short_sum
from veselova.mechanics.core.errors import Unsolved

__all__ = ["Flow", "document_of", "growth_of_slow_modes", "largest_modes"]

Array = NDArray[np.float64]

_EPSILON = float(np.finfo(float).eps)

#: Budget: modes from which a document is refused: some ten megabytes.
_MOST_MODES = 400_000

#: Derived: least eigenvalue of T for which the plain sum keeps its digits: θ(z) stays above
#: exp(−π/(4·0.2)) = 0.02 of θ(0).
_LEAST_EIGENVALUE = 0.2

#: Derived: cycles of the fastest phase over which the growth of the error is taken: fewer than
#: those from which the engine carries frequencies with more digits than a document has.
_FAR = 100.0

#: Calibrated: by how much the document's own arithmetic may be off more than the engine's: products
#: of times and rates are rounded once more.
_OWN_ROUNDING = 2.0

#: Derived: part of Σ|m_k f_k| below which m·f has lost digits that the error has to tell of.
_SLOW = 1e-3

#: Budget: cycles of the fastest phase up to which the error of a document in doubles holds.
_FAR_CYCLES = 1e7

#: Budget: points of the torus at which sensitivities are sampled, and the largest genus at which
#: they are at all half periods.
_SAMPLES, _CORNERS = 48, 8


class Flow(NamedTuple):
    """The linear flow on the torus, in units where the largest I that moves is one.

    - frequencies: (g,) f, cycles in τ₁; mean: F_0
    - unit: τ₁ in the problem's units over τ₁ here
    - turning: the most that the frame turns in a unit of the time
    """

    frequencies: Array
    mean: float
    unit: float
    turning: float

    @property
    def fastest(self) -> float:
        """Return the most cycles that a phase makes in a unit of time."""
        return float(np.max(np.abs(self.frequencies))) / self.mean


def document_of(motion: KernelMotion, accuracy: float) -> tuple[dict[str, Any], Flow, Series]:
    """Return the fields from times to the attitude, with the error; the flow; and the series of the
    odd part of d(time)/dτ₁, which has no modes without an area constant.

    ``accuracy``: what modes left out may make. Raises Unsolved where theta functions or modes are
    too many.
    """
    torus, time = motion.torus, motion.problem.time
    quotients, steepest = Quotients.of(torus, motion.room), _sensitivities(motion)
    none = Series(np.empty((0, motion.genus), np.int64), np.empty(0), 0.0, 0.0)
    even = none if torus.time[0] == NEUMANN else series_of(torus, RATE)
    odd = series_of(torus, ODD) if torus.tilt[0] else none
    blurs = [_blur(series, torus.frequencies / 2) for series in (even, odd)]
    blur = math.hypot(blurs[0][0], blurs[1][0]), blurs[0][1] + blurs[1][1]
    at_start, growth = _bounds(motion, quotients, blur, steepest)
    *_, frequencies, mean = motion.exact_flow  # rounded once: a document goes far with them
    turning = float(steepest[0, kernel_frame.BY_TIME])
    flow = Flow(frequencies, mean, math.sqrt(motion.moving.unit), turning)
    # a mode moves the frame by what that turns in the time
    orders, coefficients = largest_modes(even, flow, turning, accuracy / 2)
    growth += turning * growth_of_slow_modes(flow, orders, coefficients)
    fields = {
        **_attitude(motion, quotients),
        "phases": torus.z.tolist(),
        "frequencies": (frequencies / flow.unit).tolist(),
        "mean_rate": mean / flow.unit,
        "modes": (orders // 2).tolist(),
        "coefficients": coefficients,
        "rate": {
            "characteristic": int(quotients.places[2 * motion.genus]),
            "constant": quotients.rate / flow.unit,
            "power": quotients.power,
        },
        "units": {"time": time, "phases": "cycles", "frequencies": "cycles per unit of tau1"},
        "error": {
            "at_start": at_start + (accuracy if time != "tau1" else 0.0),  # which has no modes
            "per_unit_time": growth,
            "per_cycle": growth / flow.fastest,
        },
    }
    return fields, flow, odd


def _attitude(motion: KernelMotion, quotients: Quotients) -> dict[str, Any]:
    """Return the fields from phases to the attitude."""
    problem, moving, g, m = motion.problem, motion.moving, motion.genus, motion.moving.size
    pairs = [list(pair) for pair in zip(quotients.places.tolist(), quotients.constants.tolist())]
    columns = [pairs[m + g + k :: g] for k in range(g)]
    T, unit = quotients.theta.tau.imag, math.sqrt(moving.unit)
    # digits of a natural frame take milliseconds
    frozen = motion.frozen_part if moving.frozen else np.zeros((problem.n, problem.n - 1))
    return {
        "genus": g,
        "A": problem.A.tolist(),
        "axes": None if problem.axes is None else problem.axes.tolist(),
        "riemann_matrix": T.tolist(),
        "reduction": _reduction(T),
        "characteristics": quotients.functions.tolist(),
        "q": pairs[:m],
        "q_prime": [[place, value / unit] for place, value in pairs[m : m + g]],
        "normals": columns[:-1],
        "gamma": columns[-1],
        "rotation": motion.turn.tolist(),
        "directions": moving.directions.tolist(),
        "frozen": frozen.tolist(),
    }


def _reduction(T: Array) -> dict[str, Any] | None:
    """Return the basis and the waves in which theta sums do not cancel, where the plain sum would;
    None elsewhere.
    """
    if float(np.linalg.eigvalsh(T)[0]) >= _LEAST_EIGENVALUE:
        return None
    basis, harmonics = short_sum(T)
    return {"basis": basis.tolist(), "waves": harmonics}


def largest_modes(
    series: Series, flow: Flow, factor: float, accuracy: float
) -> tuple[NDArray[np.int64], list[float]]:
    """Return the doubled modes of a function whose integral over τ₁, times a factor, is wanted to
    an accuracy, largest first, and their coefficients per unit of the problem's τ₁.

    A mode moves the integral by at most 2|c|/(π|m·f|); the effects of those left out add up to the
    accuracy at most. Coefficients are rounded to decimal places, which changes a fourth of it.
    """
    orders, f = series.orders, flow.frequencies / 2
    # at a resonance m·f is zero to rounding
    pace = np.maximum(np.abs(orders @ f), _EPSILON * (np.abs(orders) @ np.abs(f)))
    reaches = 2 * factor / (np.pi * pace)
    effects = np.abs(series.coefficients) * reaches
    order = np.argsort(-effects, kind="stable")
    left_out = np.cumsum(effects[order][::-1])[::-1]
    kept = order[left_out > accuracy]
    if kept.size > _MOST_MODES:
        raise Unsolved(
            "too-many-modes",
            f"there are {kept.size} modes above {accuracy:g}, and {_MOST_MODES} can be kept",
        )
    least = np.maximum(reaches[kept], np.finfo(float).tiny)
    steps = accuracy / (2 * max(1, kept.size) * least) / flow.unit
    places = [min(300, max(0, -math.floor(math.log10(step)))) for step in steps.tolist()]
    values = (series.coefficients[kept] / flow.unit).tolist()
    return orders[kept], [round(*pair) for pair in zip(values, places, strict=True)]


def growth_of_slow_modes(flow: Flow, orders: Any, coefficients: list[float]) -> float:
    """Return by how much a sum over doubled modes (M, g) grows wrong in a unit of time because
    frequencies are doubles: m·f of a mode that nearly stands, as at a resonance, is off by
    roundings of each f.

    Over a time τ₁ a mode 2c cos is then off by 2c τ₁ min(τ₁, 1/(πm·f)) of them. The bound is linear
    up to _FAR_CYCLES.
    """
    f, mean = flow.frequencies / flow.unit, flow.mean / flow.unit
    longest = _FAR_CYCLES / float(np.max(np.abs(f)))
    orders = np.array(orders, dtype=float).reshape(-1, f.size) / 2
    sizes, pace = np.abs(orders) @ np.abs(f), np.abs(orders @ f)
    slow = pace < _SLOW * sizes
    reaches = np.pi / (np.pi * pace[slow] + 1 / longest)
    off = 2 * _EPSILON * sizes[slow] * reaches
    return float(2 * np.abs(np.array(coefficients)[slow]) @ off) / mean


def _sensitivities(motion: KernelMotion) -> Array:
    """Return the largest sensitivities of the frame and of X on the torus, (2, 5), of
    ``kernel.frame``.

    On flat or needle-like ellipsoids dt/dτ₁ is far below its mean F_0 at some half period, where
    all λ_s are branch points; sampled points miss the neighbourhood of such a point.
    """
    g, torus = motion.genus, motion.torus
    psi = [torus.psi[None], np.random.default_rng(g).uniform(0.0, 2 * np.pi, (_SAMPLES, g))]
    if g <= _CORNERS:
        psi.append(np.pi * (np.arange(2**g)[:, None] >> np.arange(g) & 1))
    points = np.concatenate(psi)
    found = np.empty((len(points), 2, 5))
    kernel_document.set_sensitivities(torus, points, motion.room, found)
    return np.asarray(kernel_frame.BETWEEN * np.max(found, axis=0))


def _bounds(
    motion: KernelMotion, quotients: Quotients, blur: tuple[float, float], steepest: Array
) -> tuple[float, float]:
    """Return the bound of q and the frame at t = 0, wherever on the torus the state is, and what it
    grows by in a unit of time: of ``kernel.frame``, with the quotients in the place of the frame.
    blur: of ``_blur``.
    """
    torus, mean = motion.torus, float(motion.torus.mean[0])
    together, by_flow, added, by_time, _ = steepest.T
    at_start = quotients.rounding + _EPSILON * kernel_frame.PHASE * together
    at_start += kernel_frame.MAP * blur[0] * by_time
    at_start += kernel_frame.LEFT_OUT * kernel_frame.series_tail(torus) * added
    growth = _EPSILON * (kernel_frame.FLOW * by_flow / mean)
    growth += (_EPSILON * kernel_frame.TIME + kernel_frame.MAP * blur[1] / mean) * by_time
    far = _FAR / motion.fastest
    times = np.array([0.0, far])
    errors = motion.to_axes(at_start[:, None] + growth[:, None] * times)
    first, last = (_OWN_ROUNDING * errors).tolist()
    return first, (last - first) / far


def _blur(series: Series, f: Array) -> tuple[float, float]:
    """Return by what the errors of coefficients, and the rounding of their sum, move the time, and
    what those of modes that nearly stand make of it in a unit of τ₁; f: (g,) half the frequencies.
    """
    sizes, pace = np.abs(series.orders) @ np.abs(f), np.abs(series.orders @ f)
    slow = pace < _SLOW * sizes
    orders, pace = np.abs(series.orders[~slow]), np.pi * pace[~slow]
    amplitudes = np.abs(series.coefficients[~slow]) / pace
    rounding = _EPSILON * amplitudes * (1 + np.pi * np.max(orders, axis=1, initial=0))
    blur = math.sqrt(float(np.sum(rounding**2 + (series.off / pace) ** 2)))
    return blur, 2 * series.off * math.sqrt(np.count_nonzero(slow))
