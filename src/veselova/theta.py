"""Riemann theta functions of any matrix of the Siegel half space, with characteristics and
derivatives.

    θ[ε;δ](z|τ) = Σ_{m∈Z^g} exp(πi(m+ε)ᵀτ(m+ε) + 2πi(m+ε)·(z+δ))

    from veselova import theta
    theta.riemann_theta([0.1, 0.2j], [[1j, 0.5], [0.5, 1j]])
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import ArrayLike, NDArray

from veselova.analytic.theta.siegel_theta import SiegelTheta
from veselova.mechanics.core.arguments import takes_arrays
from veselova.mechanics.core.errors import Unsolved
from veselova.mechanics.core.toolkit_arguments import ThetaArguments, siegel_matrix
from veselova.mechanics.results.toolkit import ScaledTheta

__all__ = [
    "ScaledTheta",
    "evaluate_theta",
    "riemann_theta",
    "scaled_riemann_theta",
    "siegel_reduce",
    "theta_constants",
]

Complex = NDArray[np.complex128]

#: Budget: the most terms of a sum, some 2 GB.
_MOST_TERMS = 100_000_000


@takes_arrays
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
    return evaluate_theta(ThetaArguments.of(z, tau, characteristic, derivatives), False).values


@takes_arrays
def scaled_riemann_theta(
    z: ArrayLike, tau: ArrayLike, characteristic: ArrayLike | None = None, derivatives: int = 0
) -> ScaledTheta:
    """Return the same as ``riemann_theta`` as mantissas and exponents, with a bound
    of the error.
    """
    return evaluate_theta(ThetaArguments.of(z, tau, characteristic, derivatives))


def evaluate_theta(asked: ThetaArguments, with_errors: bool = True) -> ScaledTheta:
    """Return the theta functions of arguments that are validated already."""
    function = SiegelTheta(asked.tau)
    with np.errstate(over="ignore", invalid="ignore"):
        terms = function.terms
    if not terms < np.inf:
        raise Unsolved("beyond-floats", "the reduced τ leaves the range of a float")
    if not terms <= _MOST_TERMS:
        raise Unsolved("too-many-terms", f"the sum has about {terms:.1e} terms")
    take = (
        0 if asked.single_point else slice(None),
        0 if asked.single_characteristic else slice(None),
    )
    with np.errstate(over="ignore", invalid="ignore"):
        parts = function.values(asked.points, asked.characteristics, asked.derivatives, with_errors)
    if not all(np.all(np.isfinite(part)) for part in parts[: 3 if with_errors else 2]):
        reason = "an exponent or derivative leaves the range of a float: z is too far out"
        raise Unsolved("beyond-floats", reason)
    mantissas, exponents, errors = parts
    return ScaledTheta(
        np.asarray(mantissas[take]), np.asarray(exponents[take]), np.asarray(errors[take])
    )


@takes_arrays
def theta_constants(tau: ArrayLike) -> dict[tuple[tuple[float, ...], tuple[float, ...]], complex]:
    """Return θ[ε;δ](0|τ) of all half-integer characteristics by (ε, δ), entries 0 and ½; odd ones
    vanish exactly.
    """
    matrix = siegel_matrix(tau)
    genus = len(matrix)
    rows = list(itertools.product((0.0, 0.5), repeat=genus))
    pairs = [(epsilon, delta) for epsilon in rows for delta in rows]
    even = [(e, d) for e, d in pairs if round(4 * np.dot(e, d)) % 2 == 0]
    values = riemann_theta(np.zeros(genus), matrix, [[list(e), list(d)] for e, d in even])
    return {**dict.fromkeys(pairs, 0j), **dict(zip(even, values.tolist(), strict=True))}


@takes_arrays
def siegel_reduce(tau: ArrayLike) -> tuple[Complex, NDArray[np.int64]]:
    """Return the reduced τ' and the symplectic matrix [[A, B], [C, D]], (2g, 2g), with τ' =
    (Aτ+B)(Cτ+D)⁻¹.

    Reduced: Im τ' is reduced as a quadratic form, |Re τ'| ≤ ½, |τ'_11| ≥ 1, so that Im τ'_11 ≥
    √3/2. Raises Unsolved (``beyond-floats``) where doubles cannot hold it.
    """
    function = SiegelTheta(siegel_matrix(tau))
    try:
        return function.reduced, np.array(function.reduction.symplectic.tolist(), dtype=np.int64)
    except OverflowError:
        raise Unsolved("beyond-floats", "the symplectic matrix exceeds 64 bits") from None
