"""The attitude as theta quotients with one common denominator, from the kernel's torus (section 4).

    q_i = κ_i θ[η(I_i)]/θ,   v_k = (q', n_k) = κ_k θ[η(c_k)]/θ,   (n_k)_i = κ_ik θ[η(I_i)+η(c_k)]/θ,
        γ the case c_1 = 0,   d(time)/dτ₁ = constant · |θ[η(c_1)]/θ|^power

The constants κ come from half periods z = ½ν, where every λ_s is a branch point and the frame is
exact: for each function the half period at which it is largest against its denominator.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.closed.motion import KernelMotion
from veselova.analytic.closed.torus import riemann_matrix
from veselova.analytic.kernel import document
from veselova.analytic.kernel.rate import tilted
from veselova.analytic.theta.characteristic import Characteristic, functions_of_attitude
from veselova.analytic.theta.siegel_theta import SiegelTheta
from veselova.analytic.time_map.rate import TIME_RATE_POWERS
from veselova.mechanics.core.errors import Unsolved

__all__ = ["Quotients", "require_theta"]

Array = NDArray[np.float64]

_EPSILON = float(np.finfo(float).eps)

#: Budget: terms of all functions together: 4 GB of tables; and a genus at which no sum is as short.
_MOST_TERMS = 2.5e8
_LARGEST_GENUS = 18

#: Calibrated: rounding of one evaluation of the quotients, in ε, largest seen over the problem
#: tables, for each unit of the largest entry of T, whose rounding stands in an exponent.
_EVALUATION = 20.0


def require_theta(T: Array) -> SiegelTheta:
    """Return the theta functions of T (g, g). Raises Unsolved where their tables would fill the
    memory (``too-many-terms``), or where T leaves the range of floats.
    """
    if not (np.all(np.isfinite(T)) and np.linalg.eigvalsh(T)[0] > 0):
        raise Unsolved(
            "beyond-floats", "periods leave the range of a float: the A's are too far apart"
        )
    theta = SiegelTheta(np.asarray(1j * T))
    functions = len(T) * (len(T) + 3) + 1
    cost = theta.terms if len(T) <= _LARGEST_GENUS else math.inf
    if not cost * functions <= _MOST_TERMS:
        wanted = (
            f"n = {len(T) + 1} takes {functions} theta functions of {min(cost, 1e11):.1e} "
            "terms or more"
        )
        raise Unsolved(
            "too-many-terms",
            f"{wanted}, {_MOST_TERMS:.1e} in all can be kept; angles serve at any n",
        )
    return theta


class AlongOrbit(NamedTuple):
    """At N phases: [q n_2 … γ] (N, m, m), dq/d(time) (N, m), (q',n_2) … (q',γ) (N, m−1),
    d(time)/dτ₁ (N,), and the tilt of it (N,), of ``kernel.rate``.
    """

    frames: Array
    velocities: Array
    slopes: Array
    rates: Array
    tilts: Array


@dataclass(frozen=True)
class Quotients:
    """The theta functions of a torus, and what makes its attitude of them.

    - functions: the characteristics of all functions, that of the denominator first
    - places: (K,) where among them the numerators stand: those of q_1 … q_n, of v_k, and of (n_k)_i
      with i before k; k runs over c_2 … c_g, c_1
    - constants: (K,) κ
    - rate, power: the constant and the exponent of d(time)/dτ₁, its even part; torus: of the kernel
    - rounding: what one evaluation is off by, relative to the size of what is evaluated
    """

    torus: Any
    theta: SiegelTheta
    functions: tuple[Characteristic, ...]
    places: NDArray[np.intp]
    constants: Array
    rate: float
    power: int
    rounding: float

    @classmethod
    def of(cls, motion: KernelMotion) -> Quotients:
        """Return those of a motion's torus. Raises Unsolved as ``require_theta``."""
        torus, g = motion.torus, motion.genus
        T, _, of_B = riemann_matrix(motion)
        theta = require_theta(T)
        of_I, of_c = (tuple(x.tolist()) for x in (torus.of_I, torus.of_c))
        functions, places = functions_of_attitude(of_I, of_c)
        halves, rates = np.empty((2**g, g)), np.empty(2**g)
        entries = np.empty((2**g, len(places)))
        document.set_half_periods(torus, motion.room, halves, entries, rates)
        raw = _over_first(theta, halves / 2, functions)[:, places]
        best, columns = np.argmax(np.abs(raw), axis=0), np.arange(len(places))
        # (q', γ) by least squares over all of them, since an orbit takes its rounding along
        exact, quotient = np.abs(entries[:, 2 * g]), np.abs(raw[:, 2 * g])
        power = TIME_RATE_POWERS[motion.problem.time]
        largest = np.argmax(exact)
        rate = rates[largest] * (exact @ quotient / (quotient @ quotient) / exact[largest]) ** power
        return cls(
            torus,
            theta,
            functions,
            np.array(places),
            entries[best, columns] / raw[best, columns],
            float(rate),
            power,
            _rounding(T, float(torus.cancellation[0]), of_B),
        )

    def at(self, z: Array) -> AlongOrbit:
        """Return what is known at phases modulo 2 (N, g), along what moves."""
        g = z.shape[1]
        raw = _over_first(self.theta, z, self.functions)[:, self.places]
        q, slopes, normals = np.split(raw * self.constants, [g + 1, 2 * g + 1], axis=1)
        frames = np.concatenate([q[:, :, None], normals.reshape(-1, g + 1, g)], axis=2)
        tilts = np.zeros(len(z))
        if self.torus.tilt[0]:
            tilts = np.array([tilted(self.torus, frame) for frame in frames])
        rates = self.rate * np.abs(raw[:, 2 * g]) ** self.power * (1 - tilts)
        velocities = (frames[:, :, 1:] @ slopes[:, :, None])[:, :, 0] / rates[:, None]
        return AlongOrbit(frames, velocities, slopes, rates, tilts)


def _over_first(theta: SiegelTheta, z: Array, functions: tuple[Characteristic, ...]) -> Array:
    """Return the functions at points z (N, g) over the first one, (N, C)."""
    halves = np.array([[c.epsilon, c.delta] for c in functions]) / 2
    mantissas, exponents, _ = theta.values(z.astype(complex), halves, 0, False)
    found = mantissas * np.exp(exponents - exponents[:, :1])
    return np.asarray((found / found[:, :1]).real)


def _rounding(T: Array, of_a: float, of_B: float) -> float:
    """Return the rounding of an evaluation, and what that of T makes of the quotients.

    T is a⁻¹B: a rounding of a moves it by ε of itself for each unit by which its periods cancel,
    and one of B by ε of what cancels there, where that is more; the constants κ have it once more.
    On a Gaussian e^{−πd²/μ}, μ the least eigenvalue, that is at most 1/e = max x e^{−x} of its part
    in μ, which is small near a separatrix.
    """
    size = float(np.max(np.abs(T)))
    off = of_a * size + 2 * max(0.0, of_B - of_a * size)
    of_T = off / (math.e * float(np.linalg.eigvalsh(T)[0]))
    return _EPSILON * (_EVALUATION * max(1.0, size) + of_T)
