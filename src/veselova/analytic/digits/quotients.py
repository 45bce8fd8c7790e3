"""The attitude as theta quotients with one common denominator.

    q_i = κ_i θ[η(I_i)]/θ,   v_k = (q', n_k) = κ_k θ[η(c_k)]/θ,   (n_k)_i = κ_ik θ[η(I_i)+η(c_k)]/θ,
        γ the case c_1 = 0.

The constants κ come from half periods z = ½ν, where every λ_s is a branch point and the closed
formula of analytic.attitude.frame is
exact: for each function the half period at which it is largest against its denominator.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from veselova.analytic.arithmetic.arithmetic import Values
from veselova.analytic.attitude.frame import Attitude, Frame
from veselova.analytic.theta.characteristic import Characteristic, functions_of_attitude
from veselova.analytic.theta.siegel_terms import ThetaInBalls

__all__ = ["ThetaQuotients"]


@dataclass(frozen=True)
class ThetaQuotients:
    """The theta route to the attitude of one torus; agrees with Frame after Abel–Jacobi inversion,
    and shares only κ with it.
    """

    theta: ThetaInBalls
    frame: Frame

    @cached_property
    def _functions(self) -> tuple[tuple[Characteristic, ...], list[int]]:
        """Return the characteristics of all functions once, that of the denominator first, and
        where among them the numerators stand: those of q_1 … q_n, of v_k, and of (n_k)_i with i
        before k; k runs over c_2 … c_{n−1}, c_1.
        """
        curve = self.frame.periods.curve
        of_I, of_c = (tuple(map(int, curve.layouts[kind].places)) for kind in ("I", "c"))
        functions, places = functions_of_attitude(of_I, of_c)
        return functions, list(places)

    def _raw(self, z: Values) -> Values:
        """Return θ[η]/θ in the order of the constants, shape (N, n + g + n·g)."""
        functions, places = self._functions
        values = self.theta.values(z, functions)
        return np.asarray((values / values[:, :1])[:, places])

    @cached_property
    def constants(self) -> Values:
        """Return the κ's in the order of the functions."""
        half_periods = self.frame.half_periods
        attitude = self.frame.at(self.frame.periods.arithmetic.pi * half_periods)
        exact = np.concatenate(
            [attitude.q, attitude.components, attitude.normals.reshape(len(half_periods), -1)],
            axis=1,
        )
        raw = self._raw(half_periods / 2)
        best = np.argmax(np.abs(raw.astype(float)), axis=0)
        columns = np.arange(raw.shape[1])
        return np.asarray(exact[best, columns] / raw[best, columns])

    def root_of_qAq(self, z: Values) -> Values:
        """Return |θ[η(0)]/θ| at points z of shape (N, g), where c_1 = 0: it is √(q,Aq) but for a
        constant, and never zero.

        For (q,Aq) = Π λ_s/Π I_i, and Π_s (λ_s − b) is a constant times (θ[η(b)]/θ)² at every branch
        point b.
        """
        functions, places = self._functions
        values = self.theta.values(z, [functions[0], functions[places[2 * self.theta.genus]]])
        return np.asarray(np.abs(values[:, 1] / values[:, 0]))

    def at(self, z: Values) -> Attitude:
        """Return the attitude at points z of shape (N, g), modulo 2; spheroconic coordinates are
        left to the caller (empty).
        """
        g = self.theta.genus
        q, components, normals = np.split(self._raw(z) * self.constants, [g + 1, 2 * g + 1], axis=1)
        return Attitude(q, normals.reshape(-1, g + 1, g), components, np.empty((len(z), 0)))
