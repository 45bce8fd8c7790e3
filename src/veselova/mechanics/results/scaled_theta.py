"""Theta values whatever their size."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.errors import Unsolved

__all__ = ["ScaledTheta"]

#: exp of this is the largest double.
_LARGEST_EXPONENT = 709.0


@dataclass(frozen=True, eq=False)
class ScaledTheta:
    """Theta values as ``mantissa``·exp(``exponent``), whatever their size.

    - mantissa: complex, the shape of the values
    - exponent, error: real, without the axes of derivatives. The mantissa is off by at most
      ``error``.
    """

    mantissa: NDArray[np.complex128]
    exponent: NDArray[np.float64]
    error: NDArray[np.float64]

    @property
    def values(self) -> NDArray[np.complex128]:
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
    def _logarithm(self) -> NDArray[np.float64]:
        """Return the logarithm of the largest derivative, or of 1 where all mantissas are less."""
        sizes = np.abs(self.mantissa)
        axes = tuple(range(self.exponent.ndim, sizes.ndim))
        return np.asarray(self.exponent + np.log(np.maximum(np.max(sizes, axis=axes), 1.0)))

    def _to_values(self, array: NDArray[np.float64]) -> NDArray[np.float64]:
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
