"""The reduced flow on T*V(r,n): the lemmas of section 5, the flow two ways, the full motion it is
the shadow of, bad input.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from conftest import slow
from deviations import agree
from stiefel_chart import admissible_basis, dimension
from stiefel_draws import KINDS, random_columns, random_flow, random_inertia
from veselova import StiefelFlow, Veselova, solve
from veselova.mechanics.bodies.stiefel_inertia import BodyInertia, body_inertia
from veselova.mechanics.core.flow import FLOATS
from veselova.mechanics.geometry.so_n import coefficients, skew
from veselova.mechanics.geometry.stiefel import (
    ad_invariants,
    admissible_part,
    angular_velocity,
    cotangent,
    momentum_map,
    product,
    tangent_part,
    trace_integrals,
)

RANKS = [(n, r) for n in range(2, 6) for r in range(1, n + 1)]


def wedge(x: Any, y: Any) -> Any:
    return np.outer(x, y) - np.outer(y, x)


def random_skew(rng: np.random.Generator, n: int) -> Any:
    return skew(rng.normal(size=n * (n - 1) // 2), n)


def operator(rng: np.random.Generator, n: int, kind: str) -> BodyInertia:
    return body_inertia(random_inertia(rng, n, kind), n)


@pytest.mark.parametrize(("n", "r"), RANKS)
def test_the_momentum_map_is_the_admissible_part_of_the_angular_velocity(
    n: int, r: int, rng: np.random.Generator
) -> None:
    """Lemma after (cond_X): Φ(X,−ωX) = pr_𝓓 ω for every ω, and (Poisson) holds for
    every tangent Ẋ.
    """
    X, omega = random_columns(rng, n, r), random_skew(rng, n)
    assert np.allclose(angular_velocity(X, -omega @ X), admissible_part(X, omega), atol=1e-14)
    gamma = X @ X.T
    assert np.allclose(
        admissible_part(X, omega), gamma @ omega + omega @ gamma - gamma @ omega @ gamma, atol=1e-14
    )
    X_dot = tangent_part(X, rng.normal(size=(n, r)))
    assert np.allclose(-angular_velocity(X, X_dot) @ X, X_dot, atol=1e-14)
    vectors = sum(wedge(X[:, a], X_dot[:, a]) for a in range(r))
    for a in range(r):
        for b in range(a + 1, r):
            vectors = vectors + 0.5 * (X[:, a] @ X_dot[:, b] - X_dot[:, a] @ X[:, b]) * wedge(
                X[:, a], X[:, b]
            )
    assert np.allclose(angular_velocity(X, X_dot), vectors, atol=1e-14)


@pytest.mark.parametrize(("n", "r"), RANKS)
def test_the_admissible_basis_spans_what_the_projection_keeps(
    n: int, r: int, rng: np.random.Generator
) -> None:
    X = random_columns(rng, n, r)
    basis = admissible_basis(X)
    assert len(basis) == dimension(n, r)
    assert np.allclose(product(basis[:, None], basis[None]), np.eye(len(basis)), atol=1e-14)
    assert np.allclose(admissible_part(X, basis), basis, atol=1e-14)
    trace = sum(
        coefficients(admissible_part(X, skew(c, n)))[i]
        for i, c in enumerate(np.eye(n * (n - 1) // 2))
    )
    assert np.isclose(trace, dimension(n, r))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("n", "r"), RANKS)
def test_the_momentum_is_the_derivative_of_the_reduced_lagrangian(
    n: int, r: int, kind: str, rng: np.random.Generator
) -> None:
    """P = ∂L/∂Ẋ in all nr directions, Φ* = pr_𝓓 𝓘ω, and ω(X,P) is the inverse."""
    inertia, X = operator(rng, n, kind), random_columns(rng, n, r)
    X_dot, xi = tangent_part(X, rng.normal(size=(n, r))), rng.normal(size=(n, r))
    omega = angular_velocity(X, X_dot)
    P = cotangent(X, inertia.apply(omega))

    def lagrangian(velocity: Any) -> float:
        w = angular_velocity(X, velocity)
        return float(product(inertia.apply(w), w)) / 2

    slope = (lagrangian(X_dot + xi) - lagrangian(X_dot - xi)) / 2  # L is quadratic: no truncation
    assert np.isclose(np.sum(P * xi), slope, rtol=1e-11, atol=1e-13)
    assert np.allclose(X.T @ P + P.T @ X, 0, atol=1e-13)
    assert np.allclose(momentum_map(X, P), admissible_part(X, inertia.apply(omega)), atol=1e-13)
    assert np.allclose(
        inertia.angular_velocity(X, P, inertia.parameters, FLOATS), omega, atol=1e-12
    )


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("n", "r"), [(n, r) for n, r in RANKS if n > 2])
def test_the_flow_satisfies_the_lagrange_d_alembert_equation(
    n: int, r: int, kind: str, rng: np.random.Generator
) -> None:
    """(1.2) with both sides evaluated: (∂L/∂X − d/dt ∂L/∂Ẋ, ξ) = ⟨𝓘Φ(Ẋ), pr_⊥[Φ(Ẋ),Φ(ξ)]⟩ for every
    tangent ξ.
    """
    inertia, X = operator(rng, n, kind), random_columns(rng, n, r)
    omega = angular_velocity(X, tangent_part(X, rng.normal(size=(n, r))))
    P, step = cotangent(X, inertia.apply(omega)), 1e-6

    def lagrangian(X: Any, X_dot: Any) -> float:
        """L on R^2nr, as its formula extends it."""
        w = angular_velocity(X, X_dot)
        return float(product(inertia.apply(w), w)) / 2

    def gradient(X: Any, X_dot: Any, xi: Any, which: int) -> float:
        moved = (
            (X + s * step * xi, X_dot) if which == 0 else (X, X_dot + s * step * xi)
            for s in (1, -1)
        )
        upper, lower = (lagrangian(*point) for point in moved)
        return (upper - lower) / (2 * step)

    def state(t: float) -> tuple[Any, Any]:
        """X and Ẋ at a small time along the flow, to third order."""
        x, p = X, P
        for _ in range(2):
            w = inertia.angular_velocity(x, p, inertia.parameters, FLOATS)
            middle = (x - t / 4 * w @ x, p - t / 4 * w @ p)
            w = inertia.angular_velocity(*middle, inertia.parameters, FLOATS)
            x, p = x - t / 2 * w @ middle[0], p - t / 2 * w @ middle[1]
        return x, -inertia.angular_velocity(x, p, inertia.parameters, FLOATS) @ x

    for _ in range(3):
        xi = tangent_part(X, rng.normal(size=(n, r)))
        h = 1e-3
        rate = (gradient(*state(h), xi, 1) - gradient(*state(-h), xi, 1)) / (2 * h)
        left = gradient(X, -omega @ X, xi, 0) - rate
        eta = angular_velocity(X, xi)
        bracket = omega @ eta - eta @ omega
        right = float(product(inertia.apply(omega), bracket - admissible_part(X, bracket)))
        assert np.isclose(left, right, atol=2e-5 * (1 + abs(left)))


@pytest.mark.parametrize(("n", "r"), [(4, 1), (4, 2), (5, 3)])
def test_traces_are_those_of_the_matrix_polynomial(
    n: int, r: int, rng: np.random.Generator
) -> None:
    X, momentum = random_columns(rng, n, r), random_skew(rng, n)
    found = iter(trace_integrals(X, momentum))
    for k in range(2, n + 1):
        points = np.arange(k + 1.0)
        values = [np.trace(np.linalg.matrix_power(momentum + x * X @ X.T, k)) for x in points]
        polynomial = np.linalg.solve(np.vander(points, increasing=True), values)
        assert np.isclose(polynomial[k], r)
        for j in range(1, k + 1):  # degree in 𝓜
            assert np.isclose(
                polynomial[k - j], next(found) if j % 2 == 0 else 0.0, rtol=1e-8, atol=1e-8
            )
    assert next(found, None) is None
    powers = [np.trace(np.linalg.matrix_power(momentum, 2 * k)) for k in range(1, 4)]
    assert np.allclose(
        powers, [2 * (-1) ** k * np.sum(ad_invariants(momentum) ** (2 * k)) for k in range(1, 4)]
    )


@pytest.mark.daily(3)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("n", "r"), [(2, 1), (3, 1), (3, 2), slow(4, 2), slow(5, 3), slow(6, 4)])
def test_both_formulations_keep_the_integrals_and_agree(
    n: int, r: int, kind: str, rng: np.random.Generator
) -> None:
    problem, times = random_flow(rng, n, r, kind), np.linspace(-10, 10, 11)
    reduced, momentum = (solve(problem, times, formulation=name) for name in problem.formulations)
    assert np.max(np.abs(reduced.X - momentum.X)) < 1e-10
    agree(reduced, momentum, "X")
    for found in (reduced, momentum):
        assert max(found.drift.values()) < 1e-12
        assert found.provenance.details["formulation"] in problem.formulations
    D_defect = reduced.omega - admissible_part(reduced.X, reduced.omega)
    assert np.max(np.abs(D_defect)) < 1e-13 * np.max(np.abs(reduced.omega))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("n", "r"), [(3, 1), (4, 2), (5, 2), (5, 4)])
def test_the_full_flow_on_the_group_projects_to_the_reduced_flow(
    n: int, r: int, kind: str, rng: np.random.Generator
) -> None:
    """Ė = −ωE with g𝓜g⁻¹ constant, 𝓜 = pr_𝓓 𝓘ω + pr_⊥ ω on all of SO(n) (mom), against X(t) of the
    reduced flow.
    """
    problem = random_flow(rng, n, r, kind)
    inertia, times = problem.inertia, np.linspace(0, 10, 6)
    frame = np.column_stack([problem.X, np.linalg.svd(problem.X)[0][:, r:]])
    in_space = frame.T @ admissible_part(problem.X, inertia.apply(problem.omega)) @ frame

    def field(_: float, state: Any) -> Any:
        E = state.reshape(n, n)
        basis = skew(np.eye(n * (n - 1) // 2), n)
        images = coefficients(basis + admissible_part(E[:, :r], inertia.apply(basis) - basis))
        omega = skew(np.linalg.solve(images.T, coefficients(E @ in_space @ E.T)), n)
        return (-omega @ E).ravel()

    full = solve_ivp(
        field, (0, 10), frame.ravel(), method="DOP853", t_eval=times, rtol=1e-12, atol=1e-13
    )
    E = full.y.T.reshape(-1, n, n)
    assert np.max(np.abs(E[:, :, :r] - solve(problem, times).X)) < 1e-9


@pytest.mark.parametrize("n", [2, 3, 5])
def test_rank_one_with_special_inertia_is_the_veselova_problem(
    n: int, rng: np.random.Generator
) -> None:
    A = np.exp(rng.uniform(0, 1.5, n))
    q, q_dot = random_columns(rng, n, 1), rng.normal(size=(n, 1)) / np.sqrt(n)
    problem = StiefelFlow({"special": A}, q, X_dot=q_dot, normalize=True)
    body = Veselova(A, q[:, 0], q_dot[:, 0], normalize=True)
    found, expected = solve(problem, [-3, 0, 8]), solve(body, [-3, 0, 8])
    assert np.max(np.abs(found.X[:, :, 0] - expected.q)) < 1e-10
    assert np.isclose(problem.energy, body.energy, rtol=1e-13)


@pytest.mark.parametrize("kind", KINDS)
def test_scales_of_inertia_and_time_do_not_matter(kind: str, rng: np.random.Generator) -> None:
    inertia, X, X_dot = (
        random_inertia(rng, 3, kind),
        random_columns(rng, 3, 2),
        rng.normal(size=(3, 2)),
    )
    plain = StiefelFlow(inertia, X, X_dot=X_dot, normalize=True)
    large = {name: (np.array(values) * 2.0**40).tolist() for name, values in inertia.items()}
    scaled = StiefelFlow(large, X, X_dot=X_dot * 2.0**30, normalize=True)
    first, second = solve(plain, [1.0, 4.0]), solve(scaled, np.array([1.0, 4.0]) / 2.0**30)
    assert np.array_equal(first.X, second.X)
    assert np.allclose(second.omega, first.omega * 2.0**30, rtol=1e-14)
    again = StiefelFlow(large, X, scaled.P)
    assert np.isclose(again.energy, scaled.energy, rtol=1e-13)
