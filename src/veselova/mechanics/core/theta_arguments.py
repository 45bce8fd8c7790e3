"""The arguments of a theta function: points, a matrix of the Siegel half space, characteristics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.complex_input import complex_array
from veselova.mechanics.core.errors import Faults, InvalidInput, show
from veselova.mechanics.core.exact_input import whole_number

__all__ = ["ThetaArguments", "siegel_matrix"]

Complex = NDArray[np.complex128]

#: τ may be off its transpose by this part of its largest entry; it is made symmetric.
_SYMMETRY = 1e-12

#: Beyond it a double is a whole number, and nothing is known modulo 1.
_LARGEST_REAL_PART = 2.0**53

#: Genera that are served.
_LARGEST_GENUS = 8


@dataclass(frozen=True, eq=False)
class ThetaArguments:
    """What a theta function is asked for: τ (g, g), points (N, g), characteristics (C, 2, g), the
    order of derivatives.

    ``single_point`` and ``single_characteristic``: one was given by itself, so that the values have
    no axis for it.
    """

    tau: Complex
    points: Complex
    characteristics: NDArray[np.float64]
    derivatives: int
    single_point: bool
    single_characteristic: bool

    @classmethod
    def of(
        cls, z: Any, tau: Any, characteristic: Any, derivatives: Any, T: Any = None
    ) -> ThetaArguments:
        """Return the arguments; raises InvalidInput, with all faults. ``T``: the real matrix of
        τ = iT, in the place of τ.
        """
        faults = Faults()
        matrix = faults.attempt(siegel_matrix, tau if T is None else T, T is not None)
        genus = None if matrix is None else len(matrix)
        points = faults.attempt(_points, z, genus)
        if genus is None and points is not None:
            genus = points.shape[-1]
        halves = faults.attempt(_characteristics, characteristic, genus)
        order = faults.attempt(whole_number, derivatives, ("derivatives",), 0, 2)
        faults.require_none()
        several = halves.reshape(-1, 2, len(matrix))
        rows = np.atleast_2d(points)
        return cls(matrix, rows, several, order, points.ndim == 1, halves.ndim == 2)


def siegel_matrix(given: Any, real: bool = False) -> Complex:
    """Return τ as a symmetric complex matrix; raises InvalidInput outside the Siegel half space.

    ``real``: T was given, with τ = iT.
    """
    path = ("T" if real else "tau",)
    required = f"a g × g matrix, g = 1 … {_LARGEST_GENUS}"
    matrix = complex_array(given, path, required)
    if (
        matrix.ndim != 2
        or matrix.shape[0] != matrix.shape[1]
        or not 1 <= len(matrix) <= _LARGEST_GENUS
    ):
        raise InvalidInput(path, required, f"shape {matrix.shape}")
    if real:
        if np.any(matrix.imag):
            raise InvalidInput(path, "a real matrix", show(given))
        matrix = np.asarray(1j * matrix.real, dtype=complex)
    largest = float(np.max(np.abs(matrix.real)))
    if largest > _LARGEST_REAL_PART:
        required = "real parts up to 2^53, beyond which they have no fractions"
        raise InvalidInput(path, required, f"{largest:.3g}")
    # halves, whose differences and sums stay in range
    half = matrix / 2
    defect = 2 * float(np.max(np.abs(half - half.T)))
    if defect > _SYMMETRY * float(np.max(np.abs(matrix))):
        raise InvalidInput(
            path, "a symmetric matrix", f"one that differs from its transpose by {defect:.3g}"
        )
    matrix = half + half.T
    least = float(np.linalg.eigvalsh(matrix.imag)[0])
    if not least > 0:
        required = "a positive definite " + ("matrix" if real else "imaginary part")
        raise InvalidInput(path, required, f"one with least eigenvalue {least:.6g}")
    return matrix


def _points(z: Any, genus: int | None) -> Complex:
    """Return points, (N, g), or (g,) where one was given by itself."""
    required = f"a vector of {genus or 'g'} numbers, or rows of them"
    points = complex_array(z, ("z",), required)
    if points.ndim not in (1, 2) or points.shape[-1] != (genus or points.shape[-1]):
        raise InvalidInput(("z",), required, f"shape {points.shape}")
    return points


def _characteristics(given: Any, genus: int | None) -> NDArray[np.float64]:
    """Return characteristics, (C, 2, g), or (2, g) where one was given by itself."""
    if given is None:
        return np.zeros((2, genus or 1))
    required = f"[ε, δ] of {genus or 'g'} real numbers each, or a list of those"
    halves = complex_array(given, ("characteristic",), required)
    if halves.ndim not in (2, 3) or halves.shape[-2] != 2 or np.any(halves.imag):
        raise InvalidInput(("characteristic",), required, show(given))
    if halves.shape[-1] != (genus or halves.shape[-1]) or not halves.size:
        raise InvalidInput(("characteristic",), required, f"shape {halves.shape}")
    return halves.real
