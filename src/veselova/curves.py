"""Hyperelliptic curves with real branch points: periods, Riemann matrix, Abel–Jacobi map and its
inverse.

    from veselova import curves
    curve = curves.RealHyperelliptic([0, 1, 2, 4, 7])
    curve.riemann_matrix
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from veselova.analytic.curve.curve_values import CurveDigits
from veselova.analytic.curve.real_hyperelliptic import RealCurve
from veselova.mechanics.core.arguments import FEWEST_DIGITS, CheckedCall, read_precision
from veselova.mechanics.core.decimals import Decimals
from veselova.mechanics.core.errors import Faults, InvalidInput, Unsolved, show
from veselova.mechanics.core.toolkit_arguments import (
    complex_array,
    curve_arguments,
    curve_outputs,
    points_with_sheets,
    rows_of_points,
    torus_points,
)
from veselova.mechanics.results.toolkit import CURVE_MATRICES, QUASI_PERIODS, CurveData

__all__ = ["CurvePeriods", "RealHyperelliptic"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Halves = tuple[tuple[float, ...], tuple[float, ...]]

#: Derived: digits that make a double.
_WHOLE_DOUBLE = 17


@dataclass(frozen=True)
class CurvePeriods:
    """Periods of λ^{k−1}dλ/w, k = 1 … g: ``a`` (g, g) real, ``b`` (g, g) imaginary; column s
    belongs to the cycle a_s or b_s.
    """

    a: Array
    b: Complex


class RealHyperelliptic(metaclass=CheckedCall):
    """The curve w² = sign·Π(λ−b_j) with 2g+1 or 2g+2 distinct real branch points.

    - branch_points: numbers or text ("0.7", "7/10"), taken exactly, in any order;
      near-coincident ones keep their digits
    - sign: −1 or 1
    - digits, certified: more digits than a double has (15 … 1000), or proven errors:
      ``decimals``, ``abel_decimals``, ``invert_decimals``

    Cycle a_s goes round ``cuts[s]``, a bounded interval over which w is real; b_s meets it once.
    Raises InvalidInput for repeated, complex or too few branch points. Accuracy:
    ``riemann_matrix_error``; tested for g = 1 … 10 against quadrature with 30 digits, and for gaps
    to 1e-30 and offsets against ball arithmetic.
    """

    def __init__(
        self,
        branch_points: ArrayLike | Sequence[Any],
        sign: int = -1,
        *,
        digits: int = FEWEST_DIGITS,
        certified: bool = False,
    ) -> None:
        faults = Faults()
        known = faults.attempt(curve_arguments, branch_points, sign)
        self._is_fine = faults.attempt(read_precision, digits, certified)
        faults.require_none()
        points, self.sign = known
        self._curve = RealCurve(points, self.sign)
        self._doubles = self._fine = CurveDigits(self._curve, _WHOLE_DOUBLE, False)
        if self._is_fine:
            self._fine = CurveDigits(self._curve, digits, certified)

    def __repr__(self) -> str:
        return (
            f"RealHyperelliptic(genus {self.genus}, {len(self.branch_points)} branch points, "
            f"sign {self.sign:+d})"
        )

    @property
    def genus(self) -> int:
        """Return g."""
        return self._curve.genus

    @cached_property
    def branch_points(self) -> Array:
        """Return the branch points, increasing, rounded to doubles."""
        return np.array([float(b) for b in self._curve.points])

    @cached_property
    def cuts(self) -> Array:
        """Return the intervals of λ round which a_1 … a_g go, (g, 2)."""
        return self._intervals(1)

    @cached_property
    def gaps(self) -> Array:
        """Return the intervals between them that b_1 … b_g are made of, (g, 2)."""
        return self._intervals(0)

    def data(
        self, points: Any = None, w: Any = None, z: Any = None, outputs: Sequence[str] = ()
    ) -> CurveData:
        """Return the curve as data.

        It has images of ``points``, w, places of points z of the real torus, and the ``outputs``
        (``quasi_periods``). Raises InvalidInput, and what the properties raise.
        """
        names = QUASI_PERIODS if curve_outputs(outputs) else ()
        numbers: dict[str, Any] = dict.fromkeys(CURVE_MATRICES)
        with suppress(Unsolved):
            numbers |= {"a_periods": self.periods.a, "b_periods": self.periods.b.imag}
            numbers["normalized_differentials"] = self.normalized_differentials
        numbers["riemann_matrix"] = self.riemann_matrix.imag
        numbers |= {name: self._rounded(name) for name in names}
        plain = ("genus", "sign", "riemann_matrix_error", "branch_points", "cuts", "gaps")
        document: dict[str, Any] = {
            **{name: _plain(getattr(self, name)) for name in plain},
            "characteristics": np.array(self.characteristics).tolist(),
        }
        parts = [] if self.decimals is None else [self.decimals.choose([*CURVE_MATRICES, *names])]
        if points is not None:
            parts.append(self._images(points, w))
            numbers["abel"] = parts[-1].midpoints["abel"].astype(np.float64)
        if z is not None:
            numbers["points"], signs = map(np.atleast_2d, self.invert(z))
            document["signs"] = signs.tolist()
            if places := self.invert_decimals(z):
                parts.append(places.choose(["points"]))
        shown = {name: _plain(value) for name, value in numbers.items()}
        if self.decimals is not None:
            known = self.decimals.join(parts)
            shown = {name: known.strings(name) for name in numbers}
            document |= {"digits": known.digits, "certified": known.certified}
            document["radii"] = {name: known.strings(name, True) for name in numbers}
        if "omega" in shown:
            document["quasi_periods"] = {name: shown.pop(name) for name in QUASI_PERIODS}
        return CurveData.from_dict({**document, **shown})

    def _intervals(self, first: int) -> Array:
        order = self._curve.order
        ends = [[order[j], order[j + 1]] for j in range(first, 2 * self.genus, 2)]
        return np.array([sorted(float(self._curve.points[j]) for j in pair) for pair in ends])

    @cached_property
    def periods(self) -> CurvePeriods:
        """Return the periods of the monomial differentials λ^{k−1}dλ/w.

        On cut s the loop runs over the sheet with (−1)^{g−s} w > 0 in the direction in which
        ``cuts`` are numbered.
        """
        a, b = (self._rounded(name, 1) for name in ("a_periods", "b_periods"))
        return CurvePeriods(a, np.asarray(1j * b, dtype=complex))

    @cached_property
    def normalized_differentials(self) -> Array:
        """Return c, (g, g): v_j = Σ_k c_jk λ^{k−1}dλ/w has ∮_{a_s} v_j = δ_js."""
        return self._rounded("normalized_differentials", 0)

    def _rounded(self, name: str, axis: int | None = None) -> Array:
        """Return numbers of ``decimals`` as doubles; raises Unsolved (``beyond-floats``) where one
        is too large, or all along an axis are too small.
        """
        found = np.asarray(self._fine.of_curve.midpoints[name], dtype=np.float64)
        if not (np.all(np.isfinite(found)) and np.all(np.any(found, axis=axis))):
            reason = "a number leaves the range of a float; take branch points in other units"
            raise Unsolved("beyond-floats", reason)
        return found

    @cached_property
    def riemann_matrix(self) -> Complex:
        """Return τ = iT, T real, symmetric, positive definite, (g, g): the b-periods of the
        normalised differentials.
        """
        return np.asarray(1j * self._riemann[0])

    @property
    def riemann_matrix_error(self) -> float:
        """Return the error of every entry of the Riemann matrix."""
        return self._riemann[1]

    @cached_property
    def _riemann(self) -> tuple[Array, float]:
        return self._doubles.riemann_matrix()

    @property
    def decimals(self) -> Decimals | None:
        """Return the numbers of the curve to so many digits, ``midpoints`` and ``radii`` by name,
        proven where ``certified``; None in double precision.

        - riemann_matrix: (g, g) T of τ = iT
        - a_periods, b_periods: (g, g), those over b_s without i
        - normalized_differentials: (g, g)
        - omega, eta, omega_prime, eta_prime: (g, g) the ``quasi_periods``, the first two without i

        Each is computed when it is first read. A radius is below 10^−digits of its size: the
        largest entry of T or 1, the largest entry of a row of periods, of a column of coefficients.
        Raises Unsolved where a gap is too narrow for the digits (``narrow-gap``).
        """
        return self._fine.of_curve if self._is_fine else None

    @cached_property
    def quasi_periods(self) -> tuple[Complex, Complex, Complex, Complex]:
        """Return ω, ω', η, η' (g, g): half the periods over a_s and b_s (columns) of du_k, and of
        −dr_k, rows k = 1 … g.

        du_k = μ^{k−1}dμ/y and dr_k = Σ_j (j+1−k) m_{j+1+k} μ^j dμ/4y on y² = 4Π(μ−β) = Σ m_i μ^i,
        in the coordinate μ in which
        one branch point is at infinity: λ, or −λ for sign 1; 1/|e−λ| with a sign where there are
        2g+2.
        """
        omega, omega_prime, eta, eta_prime = map(self._rounded, QUASI_PERIODS)
        first: Complex = np.stack([1j * omega, omega_prime])
        second: Complex = np.stack([1j * eta, eta_prime])
        return first[0], first[1], second[0], second[1]

    @cached_property
    def characteristics(self) -> tuple[Halves, ...]:
        """Return (ε, δ) of each branch point: τε + δ is its image under ``abel``; zero for the last
        of 2g+2.
        """
        zero = (0.0,) * self.genus
        found = [(zero, zero)] * len(self._curve.points)
        for number, halves in zip(self._curve.order, self._curve.halves, strict=True):
            epsilon, delta = (tuple(x.tolist()) for x in halves)
            found[number] = epsilon, delta
        return tuple(found)

    def abel(self, points: ArrayLike | Sequence[Any], w: ArrayLike) -> Complex:
        """Return ∫ of the normalised differentials from the last branch point to (λ, w), (N, g).

        The last branch point is infinity where there are 2g+1, and the largest one where there are
        2g+2. The image is known modulo the lattice Z^g + τZ^g.

        ``points``: N numbers, real ones exact where text. w: N numbers whose signs name the sheets,
        over gaps those of imaginary parts, the nearer root for complex λ. Raises InvalidInput for
        bad numbers. Images are formed in balls, and rounded once.
        """
        found = self._images(points, w).midpoints["abel"].astype(np.float64)
        return np.asarray(found[..., 0] + 1j * found[..., 1])

    def _images(self, points: ArrayLike | Sequence[Any], w: ArrayLike) -> Decimals:
        return self._fine.abel(*points_with_sheets(points, w))

    def abel_decimals(self, points: ArrayLike | Sequence[Any], w: ArrayLike) -> Decimals | None:
        """Return ``abel``, (N, g, 2): real and imaginary parts of ``abel(points, w)`` with radii
        below 10^−digits of the largest of an image, or of 1; None in double precision.

        Complex points are the doubles that they are stored as. Raises what ``abel`` does.
        """
        images = self._images(points, w)
        return images if self._is_fine else None

    def invert(self, z: ArrayLike) -> tuple[Array, Array]:
        """Return λ (N, g), one on each cut, and the signs of w there, at points z (N, g) of the
        real torus R^g/Z^g.

        z = Σ_s ∫ of the normalised differentials to (λ_s, w_s), each from the end of cut s with the
        lower number in order of ``cuts``: ``torus`` is the way back. Raises InvalidInput for bad
        points. Accuracy: 1e-13 of z, less where branch points over many orders of magnitude cancel.
        λ is rounded to a double: of the place on a cut of relative width 1e-12 four digits remain
        (``invert_decimals`` has them all).
        """
        exact, single = torus_points(z, self.genus)
        rows = np.array([[float(x % 1) for x in row] for row in exact]).reshape(-1, self.genus)
        points, whole = self._doubles.in_doubles(lambda fine: np.stack(fine.invert(rows, True)))
        points = np.clip(points, *self.cuts.T)  # roundings of the ends of narrow ones
        signs = whole.astype(float)
        return (points[0], signs[0]) if single else (points, signs)

    def invert_decimals(self, z: ArrayLike | Sequence[Any]) -> Decimals | None:
        """Return ``points`` and ``signs`` of ``invert(z)``, (N, g), with radii of the points below
        10^−digits of the largest branch point; None in double precision.

        z: numbers or text, taken exactly. Raises InvalidInput for bad points, Unsolved
        (``not-enclosed``, ``narrow-gap``) where the digits do not suffice.
        """
        exact, _ = torus_points(z, self.genus)
        return self._fine.invert(exact) if self._is_fine else None

    def torus(self, points: ArrayLike | Sequence[Any], signs: ArrayLike) -> Array:
        """Return z (N, g) of points λ (N, g), one on each cut, with the given signs of w: the
        inverse of ``invert``.
        """
        rows, single = rows_of_points(points)
        wanted = f"rows of {self.genus} numbers, the signs of w"
        directions = np.atleast_2d(complex_array(signs, ("signs",), wanted).real)
        shape = len(rows), self.genus
        if {*map(len, rows)} != {self.genus} or directions.shape != shape:
            required = f"rows of {self.genus} points with as many signs"
            raise InvalidInput(("points",), required, show(points))
        faults = Faults()
        exact = np.empty(shape, dtype=object)
        for i, s in np.ndindex(shape):
            exact[i, s] = self._curve.mu_on_cut(s + 1, rows[i][s])
            if exact[i, s] is None:
                low, high = self.cuts[s]
                required = f"a number on cut {s + 1}, {low:.17g} … {high:.17g}"
                faults.add(("points", i, s), required, show(_plain(rows[i][s])))
        faults.require_none()
        up = directions * self._curve.alternating > 0
        z = self._doubles.in_doubles(lambda fine: fine.torus(exact, up))
        return np.asarray(np.mod(z, 1.0)[0] if single else np.mod(z, 1.0))


def _plain(value: Any) -> Any:
    """Return arrays as nested lists, and a rational as a float where it is one."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    return float(value) if isinstance(value, Fraction) and float(value) == value else value
