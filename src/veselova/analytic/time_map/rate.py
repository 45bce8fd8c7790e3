"""The rate of the time map, d(time)/dτ₁ as a function on the torus, and what a time map is.

dt/dτ₁ = √((q,Aq)/W) with (q,Aq) = Π λ_s/Π I_i, W = 2h det A (the quadrature that ends the paper);
for the arc length of a geodesic ds/dτ₁ = 1/(√J (q,Aq)) (knorrer, printed 7.2). Two independent time
maps integrate either along z = z⁰ + fτ₁: analytic.time_map.fourier and analytic.time_map.panels.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from veselova.analytic.arithmetic.arithmetic import Arithmetic, Values
from veselova.analytic.curve.abel_jacobi import AbelJacobi
from veselova.analytic.curve.angle_series import AngleSeries
from veselova.analytic.curve.hyperelliptic import Curve
from veselova.analytic.curve.periods import Periods
from veselova.analytic.spectrum.branch_points import Spectrum

__all__ = [
    "TIME_RATE_POWERS",
    "TimeMap",
    "TimeRate",
    "TorusFunction",
    "TorusRate",
    "rate_factor",
    "time_rate",
]

Array = NDArray[np.float64]

P = TypeVar("P", bound=AngleSeries)

#: Derived: d(time)/dτ₁ is a constant times this power of √(q,Aq).
TIME_RATE_POWERS = {"t": 1, "s": -2, "tau1": 0}


@dataclass(frozen=True)
class TorusFunction(ABC, Generic[P]):
    """A function on the torus of one motion, scale times one whose Fourier coefficients are
    determinants of one-variable integrals.
    """

    inversion: AbelJacobi[P]
    scale: Any

    @abstractmethod
    def _weight_forms(self, s: int, psi: Values) -> Values:
        """Return φ_s du_k/dψ on cut s, signs included, shape (g, N)."""

    @property
    @abstractmethod
    def needed_nodes(self) -> tuple[int, ...]:
        """Return, per cut, how many nodes resolve them."""

    def _weight_at_nodes(self, s: int) -> Values:
        """Return the weighted forms at so many nodes."""
        return self._weight_forms(s, self.inversion.arithmetic.nodes(self.needed_nodes[s]))

    def columns(self, count: int) -> list[tuple[Values, Values]]:
        """Return, per cut, (weights w_k at ``count`` nodes, shape (g, N); G_s there, shape (N, g)).

        The torus measure is the determinant of the forms over det a, so the mean of the function
        times e^{−2πi m·z} is F_m = scale · det_{ks}[Σ_j w_kj cos(2π m·G_s(ψ_j))], the
        weights carrying a⁻¹: one-variable integrals only.
        """
        genus = self.inversion.periods.genus
        result = []
        psi = self.inversion.arithmetic.nodes(count)
        for s in range(genus):
            angles = np.zeros((count, genus), dtype=psi.dtype)
            angles[:, s] = psi
            result.append((self.weights(s, psi), self.inversion.map(angles)))
        return result

    def weights(self, s: int, psi: Values) -> Values:
        """Return w_k of cut s at nodes ψ (N,), shape (g, N)."""
        return self._weights(self._weight_forms(s, psi))

    def _weights(self, forms: Values) -> Values:
        """Return a⁻¹ times the forms at the nodes of a cut, and 2π over their number,
        shape (g, N).
        """
        periods = self.inversion.periods
        return np.asarray(
            periods.inverse_cycles @ forms * (2 * periods.arithmetic.pi / forms.shape[-1])
        )

    @cached_property
    def mean(self) -> Any:
        """Return F_0, the mean over the torus, in the arithmetic of the periods."""
        periods = self.inversion.periods
        means = [
            np.sum(self._weights(self._weight_at_nodes(s)), axis=-1) for s in range(periods.genus)
        ]
        return self.scale * periods.arithmetic.determinant(np.stack(means, axis=-1))


@dataclass(frozen=True)
class TorusRate(TorusFunction[P]):
    """d(time)/dτ₁ = scale · Π_s φ_s(λ_s) on the torus of one motion."""

    @abstractmethod
    def at(self, psi: Values) -> Values:
        """Return dt/dτ₁ at angles of shape (N, g)."""


@dataclass(frozen=True)
class TimeRate(TorusRate[Periods]):
    """The rate of t, s or τ₁ itself on a hyperelliptic torus; its factors φ_s are at most one at
    any genus.

    time: ``t``, φ = √(λ_s/b_{2s}), ``s``, φ = b_{2s−1}/λ_s, or ``tau1``, φ = 1
    """

    time: str

    @classmethod
    def of(cls, spectrum: Spectrum, inversion: AbelJacobi[Periods], time: str) -> TimeRate:
        """Return the rate whose scale follows from its value at the start."""
        curve = inversion.periods.curve
        fine = spectrum.arithmetic
        product = fine.number(1)
        with spectrum.working():
            for s, point in enumerate(spectrum.spheroconic):
                product = product * rate_factor(curve, s, point, time, fine)
            scale = 1 / (spectrum.time_rate * product)
        return cls(inversion, inversion.arithmetic.number(scale), time)

    def at(self, psi: Values) -> Values:
        """Return dt/dτ₁ at angles of shape (N, g)."""
        rate = 0 * psi[:, 0] + self.scale
        for s, root in enumerate(self.inversion.periods.roots_on_cuts(psi)[0]):
            rate = rate * self._factor(s, root * root)
        return np.asarray(rate)

    def _factor(self, s: int, below: Values) -> Values:
        curve = self.inversion.periods.curve
        point = curve.point(2 * s + 1) + below
        return np.asarray(rate_factor(curve, s, point, self.time, curve.arithmetic))

    @property
    def needed_nodes(self) -> tuple[int, ...]:
        """Return those of the forms' own series: the factors are analytic in their strips."""
        return tuple(int(series.shape[-1]) for series in self.inversion.periods.cut_series)

    def _weight_forms(self, s: int, psi: Values) -> Values:
        cut = self.inversion.periods.cuts[s]
        below, above = cut.distances(psi)
        return self._weight(s, below, cut.forms(below, above))

    def _weight_at_nodes(self, s: int) -> Values:
        return self._weight(s, *self.inversion.periods.forms_at_nodes[s])

    def _weight(self, s: int, below: Values, forms: Values) -> Values:
        sign = (-1) ** (self.inversion.periods.genus - s - 1)
        return np.asarray(sign * forms * self._factor(s, below)[..., None, :])


def rate_factor(curve: Curve, s: int, point: Any, time: str, arithmetic: Arithmetic) -> Any:
    """Return φ(λ_s) for the cut s = 0…g−1."""
    if time == "t":
        return arithmetic.sqrt(point / _number(curve.point(2 * s + 2), arithmetic))
    return _number(curve.point(2 * s + 1), arithmetic) / point if time == "s" else 1 + 0 * point


def _number(value: Any, arithmetic: Arithmetic) -> Any:
    return value if isinstance(value, np.ndarray) else arithmetic.number(value)


def time_rate(spectrum: Spectrum, time: str, arithmetic: Arithmetic) -> Callable[[Values], Values]:
    """Return dτ₁/d(time), a power of (q,Aq), as a function of positions (N, m) along the moving
    directions.
    """
    with spectrum.working():
        start = arithmetic.array(spectrum.q)
        A = arithmetic.array(1 / spectrum.inverse)
    relative = A / ((start * start) @ A)
    at_start = arithmetic.number(spectrum.time_rate)

    def rate(q: Values) -> Values:
        ratio = (q * q) @ relative
        power = (
            1 / arithmetic.sqrt(ratio) if time == "t" else ratio if time == "s" else 1 + 0 * ratio
        )
        return np.asarray(at_start * power)

    return rate


class TimeMap(ABC):
    """Neumann time as a function of physical time along one orbit, and back."""

    name: ClassVar[str]

    @abstractmethod
    def tau1(self, times: Array) -> tuple[Array, Array]:
        """Return (τ₁, z modulo 2) at physical times (N,)."""

    @property
    @abstractmethod
    def mean(self) -> float:
        """Return F_0, the mean of dt/dτ₁."""

    @abstractmethod
    def time(self, tau1: Array) -> Array:
        """Return t at Neumann times."""

    @abstractmethod
    def error(
        self, tau1: Array, of_start: Array, of_rates: Array
    ) -> tuple[Array | float, Array | float]:
        """Return a bound on the error in τ₁ that this time map adds to the rounding of F_0: what
        does not grow, (N,) or one for all times, and what is to be multiplied with |τ₁|.

        of_start, of_rates (g,): errors of z⁰ and f, which shift the slow parts of dt/dτ₁ where some
        m·f nearly vanishes.
        """

    @property
    @abstractmethod
    def size(self) -> int:
        """Return the number of modes or of panel nodes."""
