"""The spectra of many starts of one dimension at once, with thirty digits: what
analytic.spectrum.branch_points finds for one with any number.

Only starts with all A's apart and no q_i = 0 are of this kind, and of those the ones whose
differences of branch points keep fifteen digits; the others are marked, and left to
analytic.spectrum.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.double_double import DoubleDouble, stack_double_doubles
from veselova.analytic.spectrum.secular_equation import zeros_of_many

__all__ = ["Spectra"]

Array = NDArray[np.float64]

#: Derived: how far 1 − Σ x_s²/λ_s may be from zero, which it is where c_1 = 0.
CONTRADICTION = 1e-18


@dataclass(frozen=True)
class Spectra:
    """The spectra of N starts, in units of the largest I of each.

    - axes: (N, n) the body axes by decreasing A
    - unit: (N,) the least A, which counts as 1
    - energy: (N,) h
    - inverse: (N, n) the I's, the last one 1
    - constants: (N, n−1) c_1 = 0 … c_{n−1}
    - spheroconic: (N, n−1) λ's at the start
    - increasing: (N, n−1) whether they increase there
    - time_rate: (N,) dτ₁/dt there
    - signs: (N, n) of q
    - known: (N,) which starts are of this kind
    """

    axes: NDArray[np.intp]
    unit: Array
    energy: Array
    inverse: DoubleDouble
    constants: DoubleDouble
    spheroconic: DoubleDouble
    increasing: NDArray[np.bool_]
    time_rate: Array
    signs: Array
    known: NDArray[np.bool_]

    def part(self, members: NDArray[np.intp]) -> Spectra:
        """Return the spectra of some of the starts."""
        return Spectra(*(getattr(self, entry.name)[members] for entry in fields(self)))

    @classmethod
    def of(cls, A: Array, q: Array, q_dot: Array) -> Spectra:
        """Return the spectra of starts (N, n) each, exact as they stand; q needs no length, and q̇
        may have a part along q.
        """
        axes = np.argsort(-A, axis=1, kind="stable")
        A, q, q_dot = (np.take_along_axis(x, axes, axis=1) for x in (A, q, q_dot))
        with np.errstate(all="ignore"):  # what is no number is not known
            return cls._of_sorted(axes, A, DoubleDouble.of(q), DoubleDouble.of(q_dot))

    @classmethod
    def _of_sorted(
        cls, axes: NDArray[np.intp], A: Array, position: DoubleDouble, velocity: DoubleDouble
    ) -> Spectra:
        unit = A[:, -1:]
        size = (position * position).total()
        velocity = velocity - position * ((position * velocity).total() / size)[:, None]
        scaled = DoubleDouble.of(A) / unit
        weight = (scaled * position * position).total()
        # The part of q̇ that is A-orthogonal to q: (dτ₁/dt)² = (w,Aw) is a sum of positive terms.
        sliding = velocity - position * ((scaled * position * velocity).total() / weight)[:, None]
        speed = (scaled * sliding * sliding).total()
        rate = speed.sqrt()
        position = position / size.sqrt()[:, None]
        velocity = velocity / rate[:, None]
        inverse = DoubleDouble.of(unit) / A
        spheroconic, found = zeros_of_many(inverse, position * position, 0)
        rows = [position / (spheroconic[:, s, None] - inverse) for s in range(A.shape[1] - 1)]
        along = stack_double_doubles(
            [(row * velocity).total() / (row * row).total().sqrt() for row in rows]
        )
        squares = along * along
        others, converged = zeros_of_many(spheroconic, squares, 1)
        excess = np.abs(((squares / spheroconic).total() - 1).high)
        zero = DoubleDouble.of(np.zeros(A.shape[0]))
        return cls(
            axes=axes,
            unit=unit[:, 0],
            energy=_energy(speed * unit[:, 0], weight * unit[:, 0] / size, A),
            inverse=inverse,
            constants=stack_double_doubles([zero, *(others[:, k] for k in range(A.shape[1] - 2))]),
            spheroconic=spheroconic,
            increasing=np.stack([(row * velocity).total().high >= 0 for row in rows], axis=1),
            time_rate=rate.high,
            signs=np.sign(position.high),
            known=found & converged & (excess < CONTRADICTION),
        )


def _energy(speed: DoubleDouble, weight: DoubleDouble, A: Array) -> Array:
    """Return h = (dτ₁/dt)² (q,Aq)/(2 det A), equation (4.6, printed 6.15), from the speed and
    (q,Aq) for |q| = 1.
    """
    energy = speed * weight / 2.0
    for i in range(A.shape[1]):
        energy = energy / A[:, i]
    return energy.high
