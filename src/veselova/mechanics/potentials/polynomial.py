"""Potentials V(γ) on the sphere, as data, with the companion F(γ) that completes an additional
integral where one is known.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from veselova.mechanics.core.arguments import Path
from veselova.mechanics.core.errors import Faults, InvalidInput, field_faults, show
from veselova.mechanics.core.exact_input import exact_number, exact_vector, plain
from veselova.mechanics.geometry.sphere import INPUT_TOLERANCE
from veselova.mechanics.potentials.laurent import LaurentPolynomial, read_terms, read_whole_numbers

__all__ = ["Potential", "duality_defect", "family", "without_companion"]

Array = NDArray[np.float64]

#: Powers and terms of a user's polynomial: far more than any system of the field has, and still
#: quick to evaluate.
_LARGEST_POWER = 24
_MOST_TERMS = 64

#: What a potential is made of; the companion belongs to the polynomial.
_PARTS = ("clebsch", "family", "polynomial", "companion")

#: Points of the sphere, away from the planes γ_i = 0, at which identities between polynomials are
#: looked at.
_POINTS = 24


@dataclass(frozen=True, eq=False)
class Potential:
    """A Laurent polynomial V(γ) and its companion F(γ), for one inertia tensor.

    The companion makes F_2 + F an integral of the Veselova system on (Ω,γ) = 0 (duality lemma); for
    the Euler–Poisson equations it makes f_2 + F one on (𝒥Ω,γ) = 0. None: not known.
    ``unconditional``: it is one for any value of these constants.

    Data, None for V = 0, or a sum of these as one mapping:

    - {"clebsch": α}: α(𝓘γ,γ)
    - {"family": [α₁ … α₅]}: equation (3.5, printed 4.10); for the Euler–Poisson equations its dual
    - {"polynomial": [{"coefficient": c, "powers": [a, b, c]}, …]}: powers any integers, with
      {"companion": […]} in the same form where the user knows it (it is checked)
    """

    terms: LaurentPolynomial
    companion: LaurentPolynomial | None
    unconditional: bool
    given: Mapping[str, Any] | None

    @classmethod
    def of(cls, given: Any, inertia: Array, inverse: Array, *, dual: bool = False) -> Potential:
        """Return the potential of given data; raises InvalidInput, located below ``potential``.

        ``inertia``, ``inverse``: the tensor and its inverse, (3, 3). ``dual``: it belongs to the
        Euler–Poisson equations.
        """
        none = LaurentPolynomial.of([])
        if given is None:
            return cls(none, none, True, None)
        if not isinstance(given, Mapping) or not given:
            raise InvalidInput(
                ("potential",), f"an object with some of {', '.join(_PARTS)}, or null", show(given)
            )
        faults = Faults()
        faults.found += field_faults(("potential",), given, _PARTS)
        alpha = faults.attempt(exact_number, given.get("clebsch", 0), ("potential", "clebsch"))
        alphas = faults.attempt(_alphas, given.get("family", (0,) * 5), inertia)
        polynomial = faults.attempt(_polynomial, given, "polynomial")
        known = faults.attempt(_polynomial, given, "companion")
        faults.require_none()
        pairs = []
        if alpha and "clebsch" in given:
            pairs.append(family((0.0, float(alpha), 0.0, 0.0, 0.0), inertia, inverse))
        if alphas and "family" in given:
            pairs.append(
                family(alphas, inverse, inertia)[::-1] if dual else family(alphas, inertia, inverse)
            )
        terms = sum((pair[0] for pair in pairs), none)
        companion: LaurentPolynomial | None = sum((pair[1] for pair in pairs), none)
        if polynomial is not None:
            terms = terms + polynomial
            companion = None if known is None or companion is None else companion + known
        unconditional = False
        if companion is not None:
            unconditional = _check_pair(
                terms, companion, inverse if dual else inertia, dual, "companion" in given
            )
        return cls(terms, companion, unconditional, plain(given))

    def require_finite(self, gamma: Array) -> None:
        """Raise InvalidInput unless the potential and its force are finite at a point of the
        sphere.
        """
        with np.errstate(all="ignore"):
            largest = np.append(np.abs(self.terms.gradient(gamma)), self.terms.size(gamma))
            if self.companion is not None:
                largest = np.append(largest, np.abs(self.companion.value(gamma)))
        if not np.all(np.isfinite(largest)):
            raise InvalidInput(
                ("potential",),
                "one that is finite at the start",
                "a value or a slope beyond the range of a float",
            )


def family(
    alphas: Sequence[float], inertia: Array, inverse: Array
) -> tuple[LaurentPolynomial, LaurentPolynomial]:
    """Return V(γ) of (3.5, printed 4.10) and F(γ) with F_2 + F the additional integral; 𝓘 and 𝓘⁻¹
    as (3, 3), diagonal unless α₃ = α₄ = α₅ = 0.

    F = α₁ det𝓘 (𝓘γ,γ)(𝓘⁻¹γ,γ) − α₂ det𝓘 (𝓘⁻¹γ,γ) + α₃(I₃γ₂² + I₂γ₃²)/γ₁² + cyclic, where the paper
    prints I₂γ₂² + I₃γ₃².
    """
    quartic, quadratic, *centrifugal = alphas
    with np.errstate(over="ignore", invalid="ignore"):  # refused where the start is looked at
        form = LaurentPolynomial.quadratic(inertia)
        adjugate = LaurentPolynomial.quadratic(np.linalg.det(inertia) * inverse)
        V = form.times(quadratic)
        F = adjugate.times(-quadratic)
        if quartic != 0:
            V = V + (
                LaurentPolynomial.quadratic(inertia @ inertia) + (form * form).times(-1.0)
            ).times(quartic)
            F = F + (form * adjugate).times(quartic)
    moments = np.diag(inertia).tolist()
    for i, alpha in enumerate(centrifugal):
        V = V + LaurentPolynomial.of([(alpha, _exponents({i: -2}))])
        for j, k in (((i + 1) % 3, (i + 2) % 3), ((i + 2) % 3, (i + 1) % 3)):
            F = F + LaurentPolynomial.of([(alpha * moments[k], _exponents({i: -2, j: 2}))])
    return V, F


def without_companion(given: Any) -> Any:
    """Return the data of a potential without its companion."""
    if not isinstance(given, Mapping) or "companion" not in given or "polynomial" not in given:
        return given
    return {name: value for name, value in given.items() if name != "companion"}


def duality_defect(
    V: LaurentPolynomial, F: LaurentPolynomial, inertia: Array, gamma: Array
) -> Array:
    """Return [γ×∂F/∂γ − 𝓘(γ×∂V/∂γ)]×γ at points of the sphere (..., 3): zero where V and F are
    companions (duality lemma).

    The paper prints 𝓘(∂V/∂γ)×γ for 𝓘(∂V/∂γ×γ).
    """
    force = np.cross(gamma, V.gradient(gamma)) @ inertia
    return np.asarray(np.cross(np.cross(gamma, F.gradient(gamma)) - force, gamma), dtype=np.float64)


def _check_pair(
    terms: LaurentPolynomial, companion: LaurentPolynomial, inertia: Array, dual: bool, user: bool
) -> bool:
    """Return whether the integral holds for any value of the constants; raises InvalidInput for a
    wrong companion of a user's.
    """
    points = np.random.default_rng(3).uniform(0.3, 1.0, (_POINTS, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    V, F = (companion, terms) if dual else (terms, companion)
    with np.errstate(all="ignore"):
        force = np.cross(points, V.gradient(points)) @ inertia
        size = np.max(np.abs(force)) + np.max(np.abs(F.gradient(points)))
        if user:
            defect = np.max(np.abs(duality_defect(V, F, inertia, points)))
            if not defect <= INPUT_TOLERANCE * size:
                required = "a function F with [γ×∂F/∂γ − 𝓘(γ×∂V/∂γ)]×γ = 0 on the sphere"
                raise InvalidInput(
                    ("potential", "companion"), required, f"one that leaves {defect:.3g}"
                )
        # Off the constraint, F_2 + F changes at the rate (Ω,γ)(𝓘(γ×∂V/∂γ),γ).
        return bool(np.max(np.abs(np.sum(force * points, axis=1))) <= INPUT_TOLERANCE * size)


def _alphas(given: Any, inertia: Array) -> tuple[float, ...]:
    alphas = tuple(float(x) for x in exact_vector(given, ("potential", "family"), 5))
    if any(alphas[2:]) and np.any(inertia != np.diag(np.diag(inertia))):
        required = (
            "alpha_3 = alpha_4 = alpha_5 = 0 unless the inertia is diagonal (γ_i are "
            "principal components)"
        )
        raise InvalidInput(("potential", "family"), required, "an inertia with products of inertia")
    return alphas


def _polynomial(potential: Mapping[str, Any], name: str) -> LaurentPolynomial | None:
    """Return the polynomial, or the companion that belongs to one; None where it is left out."""
    path = ("potential", name)
    if name not in potential:
        return None
    given = potential[name]
    if "polynomial" not in potential:
        raise InvalidInput(path, "a polynomial that it belongs to", "none")
    if given is None and name == "companion":
        return None
    form = '{"coefficient": c, "powers": [a, b, c]}'
    return LaurentPolynomial.of(read_terms(given, path, _MOST_TERMS, form, _powers))


def _powers(given: Any, path: Path) -> tuple[int, int, int]:
    a, b, c = read_whole_numbers(given, path, [(-_LARGEST_POWER, _LARGEST_POWER)] * 3)
    return a, b, c


def _exponents(powers: Mapping[int, int]) -> tuple[int, int, int]:
    return powers.get(0, 0), powers.get(1, 0), powers.get(2, 0)
