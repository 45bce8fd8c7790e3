"""Separation of variables: docs/separable.md, formula by formula and along motions."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.polynomial import polynomial

from draws import random_problem
from paper.separation import separated_family, separation_polynomial, turning_points
from veselova import Unsolved, VeselovaSO3, solve
from veselova.mechanics.geometry import integrals_of_motion as integrals
from veselova.mechanics.geometry.integrals_of_motion import to_spheroconic
from veselova.mechanics.potentials import separable as separation
from veselova.mechanics.potentials.separable import SeparablePotential

MOMENTS = np.array([1.0, 1.7, 2.6])
ALPHAS = {
    "none": [0, 0, 0, 0, 0],
    "clebsch": [0, 0.7, 0, 0, 0],
    "quartic": [0.3, 0, 0, 0, 0],
    "centrifugal": [0, 0, 0.1, 0, 0.3],
    "all": [0.3, 0.2, 0.1, 0.2, 0.05],
}


def random_potential(rng: np.random.Generator, n: int, degree: int) -> SeparablePotential:
    """Return one with every power of λ up to the degree and every 1/q_i²."""
    return SeparablePotential(rng.normal(size=degree + 1) / 3, rng.uniform(0.01, 0.05, n))


def random_state(rng: np.random.Generator, n: int) -> tuple[Any, Any, Any]:
    """Return A with I between 1 and 3, well apart, and a tangent velocity."""
    A = 1 / (1 + 2 * (np.arange(n) + rng.uniform(0, 0.4, n)) / n)
    q, v = rng.uniform(0.4, 1, n), rng.normal(size=n)
    q /= np.linalg.norm(q)
    return A, q, v - (v @ q) * q


def spheroconic_rates(A: Any, q: Any, v: Any) -> Any:
    """dλ_s for dq = v: λ_s is a zero of Σ q_i²/(λ−I_i)."""
    lam, I = to_spheroconic(A, q), 1 / A
    return 2 * np.array([np.sum(q * v / (x - I)) / np.sum(q * q / (x - I) ** 2) for x in lam])


def products(lam: Any) -> Any:
    """Π_{s≠k}(λ_k−λ_s)."""
    return np.array(
        [np.prod([x - y for j, y in enumerate(lam) if j != k]) for k, x in enumerate(lam)]
    )


@pytest.mark.parametrize("n", range(2, 7))
def test_the_potential_is_the_staeckel_sum(n: int, rng: np.random.Generator) -> None:
    """V = Σ_k v(λ_k)/Π_{s≠k}(λ_k−λ_s)."""
    (A, q, _), V = random_state(rng, n), random_potential(rng, n, n + 2)
    lam, I = to_spheroconic(A, q), 1 / A
    slopes = np.array([np.prod(I[i] - np.delete(I, i)) for i in range(n)])
    v = [
        polynomial.polyval(x, V.polynomial) - np.sum(V.centrifugal * slopes / (x - I)) for x in lam
    ]
    assert np.isclose(V.value(A, q), np.sum(np.array(v) / products(lam)), rtol=1e-9)


@pytest.mark.parametrize("n", range(3, 7))
def test_the_first_of_the_hierarchy_is_clebsch_and_all_are_polynomials_in_the_moments(
    n: int, rng: np.random.Generator
) -> None:
    A, q, _ = random_state(rng, n)
    a, b = (float(np.sum(q * q / A**j)) for j in (1, 2))
    s1, s2 = np.sum(1 / A), (np.sum(1 / A) ** 2 - np.sum(1 / A**2)) / 2
    first, second = (
        SeparablePotential(np.eye(n + 1)[m], np.zeros(n)).value(A, q) for m in (n - 1, n)
    )
    assert np.isclose(first, s1 - a, rtol=1e-12)
    assert np.isclose(second, a * a - b - s1 * a + s1 * s1 - s2, rtol=1e-12)
    assert np.isclose(SeparablePotential(np.eye(n + 1)[n - 2], np.zeros(n)).value(A, q), 1.0)
    assert SeparablePotential(np.ones(n - 2), np.zeros(n)).value(A, q) == 0.0


@pytest.mark.parametrize("name", ALPHAS)
def test_the_family_3_5_is_separable(name: str, rng: np.random.Generator) -> None:
    V = separated_family(1 / MOMENTS, ALPHAS[name])
    for _ in range(5):
        q = rng.uniform(0.3, 1, 3)
        q /= np.linalg.norm(q)
        problem = VeselovaSO3(MOMENTS, q, [0, 0, 0], {"family": ALPHAS[name]}, normalize=True)
        assert np.isclose(
            V.value(1 / MOMENTS, q), problem.potential.terms.value(q), rtol=1e-12, atol=1e-14
        )


@pytest.mark.parametrize("n", range(2, 7))
def test_the_constants_solve_the_separated_equations_at_every_state(
    n: int, rng: np.random.Generator
) -> None:
    """λ_k'² Π² = 4R(λ_k) with C of degree n−2 and leading coefficient the energy, T + V."""
    for _ in range(5):
        (A, q, v), V = random_state(rng, n), random_potential(rng, n, n + 1)
        C = separation.separation_constants(A, q, v, V)
        assert C.shape == (n - 1,)
        assert np.isclose(C[-1], integrals.energy(A, q, v) + V.value(A, q), rtol=1e-11)
        R, lam = separation_polynomial(A, C, V), to_spheroconic(A, q)
        rates = spheroconic_rates(A, q, v) / np.sqrt(np.prod(A) / (q @ (A * q)))
        values = polynomial.polyval(lam, R)
        assert np.allclose(
            (rates * products(lam)) ** 2, 4 * values, rtol=1e-8, atol=1e-9 * np.max(np.abs(R))
        )


@pytest.mark.parametrize("n", range(3, 7))
def test_without_potential_the_polynomial_is_that_of_the_paper(
    n: int, rng: np.random.Generator
) -> None:
    """R = 2h·(Rad): zeros 0, I_i and c_2 … c_{n−1}."""
    problem = random_problem(rng, n, 4.0)
    nothing = SeparablePotential(np.zeros(1), np.zeros(n))
    C = separation.separation_constants(problem.A, problem.q, problem.q_dot, nothing)
    R = separation_polynomial(problem.A, C, nothing)
    printed = (
        -2 * problem.energy * polynomial.polyfromroots([0.0, *(1 / problem.A), *problem.constants])
    )
    assert len(R) == 2 * n
    assert np.allclose(R, printed, rtol=1e-9, atol=1e-11 * np.max(np.abs(printed)))


@pytest.mark.parametrize(
    ("name", "degree"),
    [("none", 5), ("centrifugal", 5), ("clebsch", 6), ("quartic", 7), ("all", 7)],
)
def test_along_motions_in_the_family_the_quadratures_hold(
    name: str, degree: int, rng: np.random.Generator
) -> None:
    A, V = 1 / MOMENTS, separated_family(1 / MOMENTS, ALPHAS[name])
    q = np.array([0.5, -0.6, 0.7]) / np.linalg.norm([0.5, -0.6, 0.7])
    problem = VeselovaSO3(MOMENTS, q, np.cross(q, rng.normal(size=3)), {"family": ALPHAS[name]})
    motion = solve(problem, np.linspace(0, 20, 41))
    first: Any = None
    for gamma, Omega in zip(motion.gamma, motion.Omega):
        v = np.cross(gamma, Omega)
        C = separation.separation_constants(A, gamma, v, V)
        first = C if first is None else first
        assert np.allclose(C, first, rtol=1e-11)
        R, lam = separation_polynomial(A, first, V), to_spheroconic(A, gamma)
        assert len(R) - 1 == degree
        rates = spheroconic_rates(A, gamma, v) / np.sqrt(np.prod(A) / (gamma @ (A * gamma)))
        deviation = (rates * products(lam)) ** 2 - 4 * polynomial.polyval(lam, R)
        assert np.max(np.abs(deviation)) < 1e-10 * np.max(np.abs(R))
        ends = turning_points(A, R, lam)
        assert np.all(ends[:, 0] <= lam + 1e-12)
        assert np.all(lam <= ends[:, 1] + 1e-12)
    # f_0 is the additional integral of (3.5) up to sign and Σ α_{i+2}(I_i − I_j − I_k).
    shift = np.dot(ALPHAS[name][2:], 2 * MOMENTS - np.sum(MOMENTS))
    assert np.isclose(-first[0] + shift, motion.integrals["F2"][0], rtol=1e-11)
    assert np.isclose(first[1], motion.integrals["energy"][0], rtol=1e-11)


@pytest.mark.parametrize("name", ["clebsch", "quartic", "centrifugal", "all"])
def test_coordinates_reach_their_turning_points_and_no_farther(
    name: str, rng: np.random.Generator
) -> None:
    A, V = 1 / MOMENTS, separated_family(1 / MOMENTS, ALPHAS[name])
    q = np.array([0.5, -0.6, 0.7]) / np.linalg.norm([0.5, -0.6, 0.7])
    problem = VeselovaSO3(MOMENTS, q, np.cross(q, rng.normal(size=3)), {"family": ALPHAS[name]})
    motion = solve(problem, np.linspace(0, 40, 3001), "numeric", "taylor")
    R = separation_polynomial(
        A, separation.separation_constants(A, q, np.cross(q, problem.Omega), V), V
    )
    lam = to_spheroconic(A, motion.gamma)
    ends = turning_points(A, R, lam[0])
    assert np.all(ends[:, 0] - 1e-10 <= np.min(lam, axis=0))
    assert np.all(np.max(lam, axis=0) <= ends[:, 1] + 1e-10)
    assert np.allclose(np.min(lam, axis=0), ends[:, 0], atol=1e-3)
    assert np.allclose(np.max(lam, axis=0), ends[:, 1], atol=1e-3)


def test_a_centrifugal_term_bars_the_plane_and_an_attracting_one_opens_it() -> None:
    A, q, Omega = 1 / MOMENTS, np.array([0.6, 0.48, 0.64]), np.array([0.3, -0.7, 0.24375])
    lam = to_spheroconic(A, q)
    for alpha in (0.1, 0.0, -0.1):
        alphas = [0, 0.1, alpha, 0, 0]
        V = separated_family(A, alphas)
        R = separation_polynomial(
            A, separation.separation_constants(A, q, np.cross(q, Omega), V), V
        )
        expected = (
            -2 * MOMENTS[0] * alpha * ((MOMENTS[0] - MOMENTS[1]) * (MOMENTS[0] - MOMENTS[2])) ** 2
        )
        assert np.isclose(polynomial.polyval(MOMENTS[0], R), expected, atol=1e-13)
        low = turning_points(A, R, lam)[0, 0]
        assert (low > MOMENTS[0] + 1e-3) if alpha > 0 else np.isclose(low, MOMENTS[0], atol=1e-12)
        problem = VeselovaSO3(MOMENTS, q, Omega, {"family": alphas})
        if alpha < 0:
            with pytest.raises(Unsolved, match="collision"):
                solve(problem, [30.0])
        else:
            crossed = np.min(solve(problem, np.linspace(0, 30, 301)).gamma[:, 0]) < 0
            assert crossed == (alpha == 0)
