"""One motion's torus in balls: the kernel's, with the Abel–Jacobi map of its curve."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from types import SimpleNamespace
from typing import Any

import numpy as np

from veselova.analytic.arithmetic.balls import Balls, Values
from veselova.analytic.closed.base import Attitude
from veselova.analytic.closed.start import scale_of, start_of
from veselova.analytic.curve.branch_points import Spectrum
from veselova.analytic.curve.hyperelliptic import Curve
from veselova.analytic.curve.kernel_text import text_over, zeros
from veselova.analytic.curve.periods import AbelJacobi, Periods
from veselova.analytic.kernel.torus import Torus

__all__ = ["TorusInBalls"]


@dataclass(frozen=True)
class TorusInBalls:
    """A torus in balls, in units where the largest I is one.

    - inversion: the Abel–Jacobi map
    - numbers: those that the kernel's text of frame and rate takes, (1,) and more
    """

    inversion: AbelJacobi
    numbers: Any

    @classmethod
    def of(cls, spectrum: Spectrum, xp: Balls, time: int, flow: Values) -> TorusInBalls:
        """Return the torus of a start; call it ``with xp:``.

        time: of the kernel; flow: (g,) du/dτ₁
        """
        start, text = start_of(spectrum), text_over(xp)
        inversion = AbelJacobi(Periods(Curve(xp, start.points, start.d)))
        periods = inversion.periods
        norms_I, norms_c = zeros(start.of_I.size), zeros(start.of_c.size)
        text.set_norms(start.d, start.of_I, norms_I)
        text.set_norms(start.d, start.of_c, norms_c)
        ends = zip(periods.cuts, start.on_cuts.T, start.up.tolist(), strict=True)
        psi = np.array([cut.angle(low, high, up) for cut, (low, high), up in ends])
        numbers = dict.fromkeys(Torus._fields) | {
            "d": start.d,
            "points": start.points,
            "of_I": start.of_I,
            "of_c": start.of_c,
            "time": [time],
            "cuts": [cut.scale for cut in periods.cuts],
            "frequencies": periods.inverse_cycles @ flow,
            "norms_I": norms_I * start.signs,
            "norms_c": norms_c,
            "scale": [scale_of(start, time, xp)],
            "tilt": [0],
            "psi": psi,
            "z": inversion.map(psi[None, :])[0],
        }
        return cls(inversion, Torus(**numbers))

    @property
    def genus(self) -> int:
        """Return g."""
        return self.inversion.periods.genus

    @property
    def arithmetic(self) -> Balls:
        """Return the arithmetic of all numbers."""
        return self.inversion.arithmetic

    @cached_property
    def mean(self) -> Any:
        """Return F_0, the mean of d(time)/dτ₁; what its quadrature leaves out is not bounded."""
        known, periods = self.numbers, self.inversion.periods
        return known.scale[0] * periods.mean_flow(known.time[0], zeros(self.genus))[1]

    def rate(self, psi: Values) -> Values:
        """Return d(time)/dτ₁ at angles (N, g), but for its odd part."""
        return np.asarray(text_over(self.arithmetic).even_rate(self.numbers, _by_cut(psi)))

    def attitude(self, psi: Values) -> Attitude:
        """Return the attitude at angles (N, g); entries change sign with ψ_s → ψ_s + 2π as they do
        in time.
        """
        g, count, known = self.genus, len(psi), self.numbers
        n = g + 1
        room = SimpleNamespace(
            roots=zeros((g, 2 * g + 1, count)),
            between=zeros((g, g, count)),
            lines=zeros((g, n, count)),
            rows=zeros((g, g, count)),
            q=zeros((n, count)),
            v=zeros((g, count)),
        )
        frame, velocity = zeros((n, n, count)), zeros((n, count))
        text_over(self.arithmetic).set_frame(known, _by_cut(psi), room, frame, velocity)
        low = np.stack([room.roots[s, 2 * s + 1] for s in range(g)], axis=1)
        return Attitude(
            frame[:, 0].T,
            frame[:, 1:].transpose(2, 0, 1),
            np.roll(room.v, -1, axis=0).T,  # n_2 … n_{n−1}, then γ, which belongs to c_1 = 0
            known.points[1 : 2 * g : 2] + low * low,
        )


def _by_cut(psi: Values) -> Values:
    """Return angles (N, g) as g arrays."""
    found = np.empty(psi.shape[1], dtype=object)
    for s in range(len(found)):
        found[s] = psi[:, s]
    return found
