"""Riemann theta functions of any matrix of the Siegel half space, with characteristics and
derivatives.

θ[ε;δ](z|τ) = Σ_{m∈Z^g} exp(πi(m+ε)ᵀτ(m+ε) + 2πi(m+ε)·(z+δ))

from veselova import theta
theta.riemann_theta([0.1, 0.2j], [[1j, 0.5], [0.5, 1j]])
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from veselova.analytic.theta.siegel_theta import SiegelTheta
from veselova.mechanics.core.errors import InvalidInput, Unsolved, show

__all__ = [
    "ScaledTheta",
    "riemann_theta",
    "scaled_riemann_theta",
    "siegel_reduce",
    "theta_constants",
]

Complex = NDArray[np.complex128]

#: τ may be off its transpose by this part of its largest entry; it is made symmetric.
_SYMMETRY = 1e-12

#: Genera that are served.
_LARGEST_GENUS = 8

#: exp of this is the largest double.
_LARGEST_EXPONENT = 709.0


@dataclass(frozen=True)
class ScaledTheta:
    """Theta values as ``mantissa``·exp(``exponent``), whatever their size.

    mantissa: complex, the shape of the values · exponent, error: real, without the axes of
    derivatives. The mantissa is off by at most ``error``.
    """

    mantissa: Complex
    exponent: NDArray[np.float64]
    error: NDArray[np.float64]


def riemann_theta(
    z: ArrayLike, tau: ArrayLike, characteristic: ArrayLike | None = None, derivatives: int = 0
) -> Complex:
    """Return θ[ε;δ](z|τ), or its derivatives in z.

    z                (g,) or (N, g), complex
    tau              (g, g), complex, symmetric, Im τ positive definite, g = 1 … 8
    characteristic   [ε, δ], shape (2, g), any real numbers; (C, 2, g) for several; None for zero
    derivatives      0 for values, 1 for gradients, 2 for matrices of second derivatives

    The shape is that of the points, then (C,) for several characteristics, then (g,) or (g, g) for
    derivatives. Raises InvalidInput for bad input, Unsolved where a value overflows
    (``beyond-floats``; take ``scaled_riemann_theta``) or a sum has too many terms
    (``too-many-terms``). Errors are 1e-13 of the largest term; tested for g = 1 … 4 against
    python-flint.
    """
    found = scaled_riemann_theta(z, tau, characteristic, derivatives)
    exponent = found.exponent.reshape(
        found.exponent.shape + (1,) * (found.mantissa.ndim - found.exponent.ndim)
    )
    if np.max(exponent, initial=0.0) > _LARGEST_EXPONENT:
        raise Unsolved(
            "beyond-floats",
            f"exp({np.max(exponent):.6g}) leaves the range of a float; take scaled_riemann_theta",
        )
    return np.asarray(found.mantissa * np.exp(exponent))


def scaled_riemann_theta(
    z: ArrayLike, tau: ArrayLike, characteristic: ArrayLike | None = None, derivatives: int = 0
) -> ScaledTheta:
    """Return the same as ``riemann_theta`` as mantissas and exponents, with a bound
    of the error.
    """
    matrix = _siegel(tau)
    genus = len(matrix)
    points, single = _points(z, genus)
    halves, alone = _characteristics(characteristic, genus)
    if isinstance(derivatives, bool) or derivatives not in (0, 1, 2):
        raise InvalidInput(("derivatives",), "0, 1 or 2", show(derivatives))
    function = SiegelTheta(matrix)
    if not function.is_small:
        raise Unsolved("too-many-terms", f"the sum has about {function.terms:.1e} terms")
    take = (0 if single else slice(None), 0 if alone else slice(None))
    mantissas, exponents, errors = function.values(points, halves, derivatives)
    return ScaledTheta(
        np.asarray(mantissas[take]), np.asarray(exponents[take]), np.asarray(errors[take])
    )


def theta_constants(tau: ArrayLike) -> dict[tuple[tuple[float, ...], tuple[float, ...]], complex]:
    """Return θ[ε;δ](0|τ) of all half-integer characteristics by (ε, δ), entries 0 and ½; odd ones
    vanish exactly.
    """
    matrix = _siegel(tau)
    genus = len(matrix)
    rows = list(itertools.product((0.0, 0.5), repeat=genus))
    pairs = [(epsilon, delta) for epsilon in rows for delta in rows]
    even = [(e, d) for e, d in pairs if round(4 * np.dot(e, d)) % 2 == 0]
    values = riemann_theta(np.zeros(genus), matrix, [[list(e), list(d)] for e, d in even])
    return {**dict.fromkeys(pairs, 0j), **dict(zip(even, values.tolist(), strict=True))}


def siegel_reduce(tau: ArrayLike) -> tuple[Complex, NDArray[np.int64]]:
    """Return the reduced τ' and the symplectic matrix [[A, B], [C, D]], (2g, 2g), with τ' =
    (Aτ+B)(Cτ+D)⁻¹.

    Reduced: Im τ' is reduced as a quadratic form, |Re τ'| ≤ ½, |τ'_11| ≥ 1, so that Im τ'_11 ≥
    √3/2.
    """
    reduction = SiegelTheta(_siegel(tau)).reduction
    return reduction.tau.astype(complex), reduction.symplectic


def _siegel(tau: Any) -> Complex:
    """Return τ as a symmetric complex matrix; raises InvalidInput outside the Siegel half space."""
    try:
        matrix = np.array(tau, dtype=complex)
    except (TypeError, ValueError):
        raise InvalidInput(("tau",), "a square matrix of numbers", show(tau)) from None
    if (
        matrix.ndim != 2
        or matrix.shape[0] != matrix.shape[1]
        or not 1 <= len(matrix) <= _LARGEST_GENUS
    ):
        raise InvalidInput(
            ("tau",), f"a g × g matrix, g = 1 … {_LARGEST_GENUS}", f"shape {matrix.shape}"
        )
    if not np.all(np.isfinite(matrix)):
        raise InvalidInput(("tau",), "finite numbers", show(tau))
    defect = float(np.max(np.abs(matrix - matrix.T)))
    if defect > _SYMMETRY * float(np.max(np.abs(matrix))):
        raise InvalidInput(
            ("tau",), "a symmetric matrix", f"one that differs from its transpose by {defect:.3g}"
        )
    matrix = np.asarray((matrix + matrix.T) / 2)
    least = float(np.linalg.eigvalsh(matrix.imag)[0])
    if not least > 0:
        raise InvalidInput(
            ("tau",), "a positive definite imaginary part", f"one with least eigenvalue {least:.6g}"
        )
    return matrix


def _points(z: Any, genus: int) -> tuple[Complex, bool]:
    """Return points (N, g), and whether one was given by itself."""
    try:
        points = np.array(z, dtype=complex)
    except (TypeError, ValueError):
        raise InvalidInput(
            ("z",), f"a vector of {genus} numbers, or rows of them", show(z)
        ) from None
    if points.ndim not in (1, 2) or points.shape[-1] != genus:
        raise InvalidInput(
            ("z",), f"a vector of {genus} numbers, or rows of them", f"shape {points.shape}"
        )
    if not np.all(np.isfinite(points)):
        raise InvalidInput(("z",), "finite numbers", show(z))
    return np.atleast_2d(points), points.ndim == 1


def _characteristics(given: Any, genus: int) -> tuple[NDArray[np.float64], bool]:
    """Return characteristics (C, 2, g), and whether one was given by itself."""
    if given is None:
        return np.zeros((1, 2, genus)), True
    try:
        halves = np.array([[[float(x) for x in row] for row in one] for one in _to_list(given)])
    except (TypeError, ValueError):
        halves = np.empty(0)
    alone = np.ndim(given) == 2
    if halves.ndim != 3 or halves.shape[1:] != (2, genus) or not np.all(np.isfinite(halves)):
        raise InvalidInput(
            ("characteristic",),
            f"[ε, δ] of {genus} real numbers each, or a list of those",
            show(given),
        )
    return halves, alone


def _to_list(given: Any) -> Any:
    return [given] if np.ndim(given) == 2 else given
