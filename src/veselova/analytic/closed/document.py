"""The closed form of a motion as a document: its fields from the numbers of a torus, and these
numbers by the kernel.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.closed.coefficients import find_coefficients
from veselova.analytic.closed.motion import KernelMotion
from veselova.analytic.closed.quotients import Quotients
from veselova.analytic.closed.series import Series, series_of
from veselova.analytic.kernel import document as kernel_document
from veselova.analytic.kernel import error as kernel_error
from veselova.analytic.kernel.rate import NEUMANN
from veselova.analytic.kernel.weights import ODD
from veselova.analytic.spectrum.moving_part import Moving
from veselova.analytic.theta.lattice import short_sum
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.systems.torus_problem import TorusProblem

__all__ = [
    "FAR",
    "OWN_ROUNDING",
    "DocumentParts",
    "Modes",
    "fields_of",
    "growth_of_slow_modes",
    "largest",
    "parts_of",
]

Array = NDArray[np.float64]

_EPSILON = float(np.finfo(float).eps)

#: Budget: modes from which a document is refused: some ten megabytes.
_MOST_MODES = 400_000

#: Derived: least eigenvalue of T for which the plain sum keeps its digits: θ(z) stays above
#: exp(−π/(4·0.2)) = 0.02 of θ(0).
_LEAST_EIGENVALUE = 0.2

#: Derived: cycles of the fastest phase over which the growth of the error is taken: fewer than
#: those from which the engine carries frequencies with more digits than a document has.
FAR = 100.0

#: Calibrated: by how much the document's own arithmetic may be off more than the engine's: products
#: of times and rates are rounded once more.
OWN_ROUNDING = 2.0

#: Derived: part of Σ|m_k f_k| below which m·f has lost digits that the error has to tell of.
_SLOW = 1e-3

#: Budget: cycles of the fastest phase up to which the error of a document in doubles holds.
_FAR_CYCLES = 1e7

#: Budget: points of the torus at which sensitivities are sampled, and the largest genus at which
#: they are at all half periods.
_SAMPLES, _CORNERS = 48, 8


class Modes(NamedTuple):
    """Modes (M, g) of d(time)/dτ₁, and their coefficients F_m (M,)."""

    orders: NDArray[np.int64]
    coefficients: Array


@dataclass(frozen=True)
class DocumentParts:
    """The numbers of a document, in units where the largest I that moves is one.

    - problem: that on whose torus the motion runs; moving: what of it moves
    - quotients: the attitude and the rate by theta functions
    - rotation: (g, n−1) ℜ; frozen: (n, n−1) what stays of e_2 … e_n
    - phases: (g,) z⁰; frequencies: (g,) f, cycles in τ₁; mean: F_0
    - fastest_turn: the most that the frame turns in a unit of the time
    - modes: those of the even part of the time map; odd: the series of d(time)/dτ₁'s odd part
    - at_start, growth: the bound of q and the frame at t = 0, and its growth in a unit of time
    """

    problem: TorusProblem
    moving: Moving
    quotients: Quotients
    rotation: Array
    frozen: Array
    phases: Array
    frequencies: Array
    mean: float
    fastest_turn: float
    modes: Modes
    odd: Series | None
    at_start: float
    growth: float

    @property
    def unit(self) -> float:
        """Return τ₁ in the problem's units over τ₁ here."""
        return math.sqrt(self.moving.unit)

    @property
    def fastest(self) -> float:
        """Return the most cycles that a phase makes in a unit of time."""
        return float(np.max(np.abs(self.frequencies))) / self.mean


def fields_of(parts: DocumentParts, accuracy: float) -> dict[str, Any]:
    """Return the fields from times to the attitude, and the error.

    ``accuracy``: what modes left out may make. Raises Unsolved (``too-many-modes``).
    """
    unit, time = parts.unit, parts.problem.time
    # a mode moves the frame by what that turns in the time
    orders, coefficients = largest(
        parts, parts.modes, parts.frequencies, parts.fastest_turn, accuracy / 2
    )
    slow = growth_of_slow_modes(parts, orders, coefficients)
    growth = parts.growth + parts.fastest_turn * slow
    # Neumann's time has no modes
    at_start = parts.at_start + (accuracy if time != "tau1" else 0.0)
    return {
        **_attitude(parts),
        "phases": parts.phases.tolist(),
        "frequencies": (parts.frequencies / unit).tolist(),
        "mean_rate": parts.mean / unit,
        "modes": orders.tolist(),
        "coefficients": coefficients,
        "rate": {
            "characteristic": int(parts.quotients.places[2 * parts.phases.size]),
            "constant": parts.quotients.rate / unit,
            "power": parts.quotients.power,
        },
        "units": {"time": time, "phases": "cycles", "frequencies": "cycles per unit of tau1"},
        "error": {
            "at_start": at_start,
            "per_unit_time": growth,
            "per_cycle": growth / parts.fastest,
        },
    }


def _attitude(parts: DocumentParts) -> dict[str, Any]:
    """Return the fields from phases to the attitude."""
    quotients = parts.quotients
    axes, g, m = parts.problem.axes, parts.phases.size, parts.moving.size
    pairs = [list(pair) for pair in zip(quotients.places.tolist(), quotients.constants.tolist())]
    columns = [pairs[m + g + k :: g] for k in range(g)]
    return {
        "genus": g,
        "A": parts.problem.A.tolist(),
        "axes": None if axes is None else axes.tolist(),
        "riemann_matrix": quotients.theta.tau.imag.tolist(),
        "reduction": _reduction(quotients.theta.tau.imag),
        "characteristics": [
            [[e / 2 for e in c.epsilon], [d / 2 for d in c.delta]] for c in quotients.functions
        ],
        "q": pairs[:m],
        "q_prime": [[place, value / parts.unit] for place, value in pairs[m : m + g]],
        "normals": columns[:-1],
        "gamma": columns[-1],
        "rotation": parts.rotation.tolist(),
        "directions": parts.moving.directions.tolist(),
        "frozen": parts.frozen.tolist(),
    }


def _reduction(T: Array) -> dict[str, Any] | None:
    """Return the basis and the waves in which theta sums do not cancel, where the plain sum would;
    None elsewhere.
    """
    if float(np.linalg.eigvalsh(T)[0]) >= _LEAST_EIGENVALUE:
        return None
    basis, harmonics = short_sum(T)
    return {"basis": basis.tolist(), "waves": harmonics}


def largest(
    parts: DocumentParts, modes: Modes, f: Array, factor: float, accuracy: float
) -> tuple[NDArray[np.int64], list[float]]:
    """Return the modes of a function whose integral over τ₁, times a factor, is wanted to an
    accuracy, largest first, and their coefficients per unit of the problem's τ₁; f: (g,) the cycles
    in τ₁ of the phases that orders are multiplied with.

    A mode moves the integral by at most 2|c|/(π|m·f|); the effects of those left out add up to the
    accuracy at most. Coefficients are rounded to decimal places, which changes a fourth of it.
    """
    orders = modes.orders
    # at a resonance m·f is zero to rounding
    pace = np.maximum(np.abs(orders @ f), _EPSILON * (np.abs(orders) @ np.abs(f)))
    reaches = 2 * factor / (np.pi * pace)
    effects = np.abs(modes.coefficients) * reaches
    order = np.argsort(-effects, kind="stable")
    left_out = np.cumsum(effects[order][::-1])[::-1]
    kept = order[left_out > accuracy]
    if kept.size > _MOST_MODES:
        raise Unsolved(
            "too-many-modes",
            f"there are {kept.size} modes above {accuracy:g}, and {_MOST_MODES} can be kept",
        )
    least = np.maximum(reaches[kept], np.finfo(float).tiny)
    steps = accuracy / (2 * max(1, kept.size) * least) / parts.unit
    places = [min(300, max(0, -math.floor(math.log10(step)))) for step in steps.tolist()]
    values = (modes.coefficients[kept] / parts.unit).tolist()
    return orders[kept], [round(*pair) for pair in zip(values, places, strict=True)]


def growth_of_slow_modes(parts: DocumentParts, orders: Any, coefficients: list[float]) -> float:
    """Return by how much a sum over modes (M, g) grows wrong in a unit of time because frequencies
    are doubles: m·f of a mode that nearly stands, as at a resonance, is off by roundings of each f.

    Over a time τ₁ a mode 2c cos is then off by 2c τ₁ min(τ₁, 1/(πm·f)) of them. The bound is linear
    up to _FAR_CYCLES.
    """
    f, mean = parts.frequencies / parts.unit, parts.mean / parts.unit
    longest = _FAR_CYCLES / float(np.max(np.abs(f)))
    orders = np.array(orders, dtype=float).reshape(-1, f.size)
    sizes, pace = np.abs(orders) @ np.abs(f), np.abs(orders @ f)
    slow = pace < _SLOW * sizes
    reaches = np.pi / (np.pi * pace[slow] + 1 / longest)
    off = 2 * _EPSILON * sizes[slow] * reaches
    return float(2 * np.abs(np.array(coefficients)[slow]) @ off) / mean


def parts_of(motion: KernelMotion) -> DocumentParts:
    """Return the numbers of the document of a motion. Raises Unsolved where theta functions or
    modes are too many.
    """
    torus, n = motion.torus, motion.problem.n
    quotients = Quotients.of(motion)
    modes, off = Modes(np.empty((0, motion.genus), np.int64), np.empty(0)), 0.0
    if torus.time[0] != NEUMANN:
        orders, coefficients, off = find_coefficients(torus)
        modes = Modes(orders, coefficients)
    steepest = _sensitivities(motion)
    blur = _blur(modes, torus.frequencies, off)
    odd = None
    if torus.tilt[0]:
        odd = series_of(torus, ODD)
        rounding = _EPSILON * float(np.max(np.abs(odd.coefficients), initial=0.0))
        of_odd = Modes(odd.orders, odd.coefficients)
        further = _blur(of_odd, torus.frequencies / 2, rounding)
        blur = math.hypot(blur[0], further[0]), blur[1] + further[1]
    at_start, growth = _bounds(motion, quotients, blur, steepest)
    *_, frequencies, mean = motion.exact_flow  # rounded once: a document goes far with them
    return DocumentParts(
        motion.problem,
        motion.moving,
        quotients,
        motion.turn,
        # digits of a natural frame take milliseconds
        motion.frozen_part if motion.moving.frozen else np.zeros((n, n - 1)),
        torus.z,
        frequencies,
        mean,
        float(steepest[0, kernel_error.BY_TIME]),
        modes,
        odd,
        at_start,
        growth,
    )


def _sensitivities(motion: KernelMotion) -> Array:
    """Return the largest sensitivities of the frame and of X on the torus, (2, 5), of
    ``kernel.error``.

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
    return np.asarray(kernel_error.BETWEEN * np.max(found, axis=0))


def _bounds(
    motion: KernelMotion, quotients: Quotients, blur: tuple[float, float], steepest: Array
) -> tuple[float, float]:
    """Return the bound of q and the frame at t = 0, wherever on the torus the state is, and what it
    grows by in a unit of time: of ``kernel.error``, with the quotients in the place of the frame.
    blur: of ``_blur``.
    """
    torus, mean = motion.torus, float(motion.torus.mean[0])
    together, by_flow, added, by_time, _ = steepest.T
    cancelling = float(torus.cancellation[0])
    at_start = quotients.rounding + _EPSILON * kernel_error.PHASE * cancelling * together
    at_start += kernel_error.MAP * blur[0] * by_time
    at_start += kernel_error.LEFT_OUT * kernel_error.series_tail(torus) * added
    growth = _EPSILON * (kernel_error.FLOW * cancelling * by_flow / mean)
    growth += (_EPSILON * kernel_error.TIME + kernel_error.MAP * blur[1] / mean) * by_time
    far = FAR / motion.fastest
    times = np.array([0.0, far])
    errors = motion.to_axes(at_start[:, None] + growth[:, None] * times)
    first, last = (OWN_ROUNDING * errors).tolist()
    return first, (last - first) / far


def _blur(modes: Modes, f: Array, off: float) -> tuple[float, float]:
    """Return by what coefficients that are off by so much, and the rounding of their sum, move the
    time, and what those of modes that nearly stand make of it in a unit of τ₁.
    """
    sizes, pace = np.abs(modes.orders) @ np.abs(f), np.abs(modes.orders @ f)
    slow = pace < _SLOW * sizes
    orders, pace = np.abs(modes.orders[~slow]), np.pi * pace[~slow]
    amplitudes = np.abs(modes.coefficients[~slow]) / pace
    rounding = _EPSILON * amplitudes * (1 + 2 * np.pi * np.max(orders, axis=1, initial=0))
    blur = math.sqrt(float(np.sum(rounding**2 + (off / pace) ** 2)))
    return blur, 2 * off * math.sqrt(np.count_nonzero(slow))
