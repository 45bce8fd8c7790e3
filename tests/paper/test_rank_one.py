"""The rank-one flow: extended to R²ⁿ by the Dirac bracket, as a geodesic flow in τ, separated, and
as a Neumann system.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from draws import random_problem
from paper import rank_one
from veselova import InvalidInput, NeumannSystem, Veselova, solve
from veselova.mechanics.geometry import integrals_of_motion as integrals
from veselova.mechanics.geometry.integrals_of_motion import to_spheroconic

DIMENSIONS = range(2, 8)


def drawn(rng: np.random.Generator, n: int) -> tuple[Any, Any, Any, Any, Veselova]:
    """Return A, q, q̇, p and the problem."""
    problem = random_problem(rng, n, 10.0)
    return (
        problem.A,
        problem.q,
        problem.q_dot,
        integrals.momentum(problem.A, problem.q, problem.q_dot),
        problem,
    )


def canonical_bracket(first: Any, second: Any) -> float:
    n = first.size // 2
    return float(first[:n] @ second[n:] - first[n:] @ second[:n])


@pytest.mark.parametrize("n", DIMENSIONS)
def test_velocity_and_momentum_determine_each_other(n: int, rng: np.random.Generator) -> None:
    """(big_p) inverted by (dot_q), and ṗ = −Λq of (dot_p) along the motion."""
    A, q, q_dot, p, problem = drawn(rng, n)
    assert np.allclose(rank_one.velocity(A, q, p), q_dot, atol=1e-13)
    field = rank_one.extended_field(A, q, p)
    assert np.allclose(
        field[1], -rank_one.constraint_multiplier(A, q, p) * q, rtol=1e-12, atol=1e-15
    )
    assert np.isclose(rank_one.extended_hamiltonian(A, q, p), problem.energy, rtol=1e-12)
    h = 1e-4
    motion = solve(problem, [-h, h])
    rate = np.diff(integrals.momentum(A, motion.q, motion.q_dot), axis=0)[0] / (2 * h)
    assert np.allclose(rate, field[1], atol=1e-5 * np.max(np.abs(field[1])))


@pytest.mark.parametrize("n", DIMENSIONS)
def test_the_extended_system_keeps_its_two_functions_anywhere(
    n: int, rng: np.random.Generator
) -> None:
    A, q, p = np.exp(rng.uniform(0, 2, n)), rng.normal(size=n), rng.normal(size=n)
    q_dot, p_dot = rank_one.extended_field(A, q, p)
    assert abs(q @ q_dot) < 1e-12 * np.linalg.norm(q_dot)
    assert abs(q_dot @ p + q @ p_dot) < 1e-11 * (
        np.linalg.norm(q_dot) * np.linalg.norm(p) + np.linalg.norm(p_dot)
    )


@pytest.mark.parametrize("n", DIMENSIONS)
def test_the_dirac_tensor_is_the_bracket_of_its_definition_and_has_two_casimirs(
    n: int, rng: np.random.Generator
) -> None:
    q, p = rng.normal(size=n), rng.normal(size=n)
    tensor = rank_one.dirac_tensor(q, p)
    first, second = np.concatenate([2 * q, 0 * q]), np.concatenate([p, q])
    assert np.allclose(tensor @ first, 0, atol=1e-13)
    assert np.allclose(tensor @ second, 0, atol=1e-13)
    f, g = rng.normal(size=2 * n), rng.normal(size=2 * n)
    crossed = canonical_bracket(f, first) * canonical_bracket(g, second) - canonical_bracket(
        f, second
    ) * canonical_bracket(g, first)
    expected = canonical_bracket(f, g) - crossed / canonical_bracket(first, second)
    assert np.isclose(f @ tensor @ g, expected, rtol=1e-11, atol=1e-12)
    assert np.linalg.matrix_rank(tensor, tol=1e-9) == 2 * (n - 1)
    # Jacobi's identity: the cyclic sum of J ∂J vanishes.
    step = 1e-5
    slopes = [
        (rank_one.dirac_tensor(*np.split(z, 2)) - rank_one.dirac_tensor(*np.split(w, 2)))
        / (2 * step)
        for z, w in (
            (np.concatenate([q, p]) + step * e, np.concatenate([q, p]) - step * e)
            for e in np.eye(2 * n)
        )
    ]
    cyclic = np.einsum("il,ljk->ijk", tensor, np.array(slopes))
    total = cyclic + cyclic.transpose(1, 2, 0) + cyclic.transpose(2, 0, 1)
    assert np.allclose(total, 0, atol=1e-7 * np.max(np.abs(cyclic)) + 1e-8)


@pytest.mark.parametrize("n", DIMENSIONS)
def test_the_bracket_form_is_the_explicit_vector_form_where_q_and_p_are_orthogonal(
    n: int, rng: np.random.Generator
) -> None:
    A, q, _, p, _ = drawn(rng, n)
    for scale in (1.0, 1.7):
        bracket, explicit = (
            field(A, scale * q, p) for field in (rank_one.bracket_field, rank_one.extended_field)
        )
        for found, expected in zip(bracket, explicit, strict=True):
            assert np.allclose(found, expected, rtol=1e-11, atol=1e-13 * np.max(np.abs(p)))


@pytest.mark.parametrize("n", range(3, 7))
def test_the_force_is_the_right_hand_side_of_the_lagrange_d_alembert_equation(
    n: int, rng: np.random.Generator
) -> None:
    """(Pi): Ψ = ⟨𝓘ω, pr_⊥[ω, q∧ξ]⟩ for tangent ξ, pr_⊥ ξ∧q̇ = ξ∧q̇; and π = ∂L/∂q, so that (43)
    gives ṗ = −Λq.
    """
    A, q, q_dot, _, problem = drawn(rng, n)
    xi = rng.normal(size=n)
    xi -= (xi @ q) * q

    def wedge(x: Any, y: Any) -> Any:
        return np.outer(x, y) - np.outer(y, x)

    omega, eta, rest = wedge(q, q_dot), wedge(q, xi), np.eye(n) - np.outer(q, q)
    bracket = rest @ (omega @ eta - eta @ omega) @ rest
    assert np.allclose(bracket, wedge(xi, q_dot), atol=1e-13)
    Psi = 0.5 * np.sum(np.outer(A, A) * omega / np.prod(A) * bracket)
    force = rank_one.nonholonomic_force(A, q, q_dot)
    assert np.isclose(force @ xi, Psi, rtol=1e-11, atol=1e-14)
    step = 1e-6
    slope = [
        (integrals.energy(A, q + step * e, q_dot) - integrals.energy(A, q - step * e, q_dot))
        / (2 * step)
        for e in np.eye(n)
    ]
    assert np.allclose(force, slope, rtol=1e-6, atol=1e-7 * np.max(np.abs(force)))
    assert np.isclose(q @ force, 2 * problem.energy, rtol=1e-12)


@pytest.mark.parametrize("n", range(2, 6))
def test_the_extended_flow_has_the_measure_of_the_corollary(
    n: int, rng: np.random.Generator
) -> None:
    """Corollary redLR, (Aq,q)^(−(n−2)/2)σ: the field keeps φ₁ and φ₂, so a measure of T*Sⁿ⁻¹ is one
    of R²ⁿ there.
    """
    A, q, _, p, _ = drawn(rng, n)

    def weighted(z: Any) -> Any:
        x, y = np.split(z, 2)
        return rank_one.invariant_density(A, x) * np.concatenate(rank_one.extended_field(A, x, y))

    z, step = np.concatenate([q, p]), 1e-5
    slopes = np.array(
        [(weighted(z + step * e) - weighted(z - step * e)) / (2 * step) for e in np.eye(2 * n)]
    )
    assert abs(np.trace(slopes)) < 1e-7 * np.linalg.norm(slopes)


@pytest.mark.parametrize("n", DIMENSIONS)
def test_the_geodesic_hamiltonian_is_the_legendre_transform_of_the_lagrangian(
    n: int, rng: np.random.Generator
) -> None:
    A, q, q_dot, p, problem = drawn(rng, n)
    rate = rank_one.chaplygin_rate(A, q)
    v = q_dot / rate
    p_tilde = rank_one.geodesic_momentum(A, q, v)
    assert np.allclose(p_tilde, rate * p, rtol=1e-12)
    assert np.isclose(rank_one.geodesic_lagrangian(A, q, v), problem.energy, rtol=1e-12)
    assert np.isclose(rank_one.geodesic_hamiltonian(A, p_tilde), p_tilde @ v / 2, rtol=1e-12)
    gradient = np.concatenate([np.zeros(n), p_tilde / A])
    q_prime, p_prime = rank_one.geodesic_field(A, q, p_tilde)
    assert np.allclose(
        np.concatenate([q_prime, p_prime]), rank_one.dirac_tensor(q, p_tilde) @ gradient, atol=1e-13
    )
    assert np.allclose(q_prime, v, atol=1e-13)


@pytest.mark.parametrize("n", range(2, 7))
def test_the_veselova_motion_is_a_geodesic_in_chaplygins_time(
    n: int, rng: np.random.Generator
) -> None:
    """Theorem main, item 1: the Hamiltonian flow of H* integrated on its own, against q(t) at τ =
    τ₁/√(2h).
    """
    A, q, q_dot, _, problem = drawn(rng, n)
    motion = solve(problem, np.linspace(0, 6, 7))
    tau = motion.tau1 / np.sqrt(2 * problem.energy)
    p_tilde = rank_one.geodesic_momentum(A, q, q_dot / rank_one.chaplygin_rate(A, q))

    def field(_: float, z: Any) -> Any:
        return np.concatenate(rank_one.geodesic_field(A, *np.split(z, 2)))

    start = np.concatenate([q, p_tilde])
    found = solve_ivp(
        field, (0, tau[-1]), start, method="DOP853", t_eval=tau, rtol=1e-12, atol=1e-13
    ).y.T
    assert np.max(np.abs(found[:, :n] - motion.q)) < 1e-9
    assert np.allclose(rank_one.geodesic_hamiltonian(A, found[:, n:]), problem.energy, rtol=1e-10)
    rates = rank_one.chaplygin_rate(A, motion.q)[:, None]
    assert np.max(
        np.abs(found[:, n:] - rates * integrals.momentum(A, motion.q, motion.q_dot))
    ) < 1e-8 * np.max(np.abs(p_tilde))


@pytest.mark.parametrize("n", range(2, 7))
def test_the_geodesic_flow_separates_in_spheroconic_coordinates(
    n: int, rng: np.random.Generator
) -> None:
    """Theorem main, item 2: L* = ½ Σ m_s λ_s'², (prod_n), and Stäckel's separation gives 2h
    Π(λ−c_k) back.
    """
    A, q, q_dot, _, problem = drawn(rng, n)
    spheroconic = to_spheroconic(A, q)
    rates = rank_one.spheroconic_velocity(A, q, q_dot / rank_one.chaplygin_rate(A, q))
    metric = rank_one.stackel_metric(A, spheroconic)
    assert np.all(metric > 0)
    assert np.isclose(np.sum(metric * rates**2) / 2, problem.energy, rtol=1e-9)
    assert np.isclose(
        np.prod(spheroconic * np.append(A[1:], 1.0)[: n - 1]) * A[0], q @ (A * q), rtol=1e-11
    )
    momenta = metric * rates
    expected = 2 * problem.energy * np.polynomial.polynomial.polyfromroots(problem.constants)
    assert np.allclose(rank_one.separation_constants(A, spheroconic, momenta), expected, rtol=1e-6)
    values = [2 * problem.energy * np.prod(x - problem.constants) for x in spheroconic]
    assert np.allclose(
        rank_one.separated_energies(A, spheroconic, momenta),
        values,
        rtol=1e-7,
        atol=1e-12 * np.max(np.abs(values)),
    )


@pytest.mark.parametrize("n", range(2, 7))
def test_the_abel_jacobi_quadratures_hold_along_a_motion(n: int, rng: np.random.Generator) -> None:
    """(quad_N) with (Rad): the sums are δ_{k,n−1} in τ₁, at every time and for R with c_1 = 0 and
    the problem's constants.
    """
    A, _, _, _, problem = drawn(rng, n)
    motion = solve(problem, np.linspace(-20, 20, 21))
    velocity = integrals.neumann_velocity(A, motion.q, motion.q_dot)
    sums = rank_one.abel_jacobi_sums(A, motion.q, velocity)
    assert np.allclose(sums, np.eye(n - 1)[-1], atol=1e-6)
    rates, lam = rank_one.spheroconic_velocity(A, motion.q, velocity), motion.spheroconic
    R = (
        -np.prod(lam[..., None] - 1 / A, axis=-1)
        * lam
        * np.prod(lam[..., None] - problem.constants, axis=-1)
    )
    others = np.prod(lam[:, :, None] - lam[:, None, :] + np.eye(n - 1), axis=-1)
    assert np.allclose((rates * others) ** 2, 4 * R, rtol=1e-5, atol=1e-9 * np.max(np.abs(R)))


@pytest.mark.parametrize("n", range(2, 8))
def test_the_neumann_system_of_a_motion_moves_as_it_does(n: int, rng: np.random.Generator) -> None:
    """Theorem LR→Nn: q(t) at τ₁(t) solves (4.7) with F_0 = 0; and back, with the energy and the
    frame.
    """
    problem = random_problem(rng, n, 10.0)
    neumann = problem.neumann()
    assert abs(neumann.integrals(neumann.start)["F0"][0]) < 1e-12 * (
        problem.q @ (problem.A * problem.q)
    )
    motion = solve(problem, [-4.0, 0.5, 5.0])
    found = solve(neumann, motion.tau1, "numeric")
    assert np.max(np.abs(found.q - motion.q)) < 1e-9
    again = rank_one.from_neumann(neumann, problem.energy, problem.frame)
    assert np.allclose(again.q_dot, problem.q_dot, rtol=1e-11, atol=1e-13)
    assert np.isclose(rank_one.from_neumann(neumann, "7/2").energy, 3.5, rtol=1e-12)


@pytest.mark.parametrize("n", range(2, 6))
def test_the_steps_of_the_proof_of_the_reduction_to_neumann(
    n: int, rng: np.random.Generator
) -> None:
    """(4.9), (4.10), (4.13), (4.14), (4.11), with (4.12) for P'; ω̇ is a central difference of the
    motion to 25 digits.
    """
    A, q, v, _, problem = drawn(rng, n)
    det, qAq, h = np.prod(A), q @ (A * q), problem.energy

    def wedge(x: Any, y: Any) -> Any:
        return np.outer(x, y) - np.outer(y, x)

    def inertia(omega: Any) -> Any:
        return np.outer(A, A) * omega / det

    step = 1e-4
    motion = solve(problem, [-step, step], digits=25)
    omega = wedge(q, v)
    omega_dot = (motion.omega[1] - motion.omega[0]) / (2 * step)
    mu = np.sqrt(qAq / (2 * h * det))
    assert np.isclose(mu, 1 / integrals.time_rate(A, q, v), rtol=1e-12)  # (4.9) against (4.6)
    scale = np.max(np.abs(inertia(omega_dot))) + np.max(np.abs(inertia(omega)))
    left = wedge(inertia(omega_dot) @ q, q) + wedge(inertia(omega) @ v, q)
    assert np.max(np.abs(left)) < 1e-6 * scale  # (4.10)
    # (4.12): ½ d(μ²)/dt = (Aq,q̇)/(2h det A)
    P_prime = mu**2 * omega_dot + (A * q) @ v / (h * 2 * det) * omega
    first = wedge(inertia(P_prime) @ q, q)
    second = (-qAq * wedge(inertia(omega) @ v, q) + (A * q) @ v * wedge(inertia(omega) @ q, q)) / (
        2 * h * det
    )
    size = np.max(np.abs(first)) + np.max(np.abs(second))
    assert np.allclose(first, second, atol=1e-6 * size)  # (4.13), (4.14)
    assert np.allclose(first, wedge(q, A * q) / det, atol=1e-6 * size)  # (4.11)


@pytest.mark.parametrize("n", DIMENSIONS)
def test_geodesics_and_neumann_motions_correspond(n: int, rng: np.random.Generator) -> None:
    """Proposition N->Geo, both ways."""
    A, q, q_dot, _, problem = drawn(rng, n)
    v = q_dot / rank_one.chaplygin_rate(A, q)
    q_prime = rank_one.geodesic_to_neumann(A, q, v)
    assert np.allclose(q_prime, integrals.neumann_velocity(A, q, q_dot), rtol=1e-11, atol=1e-14)
    assert np.allclose(rank_one.neumann_to_geodesic(q_prime, problem.energy), v, rtol=1e-12)


def test_a_neumann_motion_off_the_zero_level_is_no_veselova_motion() -> None:
    with pytest.raises(InvalidInput, match="F_0") as raised:
        rank_one.from_neumann(NeumannSystem([3, 2, 1], [0.6, 0, 0.8], [0, 1, 0]), 1)
    assert raised.value.field == "q_prime"
    zero = Veselova([3, 2, 1], [0.6, 0, 0.8], [0, 1, 0]).neumann()
    for energy in (0, -1, "x", float("nan"), True):
        with pytest.raises(InvalidInput) as raised:
            rank_one.from_neumann(zero, energy)
        assert raised.value.field == "energy"
    with pytest.raises(InvalidInput, match="moves"):
        Veselova([3, 2, 1], [0.6, 0, 0.8], [0, 0, 0]).neumann()
