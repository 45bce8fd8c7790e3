"""The displacement of a rolling ball in ball arithmetic: integrals of functions on the torus along
the orbit, on Chebyshev panels.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.attitude.frame import Attitude
from veselova.analytic.time_map.analyticity_strip import GeneralOrbit, Orbit
from veselova.analytic.time_map.panels_balls import ChebyshevTimeMapInBalls

__all__ = ["Along", "integrals"]

#: Derived: what is added to a function of order one, so that its integral increases as a time does.
_OFFSET = 3

#: A function on the torus, of order one, at attitudes (N,).
Along = Callable[[Attitude], Values]


def integrals(
    orbit: Orbit,
    attitude: Callable[[Values], Attitude],
    functions: list[Along],
    tau1: Values,
) -> Values:
    """Return the integrals of the functions over τ₁ from zero, (N, K), at Neumann times (N,).

    Truncation is estimated from the last coefficients. Raises Unsolved (``too-far``) where there
    are more nodes than are kept.
    """
    xp: Any = orbit.rate.inversion.arithmetic
    found = xp.array(np.zeros((len(tau1), len(functions))))
    approximate = tau1.astype(float)
    if not np.any(approximate):
        return np.asarray(found)
    together = _Together(attitude, functions)
    for k in range(len(functions)):
        raised = GeneralOrbit(
            orbit.spectrum,
            orbit.rate,
            orbit.start,
            orbit.frequencies,
            None,
            None,
            partial(together.raised, k),
            getattr(orbit, "slower", 1.0),
        )
        panels = ChebyshevTimeMapInBalls(raised, approximate, False)
        found[:, k] = panels.integral(tau1) - _OFFSET * tau1
    return np.asarray(found)


@dataclass(frozen=True)
class _Together:
    """Functions that are asked for at the same phases, one after the other: they share the
    attitudes.
    """

    attitude: Callable[[Values], Attitude]
    functions: list[Along]
    known: dict[tuple[float, ...], list[Values]] = field(default_factory=dict)

    def raised(self, k: int, z: Values) -> Values:
        """Return function k, and the offset, at phases (N, g)."""
        ends = np.concatenate([z[0], z[len(z) // 2], z[-1]]).astype(float)
        key = (float(len(z)), *ends.tolist())
        if key not in self.known:
            attitude = self.attitude(z)
            self.known[key] = [function(attitude) + _OFFSET for function in self.functions]
        return np.asarray(self.known[key][k])
