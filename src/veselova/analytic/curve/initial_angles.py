"""Where a motion begins on the torus: the angles ψ_s(0) on the cuts and the constant signs ς_i of
q_i.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.curve.hyperelliptic import Curve
from veselova.analytic.curve.interval import Interval
from veselova.analytic.spectrum.branch_points import Spectrum, difference

__all__ = ["Start", "start"]


@dataclass(frozen=True)
class Start:
    """Where a motion begins: angles (g,) in (−π, π], small ones to their own last bit, and the
    constant signs (n,) of the q_i.

    The signs go along sorted axes and stand against the roots of analytic.frame.
    """

    angles: Values
    signs: Values


def start(spectrum: Spectrum, curve: Curve) -> Start:
    """Return the start of a generic motion; λ_s − b comes from the digits of the spectrum."""
    with spectrum.working():
        increasing = [_direction(spectrum, x) for x in spectrum.spheroconic]
    angles = [
        Interval(curve, 2 * s + 1).points.angle(*spectrum.on_cuts[s], up)
        for s, up in enumerate(increasing)
    ]
    signs = []
    for i, (position, velocity) in enumerate(zip(spectrum.q, spectrum.q_prime, strict=True)):
        b = curve.place["I", i]
        lower_end = b % 2 == 1
        s = curve.cut_of(b) - 1
        if position == 0 or spectrum.on_cuts[s][0 if lower_end else 1] == 0:
            # The root passes zero with ψ: upwards along sn at ψ = 0, downwards along cn at ψ = π.
            signs.append((1 if velocity > 0 else -1) * (1 if lower_end else -1))
        else:
            # for ψ in (−π, π) sn has its sign and cn is positive, which ψ rounded to π no longer
            # tells
            root_positive = increasing[s] or not lower_end
            signs.append((1 if position > 0 else -1) * (1 if root_positive else -1))
    return Start(curve.arithmetic.array(angles), curve.arithmetic.array(signs))


def _direction(spectrum: Spectrum, point: Any) -> bool:
    """Return whether λ_s increases: λ' = 2 Σ q_iq_i'/(λ−I_i) / Σ q_i²/(λ−I_i)²; at an end of the
    cut it does not matter.
    """
    slope: Any = 0
    for q, v, inverse in zip(spectrum.q, spectrum.q_prime, spectrum.inverse, strict=True):
        distance = difference(point, inverse)
        if distance == 0:
            return True
        slope += q * v / distance
    return bool(slope >= 0)
