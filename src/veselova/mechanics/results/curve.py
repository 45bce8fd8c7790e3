"""A hyperelliptic curve as data: periods, Riemann matrix, characteristics, images of points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["CurveData"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class CurveData:
    """The curve w² = sign·Π(λ−b_j), with the fields of ``veselova.curves.RealHyperelliptic``.

    genus g · sign · branch_points (2g+1,) or (2g+2,), increasing · cuts, gaps (g, 2)
    a_periods (g, g) real, b_periods (g, g) imaginary: of λ^{k−1}dλ/w over a_s and b_s, columns s;
    None where one leaves the range of a double
    normalized_differentials (g, g), None likewise · riemann_matrix (g, g) τ = iT, off by at most
    riemann_matrix_error · characteristics (B, 2, g), [ε, δ] of each branch point
    abel (N, g) images of the points that were given, None without
    """

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
    abel: Complex | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return the fields JSON-ready: T of τ = iT, b-periods without their factor i, and images
        as pairs [real, imaginary].
        """
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        values["riemann_matrix"] = self.riemann_matrix.imag
        values["b_periods"] = None if self.b_periods is None else self.b_periods.imag
        if self.abel is None:
            del values["abel"]
        else:
            values["abel"] = np.stack([self.abel.real, self.abel.imag], axis=-1)
        return {
            name: value.tolist() if isinstance(value, np.ndarray) else value
            for name, value in values.items()
        }

    @classmethod
    def from_dict(cls, document: Mapping[str, Any]) -> CurveData:
        """Return the curve of a document that ``as_dict`` made."""
        values: dict[str, Any] = {
            name: np.array(value, dtype=np.float64) if isinstance(value, list) else value
            for name, value in document.items()
        }
        values["riemann_matrix"] = 1j * values["riemann_matrix"]
        if values["b_periods"] is not None:
            values["b_periods"] = 1j * values["b_periods"]
        if "abel" in values:
            values["abel"] = values["abel"][..., 0] + 1j * values["abel"][..., 1]
        return cls(**values)
