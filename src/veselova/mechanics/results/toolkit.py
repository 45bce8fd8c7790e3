"""A hyperelliptic curve as data: periods, Riemann matrix, characteristics, images of points; and
theta values whatever their size.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.decimals import Decimals, decimals_of
from veselova.mechanics.core.errors import Unsolved

__all__ = [
    "CURVE_MATRICES",
    "QUASI_PERIODS",
    "CurveData",
    "QuasiPeriods",
    "ScaledTheta",
]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Matrices that a document always has; periods and coefficients are None beyond floats.
CURVE_MATRICES = ("riemann_matrix", "a_periods", "b_periods", "normalized_differentials")

#: The names of quasi-periods.
QUASI_PERIODS = ("omega", "omega_prime", "eta", "eta_prime")

#: exp of this is the largest double.
_LARGEST_EXPONENT = 709.0

#: Real arrays of a document, as they are.
_PLAIN = ("branch_points", "cuts", "gaps", "characteristics")


@dataclass(frozen=True, eq=False)
class QuasiPeriods:
    """ω, ω', η, η' (g, g), half the periods of the first and second kind over a_s and b_s, without
    the factor i that ω and η have.
    """

    omega: Array
    omega_prime: Array
    eta: Array
    eta_prime: Array


@dataclass(frozen=True, eq=False)
class CurveData:
    """The curve w² = sign·Π(λ−b_j), with the fields of ``veselova.curves.RealHyperelliptic``.

    - genus, sign: g, and −1 or 1
    - branch_points: (2g+1,) or (2g+2,), increasing
    - cuts, gaps: (g, 2)
    - a_periods: (g, g) real, of λ^{k−1}dλ/w over a_s, columns s; None where one leaves the range
      of a double
    - b_periods: (g, g) imaginary, over b_s, likewise
    - normalized_differentials: (g, g), likewise
    - riemann_matrix: (g, g) τ = iT, off by at most ``riemann_matrix_error``
    - characteristics: (B, 2, g), [ε, δ] of each branch point
    - abel: (N, g) images of the given points, None without
    - points, signs: (M, g) λ on each cut and the signs of w at the given points z of the real
      torus, None without
    - quasi_periods: None unless requested
    - decimals: the same numbers to the requested digits, with radii, by the names of their fields
      (``b_periods`` and ``abel`` as in the JSON; those of ``quasi_periods`` by themselves); None in
      double precision
    - document: what ``as_dict`` returns, from which the others are
    """

    document: Mapping[str, Any] = field(repr=False)
    genus: int
    sign: int
    branch_points: Array
    cuts: Array
    gaps: Array
    a_periods: Array | None
    b_periods: Complex | None
    normalized_differentials: Array | None
    riemann_matrix: Complex
    riemann_matrix_error: float
    characteristics: Array
    abel: Complex | None
    points: Array | None
    signs: Array | None
    quasi_periods: QuasiPeriods | None = None
    decimals: Decimals | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return the fields JSON-ready: T of τ = iT, b-periods without their factor i, and images
        as pairs [real, imaginary].

        With decimals these numbers are strings, and ``radii`` has those of their radii.
        """
        return dict(self.document)

    @classmethod
    def from_dict(cls, document: Mapping[str, Any]) -> CurveData:
        """Return the curve of a document as ``as_dict`` returns it."""
        heads = ("genus", "sign", "riemann_matrix_error")
        values: dict[str, Any] = {"document": document, **{name: document[name] for name in heads}}
        for name in (*_PLAIN, *CURVE_MATRICES, "abel", "points", "signs"):
            values[name] = _array(document.get(name))
        for name in ("riemann_matrix", "b_periods"):
            values[name] = None if values[name] is None else 1j * values[name]
        if values["abel"] is not None:
            values["abel"] = values["abel"][..., 0] + 1j * values["abel"][..., 1]
        texts = {name: document.get(name) for name in (*CURVE_MATRICES, "abel", "points")}
        if "quasi_periods" in document:
            found = document["quasi_periods"]
            arrays = {name: np.array(found[name], dtype=np.float64) for name in found}
            values["quasi_periods"] = QuasiPeriods(**arrays)
            texts |= found
        if "radii" in document:
            radii = {name: decimals_of(value) for name, value in document["radii"].items()}
            middles = {name: decimals_of(texts[name]) for name in radii}
            head = document["digits"], document["certified"]
            values["decimals"] = Decimals(*head, middles, radii, ("riemann_matrix",))
        return cls(**values)


def _array(value: Any) -> Array | None:
    """Return numbers or texts as an array; None where there are none, or one is beyond floats."""
    if value is None:
        return None
    array = np.array(value, dtype=np.float64)
    is_text = np.asarray(value).dtype.kind == "U"
    lost = is_text and np.any((array == 0) & (decimals_of(value) != 0))
    return array if np.all(np.isfinite(array)) and not lost else None


@dataclass(frozen=True, eq=False)
class ScaledTheta:
    """Theta values as ``mantissa``·exp(``exponent``), whatever their size.

    - mantissa: complex, the shape of the values
    - exponent, error: real, without the axes of derivatives. The mantissa is off by at most
      ``error``.
    """

    mantissa: Complex
    exponent: Array
    error: Array

    @property
    def values(self) -> Complex:
        """Return the values; raises Unsolved (``beyond-floats``) where one overflows."""
        largest = np.max(self._logarithm, initial=0.0)
        if largest > _LARGEST_EXPONENT:
            raise Unsolved(
                "beyond-floats",
                f"exp({largest:.6g}) leaves the range of a float; take mantissas and exponents "
                "(scaled_riemann_theta)",
            )
        return np.asarray(self.mantissa * np.exp(self._to_values(self.exponent)))

    @property
    def _logarithm(self) -> Array:
        """Return the logarithm of the largest derivative, or of 1 where all mantissas are less."""
        sizes = np.abs(self.mantissa)
        axes = tuple(range(self.exponent.ndim, sizes.ndim))
        return np.asarray(self.exponent + np.log(np.maximum(np.max(sizes, axis=axes), 1.0)))

    def _to_values(self, array: Array) -> Array:
        """Return an array (N, C) with the axes of the derivatives, of length 1."""
        return array.reshape(array.shape + (1,) * (self.mantissa.ndim - array.ndim))

    def as_dict(self) -> dict[str, Any]:
        """Return ``values``, ``exponent`` and ``error``: θ = values·exp(exponent), off by at most
        error·exp(exponent).

        Complex numbers are pairs [real, imaginary]. The exponent is 0 wherever the value is in the
        range of a double.
        """
        exponent = self.exponent
        scaled = np.maximum(-exponent, self._logarithm) > _LARGEST_EXPONENT - 10
        factor = np.exp(np.where(scaled, 0.0, exponent))
        values = np.ascontiguousarray(self.mantissa * self._to_values(np.asarray(factor)))
        pairs = values.view(np.float64).reshape(*values.shape, 2)
        return {
            "values": pairs,
            "exponent": np.where(scaled, exponent, 0.0),
            "error": self.error * factor,
        }

    @classmethod
    def from_dict(cls, document: Any) -> ScaledTheta:
        """Return the values of a document that ``as_dict`` made."""
        pairs = np.array(document["values"], dtype=np.float64)
        exponent, error = (np.array(document[name], dtype=float) for name in ("exponent", "error"))
        return cls(pairs[..., 0] + 1j * pairs[..., 1], exponent, error)
