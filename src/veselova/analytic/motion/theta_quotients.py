"""The attitude as theta quotients with one common denominator.

    q_i = κ_i θ[η(I_i)]/θ,   v_k = (q', n_k) = κ_k θ[η(c_k)]/θ,   (n_k)_i = κ_ik θ[η(I_i)+η(c_k)]/θ,
        γ the case c_1 = 0.

The constants κ come from half periods z = ½ν, where every λ_s is a branch point and the closed
formula of analytic.attitude.frame is
exact: for each function the half period at which it is largest against its denominator.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import DOUBLE
from veselova.analytic.attitude.frame import Attitude, Frame
from veselova.analytic.closed.quotients import require_theta
from veselova.analytic.theta.characteristic import Characteristic, functions_of_attitude
from veselova.analytic.theta.riemann_theta import Theta
from veselova.analytic.theta.riemann_theta_balls import ThetaInBalls

__all__ = ["ThetaQuotients"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ThetaQuotients:
    """The theta route to the attitude of one torus; agrees with Frame after Abel–Jacobi inversion,
    and shares only κ with it.

    ``at_half_periods``: the attitudes at the frame's half periods, where they are known already ·
    ``cost``: ``Theta.cost``.
    """

    theta: Theta | ThetaInBalls
    frame: Frame
    at_half_periods: Attitude | None = None
    cost: float = math.inf

    @classmethod
    def of(cls, T: Array, frame: Frame) -> ThetaQuotients:
        """Return the route in double precision.

        Raises Unsolved where its tables would fill the memory (``too-many-terms``), or where T
        leaves the range of floats.
        """
        theta = require_theta(T)
        return cls(theta, frame, cost=theta.cost)

    @cached_property
    def functions(self) -> tuple[Characteristic, ...]:
        """Return the characteristics of all functions once: that of the denominator, then those of
        the numerators.
        """
        return self._functions[0]

    @cached_property
    def places(self) -> NDArray[np.intp]:
        """Return where among the functions the numerator of each constant κ stands: of q_1 … q_n,
        of v_k, and of (n_k)_i with i before k; k runs over c_2 … c_{n−1}, c_1.
        """
        return np.array(self._functions[1])

    @cached_property
    def _functions(self) -> tuple[tuple[Characteristic, ...], tuple[int, ...]]:
        curve = self.frame.periods.curve
        of_I, of_c = (tuple(map(int, curve.layout(kind).places)) for kind in ("I", "c"))
        return functions_of_attitude(of_I, of_c)

    def _raw(self, values: Array) -> Array:
        """Return θ[η]/θ in the order of the constants, shape (N, n + g + n·g), from values of the
        functions.
        """
        return np.asarray((values / values[:, :1])[:, self.places])

    @cached_property
    def constants(self) -> Array:
        """Return the κ's in the order of the functions."""
        return self._from_half_periods[0]

    def _half_period_attitudes(self) -> Attitude:
        """Return the attitudes at the half periods, made where they are not known."""
        return self.at_half_periods or self.frame.at(
            self.frame.periods.arithmetic.pi * self.frame.half_periods
        )

    @cached_property
    def _from_half_periods(self) -> tuple[Array, Array, Array]:
        """Return the κ's, and (q',γ) and the quotient of its function at all half periods, (2^g,)
        both.
        """
        half_periods = self.frame.half_periods
        attitude = self._half_period_attitudes()
        exact = np.concatenate(
            [attitude.q, attitude.components, attitude.normals.reshape(len(half_periods), -1)],
            axis=1,
        )
        raw = self._raw(self.theta.values(half_periods / 2, self.functions))
        best = np.argmax(np.abs(raw.astype(float)), axis=0)
        columns = np.arange(raw.shape[1])
        of_stretch = 2 * self.theta.genus
        constants = np.asarray(exact[best, columns] / raw[best, columns])
        return constants, exact[:, of_stretch].copy(), raw[:, of_stretch].copy()

    def peak_inverted(self, power: int) -> float:
        """Return 1 over the largest value on the torus of a power of the stretch.

        It is known at half periods, where (q',γ), which is the stretch but for a constant, is
        exact; that is found by least squares over all of them, since an orbit takes its rounding
        along.
        """
        exact, raw = map(np.abs, self._stretch_at_half_periods())
        return float(((exact @ raw) / (raw @ raw)) ** power / np.max(exact**power))

    def _stretch_at_half_periods(self) -> tuple[Array, Array]:
        """Return (q',γ) and the quotient of its function there, (2^g,) both: by these two alone
        where the attitude takes none.
        """
        if self.at_half_periods is not None:
            return self._from_half_periods[1:]
        values = self.theta.values(self.frame.half_periods / 2, self._of_stretch)
        return self._half_period_attitudes().components[:, -1], np.asarray(
            values[:, 1] / values[:, 0]
        )

    @property
    def _of_stretch(self) -> list[Characteristic]:
        """Return the characteristics of the denominator and of c_1 = 0."""
        return [self.functions[0], self.functions[self.places[2 * self.theta.genus]]]

    @cached_property
    def rounding(self) -> float:
        """Return what the rounding of T makes of the quotients, in double precision.

        T is a⁻¹B: a rounding of a moves it by ε of itself for each unit by which its periods
        cancel, and one of B by ε of what cancels there, where that is more; the constants κ have it
        once more. On a Gaussian e^{−πd²/μ}, μ the least eigenvalue, that is at most 1/e = max x
        e^{−x} of its part in μ, which is small near a separatrix.
        """
        periods = self.frame.periods
        T = np.asarray(periods.riemann_matrix, dtype=np.float64)
        of_a = max(1.0, float(np.max(periods.cancellation))) * float(np.max(np.abs(T)))
        of_B = float(np.max(periods.conjugate_cancellation))
        off = DOUBLE.epsilon * (of_a + 2 * max(0.0, of_B - of_a))
        return off / (math.e * float(np.linalg.eigvalsh(T)[0]))

    def time_rate(self, z: Array) -> Array:
        """Return |θ[η(0)]/θ| at points z of shape (N, g), where c_1 = 0: it is √(q,Aq) but for a
        constant, and never zero.

        For (q,Aq) = Π λ_s/Π I_i, and Π_s (λ_s − b) is a constant times (θ[η(b)]/θ)² at every branch
        point b.
        """
        values = self.theta.values(z, self._of_stretch)
        return np.asarray(np.abs(values[:, 1] / values[:, 0]))

    def at(self, z: Array) -> Attitude:
        """Return the attitude at points z of shape (N, g), modulo 2; spheroconic coordinates are
        left to the caller (empty).
        """
        return self.attitude(self.theta.values(z, self.functions))

    def attitude(self, values: Array) -> Attitude:
        """Return the same from values of the ``functions``, shape (N, functions), however they were
        computed.
        """
        entries = self._raw(values) * self.constants
        g = self.theta.genus
        n = g + 1
        return Attitude(
            entries[:, :n],
            entries[:, n + g :].reshape(-1, n, g),
            entries[:, n : n + g],
            np.empty((len(values), 0)),
        )
