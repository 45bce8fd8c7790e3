"""Frequencies for times far out: with digits beyond those of a double, in balls, which are faster
than any other.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.balls import balls
from veselova.analytic.curve.abel_jacobi import AbelJacobi
from veselova.analytic.curve.hyperelliptic import Curve
from veselova.analytic.curve.periods import Periods
from veselova.analytic.spectrum.branch_points import Spectrum
from veselova.analytic.time_map.cost_model import GUARD_DIGITS
from veselova.analytic.time_map.linear_flow import LinearFlow
from veselova.analytic.time_map.rate import TimeRate

__all__ = ["extended_precision_flows"]

#: Derived: digits that balls may lose on the way to the frequencies.
_SPARE = 6


def extended_precision_flows(
    spectrum: Spectrum,
    origin: NDArray[np.float64],
    time: str,
    direction: Sequence[Fraction] | None = None,
) -> tuple[LinearFlow, LinearFlow, float]:
    """Return z(τ₁) = z⁰ + fτ₁, the uniform part z⁰ + (f/F_0)t, and F_0, from z⁰ in double
    precision.

    direction: du/dτ₁ for the nodal differentials, (g,); None for e_g
    """
    with balls(spectrum.arithmetic.digits, certified=False) as fine:
        exact = spectrum.in_arithmetic(fine)
        curve = Curve.of(exact, balls(GUARD_DIGITS + _SPARE, certified=False))
    with balls(GUARD_DIGITS + _SPARE, certified=False):
        periods = Periods(curve)
        mean = TimeRate.of(exact, AbelJacobi(periods), time).mean
        f = periods.frequencies
        if direction is not None:
            f = periods.inverse_cycles @ periods.arithmetic.array(list(direction))
        of_tau1, of_time = (LinearFlow.of(origin, rates) for rates in (f, f / mean))
    return of_tau1, of_time, float(mean)
