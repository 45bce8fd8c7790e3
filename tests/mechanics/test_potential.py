"""Potentials on the sphere: values, gradients, companions, and what is refused."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from veselova import InvalidInput, VeselovaSO3
from veselova.mechanics.potentials.laurent import LaurentPolynomial, monomials
from veselova.mechanics.potentials.polynomial import Potential, duality_defect, family

MOMENTS = np.array([1.0, 1.7, 2.6])
INERTIA, INVERSE = np.diag(MOMENTS), np.diag(1 / MOMENTS)


def points(rng: np.random.Generator, count: int = 5) -> Any:
    gamma = rng.uniform(0.2, 1.0, (count, 3)) * rng.choice([-1.0, 1.0], (count, 3))
    return gamma / np.linalg.norm(gamma, axis=1, keepdims=True)


def random_terms(rng: np.random.Generator) -> list[tuple[float, tuple[int, int, int]]]:
    return [(float(rng.normal()), tuple(int(p) for p in rng.integers(-3, 4, 3))) for _ in range(6)]  # type: ignore[misc]


def test_a_laurent_polynomial_has_the_values_of_its_terms(rng: np.random.Generator) -> None:
    terms, gamma = random_terms(rng), points(rng)
    expected = sum(
        c * gamma[:, 0] ** a * gamma[:, 1] ** b * gamma[:, 2] ** d for c, (a, b, d) in terms
    )
    assert np.allclose(LaurentPolynomial.of(terms).value(gamma), expected, rtol=1e-13)
    assert np.isclose(LaurentPolynomial.of(terms).value(gamma[2]), expected[2], rtol=1e-13)


def test_the_gradient_is_the_derivative_of_the_value(rng: np.random.Generator) -> None:
    f, gamma = LaurentPolynomial.of(random_terms(rng)), points(rng)
    for j in range(3):
        moved = gamma + 1e-200j * np.eye(3)[j]
        slope = np.imag(monomials(f.exponents, moved) @ f.coefficients) / 1e-200
        assert np.allclose(f.gradient(gamma)[:, j], slope, rtol=1e-11, atol=1e-11)


def test_symbols_and_numbers_give_the_same_monomials(rng: np.random.Generator) -> None:
    f = LaurentPolynomial.of(random_terms(rng))
    exact = np.array([Fraction(3, 7), Fraction(-2, 3), Fraction(5, 4)], dtype=object)
    expected = [exact[0] ** a * exact[1] ** b * exact[2] ** c for a, b, c in f.powers]
    assert np.allclose(
        np.array(monomials(f.exponents, exact), dtype=float),
        np.array(expected, dtype=float),
        rtol=1e-14,
    )
    assert np.allclose(
        monomials(f.exponents, exact.astype(float)), np.array(expected, dtype=float), rtol=1e-13
    )


def test_the_clebsch_potential_is_the_quadratic_form_of_the_inertia(
    rng: np.random.Generator,
) -> None:
    gamma = points(rng)
    V = Potential.of({"clebsch": "7/10"}, INERTIA, INVERSE)
    assert np.allclose(V.terms.value(gamma), 0.7 * np.sum(gamma**2 * MOMENTS, axis=1), rtol=1e-14)
    assert V.unconditional


def test_the_family_is_equation_3_5(rng: np.random.Generator) -> None:
    gamma, alphas = points(rng), rng.normal(size=5)
    V = Potential.of({"family": alphas}, INERTIA, INVERSE)
    form, square = np.sum(gamma**2 * MOMENTS, axis=1), np.sum(gamma**2 * MOMENTS**2, axis=1)
    expected = (
        alphas[0] * (square - form**2) + alphas[1] * form + np.sum(alphas[2:] / gamma**2, axis=1)
    )
    assert np.allclose(V.terms.value(gamma), expected, rtol=1e-12)
    assert not V.unconditional


@pytest.mark.parametrize("member", range(5))
def test_every_member_of_the_family_has_its_companion(
    member: int, rng: np.random.Generator
) -> None:
    V, F = family(np.eye(5)[member], INERTIA, INVERSE)
    gamma = points(rng, 20)
    size = np.max(np.abs(F.gradient(gamma)))
    assert np.max(np.abs(duality_defect(V, F, INERTIA, gamma))) < 1e-12 * size
    assert np.max(np.abs(duality_defect(V, F.times(1.01), INERTIA, gamma))) > 1e-4 * size


def test_a_companion_of_a_polynomial_is_taken_when_it_is_one() -> None:
    terms = [
        {"coefficient": m, "powers": list(p)} for m, p in zip(MOMENTS, 2 * np.eye(3, dtype=int))
    ]
    det = float(np.prod(MOMENTS))
    right = [{"coefficient": -det / m, "powers": p["powers"]} for m, p in zip(MOMENTS, terms)]
    V = Potential.of({"polynomial": terms, "companion": right}, INERTIA, INVERSE)
    assert V.companion is not None
    assert V.unconditional
    with pytest.raises(InvalidInput, match=r"potential\.companion: required a function F"):
        Potential.of({"polynomial": terms, "companion": terms}, INERTIA, INVERSE)


def test_centrifugal_terms_ask_for_principal_axes() -> None:
    tensor = [[2.0, 0.1, 0.0], [0.1, 1.5, 0.0], [0.0, 0.0, 1.0]]
    with pytest.raises(InvalidInput, match="unless the inertia is diagonal"):
        VeselovaSO3(tensor, [0.48, 0.6, 0.64], [1, 0, 0], {"family": [0, 0, 0, 1, 0]})
