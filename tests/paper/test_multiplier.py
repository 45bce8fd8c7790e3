"""Chaplygin's reducing multiplier: the measure, Theorem Th_reduce both ways, the Hamiltonian form
in τ, and what obstructs it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from paper.chaplygin_multiplier import (
    ChaplyginMultiplier,
    gyroscopic_tensor,
    invariant_density,
    restricted_determinant,
)
from stiefel_chart import Chart, admissible_basis, divergence, slopes
from stiefel_draws import KINDS, random_columns, random_flow, random_inertia
from veselova.mechanics.bodies.stiefel_inertia import SpecialInertia, body_inertia
from veselova.mechanics.geometry.stiefel import angular_velocity, product

RANKS = [(n, r) for n in range(3, 6) for r in range(1, n)]

#: What central differences of second derivatives leave here.
ROUGH = 1e-7


def operator(rng: np.random.Generator, n: int, kind: str) -> Any:
    """Return an inertia operator whose own units are those of the problem."""
    inertia: Any = body_inertia(random_inertia(rng, n, kind), n)
    return replace(inertia, exponent=0)


def drawn_chart(
    rng: np.random.Generator, n: int, r: int, kind: str, *potential: Any
) -> tuple[Chart, Any]:
    """Return a chart and a point (u, p) in it."""
    chart = Chart(operator(rng, n, kind), random_columns(rng, n, r), *potential)
    return chart, np.concatenate([0.3 * rng.normal(size=chart.N), rng.normal(size=chart.N)])


def in_new_time(chart: Chart, multiplier: ChaplyginMultiplier, z: Any) -> Any:
    """Return (du/dτ, dp̃/dτ) at z = (u, p̃)."""
    N, u = chart.N, z[: chart.N]
    X, tangents, _ = chart.point(u)
    rate = multiplier.value(X)
    u_dot, p_dot = np.split(chart.field(np.concatenate([u, z[N:] / rate])), [N])
    X_dot = np.tensordot(u_dot, tangents, axes=1)
    growth = multiplier.slopes(X, angular_velocity(X, X_dot)[None])[0]
    return np.concatenate([u_dot / rate, p_dot + growth * z[N:] / rate])


def of_hamiltonian(chart: Chart, multiplier: ChaplyginMultiplier, z: Any) -> Any:
    """Return (∂H*/∂p̃, −∂H*/∂u) at z = (u, p̃)."""
    N = chart.N
    gradient = slopes(
        lambda y: multiplier.hamiltonian(chart.point(y[:N])[0], chart.momentum(y[:N], y[N:])), z
    )
    return np.concatenate([gradient[N:], -gradient[:N]])


def clebsch(weights: Any) -> tuple[Any, Any]:
    """Return V = ½ Σ w_i x_i² + x_0³ of the first column, and its gradient."""

    def value(X: Any) -> float:
        return float(weights @ X[:, 0] ** 2 / 2 + X[0, 0] ** 3)

    def gradient(X: Any) -> Any:
        slope = np.zeros_like(X)
        slope[:, 0] = weights * X[:, 0]
        slope[0, 0] += 3 * X[0, 0] ** 2
        return slope

    return value, gradient


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("n", "r"), [*RANKS, (2, 1), (4, 4)])
def test_the_reduced_flow_preserves_its_measure(
    n: int, r: int, kind: str, rng: np.random.Generator
) -> None:
    """Theorem mes: div(ρF) = 0 for ρ = 1/√det(𝓘|𝓓_r) in canonical coordinates; with ρ = 1 not,
    where there are constraints.
    """
    chart, z = drawn_chart(rng, n, r, kind)

    def density(y: Any) -> float:
        return invariant_density(chart.inertia, chart.point(y[: chart.N])[0])

    assert abs(divergence(density, chart.field, z)) < ROUGH
    assert (abs(divergence(lambda _: 1.0, chart.field, z)) > 1e-4) == (r < n - 1)


@pytest.mark.parametrize(("n", "r"), RANKS)
def test_the_density_of_the_special_inertia_is_a_power_of_the_pluecker_sum(
    n: int, r: int, rng: np.random.Generator
) -> None:
    """(true): det(𝓘|𝓓_r) ∝ [Σ A_I (e_1∧…∧e_r)_I²]^(n−r−1), and the sum is det XᵀAX."""
    A = np.exp(rng.uniform(0, 1.5, n))
    inertia = SpecialInertia.of(A)
    ratios = []
    for _ in range(3):
        X = random_columns(rng, n, r)
        ratios.append(
            restricted_determinant(inertia, X)
            / np.linalg.det(X.T @ (A[:, None] * X)) ** (n - r - 1)
        )
    assert np.allclose(ratios, ratios[0], rtol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("n", "r"), [(3, 1), (4, 2), (5, 2)])
def test_the_gyroscopic_tensor_is_what_the_flow_adds_to_a_hamiltonian_one(
    n: int, r: int, kind: str, rng: np.random.Generator
) -> None:
    """Π = ṗ + ∂H/∂q of (2.1) in canonical coordinates, against the tensor; its cyclic
    sum vanishes.
    """
    chart, z = drawn_chart(rng, n, r, kind)
    u, p = z[: chart.N], z[chart.N :]
    X, tangents, _ = chart.point(u)
    gradient = slopes(lambda y: chart.hamiltonian(y[: chart.N], y[chart.N :]), z)
    field = chart.field(z)
    assert np.allclose(field[: chart.N], gradient[chart.N :], atol=ROUGH)
    force = field[chart.N :] + gradient[: chart.N]
    tensor, basis = gyroscopic_tensor(chart.inertia, X)
    components = product(chart.inertia.apply(basis), chart.omega(u, p))
    directions = product(chart.inertia.apply(basis)[None], angular_velocity(X, tangents)[:, None])
    assert np.allclose(
        np.einsum("abc,a,b,kc->k", tensor, components, components, directions), force, atol=ROUGH
    )
    assert np.allclose(
        tensor + tensor.transpose(1, 2, 0) + tensor.transpose(2, 0, 1), 0, atol=1e-13
    )
    assert np.allclose(tensor, tensor.transpose(1, 0, 2), atol=1e-14)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("n", "r"), RANKS)
def test_the_logarithm_of_the_density_is_the_trace_of_the_force(
    n: int, r: int, kind: str, rng: np.random.Generator
) -> None:
    """(x3): (∇_p,Π) = α(q̇) with d ln f + α = 0, f = 𝒩^(N−1); the slopes are those of 𝒩 itself."""
    multiplier = ChaplyginMultiplier(operator(rng, n, kind), r)
    X, N = random_columns(rng, n, r), multiplier.freedom
    tensor, basis = gyroscopic_tensor(multiplier.inertia, X)
    alpha = 2 * np.einsum("abb->a", tensor)
    assert np.allclose(alpha, -(N - 1) * multiplier.slopes(X, basis), atol=1e-13)
    step = 1e-5
    for direction in admissible_basis(X):
        turns = (
            np.linalg.qr(
                X - s * step * direction @ X + step * step / 2 * direction @ direction @ X
            )[0]
            for s in (1, -1)
        )
        upper, lower = (np.log(multiplier.value(x)) for x in turns)
        assert np.isclose(
            (upper - lower) / (2 * step), multiplier.slopes(X, direction[None])[0], atol=ROUGH
        )
    ratio = [
        multiplier.value(x) ** (N - 1) / invariant_density(multiplier.inertia, x)
        for x in (X, random_columns(rng, n, r))
    ]
    assert np.isclose(*ratio, rtol=1e-12)


@pytest.mark.parametrize("n", [3, 4, 5])
def test_the_rank_one_flow_with_special_inertia_is_hamiltonian_in_chaplygins_time(
    n: int, rng: np.random.Generator
) -> None:
    """Theorem main, item 1, and item 1 of Theorem Th_reduce: (x2) holds with 𝒩 = √(det A/(Aq,q))
    and f = 𝒩^(n−2).
    """
    chart, z = drawn_chart(rng, n, 1, "special")
    multiplier = ChaplyginMultiplier(chart.inertia, 1)
    assert np.allclose(
        in_new_time(chart, multiplier, z), of_hamiltonian(chart, multiplier, z), atol=ROUGH
    )
    A, q = 7.0 * np.exp(rng.uniform(0, 1.5, n)), chart.X0[:, 0]
    assert np.isclose(
        ChaplyginMultiplier.of({"special": A}, n, 1).value(chart.X0),
        np.sqrt(np.prod(A) / (A @ q**2)),
        rtol=1e-12,
    )
    assert multiplier.obstruction(chart.X0) < 1e-12


@pytest.mark.parametrize("kind", KINDS)
def test_with_two_degrees_of_freedom_every_measure_is_a_multiplier(
    kind: str, rng: np.random.Generator
) -> None:
    """Item 2 of Theorem Th_reduce: n = 3, r = 1, any inertia tensor and a potential that is no
    special one.
    """
    value, gradient = clebsch(rng.normal(size=3))
    chart, z = drawn_chart(rng, 3, 1, kind, value, gradient)
    multiplier = ChaplyginMultiplier(chart.inertia, 1, value)
    assert np.allclose(
        in_new_time(chart, multiplier, z), of_hamiltonian(chart, multiplier, z), atol=ROUGH
    )
    assert multiplier.obstruction(chart.X0) < 1e-12


def test_a_density_that_depends_on_momenta_gives_one_that_does_not_and_holds_with_potentials(
    rng: np.random.Generator,
) -> None:
    """Remark after Theorem Th_reduce: f(q,p) solves (x7) with V = 0, so does f(q,0), and with V ≠ 0
    only that one.
    """
    inertia, X0 = operator(rng, 4, "matrix"), random_columns(rng, 4, 2)
    plain, forced = Chart(inertia, X0), Chart(inertia, X0, *clebsch(rng.normal(size=4)))
    z = np.concatenate([0.3 * rng.normal(size=plain.N), rng.normal(size=plain.N)])

    def general(y: Any) -> float:
        u, p = y[: plain.N], y[plain.N :]
        return invariant_density(inertia, plain.point(u)[0]) * float(
            1 + np.sum(plain.momentum(u, p) ** 2)
        )

    def at_rest(y: Any) -> float:
        return general(np.concatenate([y[: plain.N], np.zeros(plain.N)]))

    assert abs(divergence(general, plain.field, z)) < ROUGH
    assert abs(divergence(at_rest, plain.field, z)) < ROUGH
    assert abs(divergence(at_rest, forced.field, z)) < ROUGH
    assert abs(divergence(general, forced.field, z)) > 1e-4


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("n", "r"), [(4, 1), (4, 2), (5, 3), (4, 3)])
def test_the_obstruction_is_the_distance_from_a_hamiltonian_flow(
    n: int, r: int, kind: str, rng: np.random.Generator
) -> None:
    """The field in τ against that of H*: their difference is the traceless part of Π, and so is
    what makes Ω not invariant.
    """
    chart, z = drawn_chart(rng, n, r, kind)
    multiplier = ChaplyginMultiplier(chart.inertia, r)
    X = chart.point(z[: chart.N])[0]
    distance = np.linalg.norm(
        in_new_time(chart, multiplier, z) - of_hamiltonian(chart, multiplier, z)
    )
    jacobian = slopes(lambda y: in_new_time(chart, multiplier, y), z).T
    J = np.block(
        [
            [np.zeros((chart.N, chart.N)), np.eye(chart.N)],
            [-np.eye(chart.N), np.zeros((chart.N, chart.N))],
        ]
    )
    form = J @ jacobian  # symmetric where the field is Hamiltonian
    asymmetry = np.linalg.norm(form - form.T) / np.linalg.norm(form)
    reducible = r == n - 1 or (kind == "special" and r == 1)
    assert (multiplier.obstruction(X) < 1e-12) == reducible
    assert (distance < 1e-6) == reducible
    assert (asymmetry < 1e-6) == reducible
    assert 0 <= multiplier.obstruction(X) <= 1


def test_for_higher_rank_no_multiplier_is_nearer_than_that_of_the_measure(
    rng: np.random.Generator,
) -> None:
    inertia, X = operator(rng, 5, "special"), random_columns(rng, 5, 2)
    tensor, basis = gyroscopic_tensor(inertia, X)
    multiplier = ChaplyginMultiplier(inertia, 2)
    best = multiplier.obstruction(X)
    assert best > 0.5
    for _ in range(20):
        other = multiplier.slopes(X, basis) + 0.1 * rng.normal(size=len(basis))
        once = np.multiply.outer(other, np.eye(len(basis)))
        printed = once.transpose(1, 2, 0) - (once + once.transpose(1, 0, 2)) / 2
        assert np.linalg.norm(tensor - printed) / np.linalg.norm(tensor) > best


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("n", "r"), [(2, 1), (3, 1), (4, 2)])
def test_the_new_hamiltonian_is_the_legendre_transform_of_the_new_lagrangian(
    n: int, r: int, kind: str, rng: np.random.Generator
) -> None:
    problem = random_flow(rng, n, r, kind)
    multiplier = ChaplyginMultiplier(problem.inertia, r, lambda X: float(X[0, 0]))
    X, rate = problem.X, multiplier.value(problem.X)
    X_prime, P_tilde = -problem.omega @ X / rate, multiplier.momentum(X, problem.P)
    H, L = multiplier.hamiltonian(X, P_tilde), multiplier.lagrangian(X, X_prime)
    assert np.isclose(H + L, np.sum(P_tilde * X_prime), rtol=1e-12)
    assert np.isclose(H, problem.energy + X[0, 0], rtol=1e-12)
