"""The misprints of the paper that docs/errata.md lists: the printed formula fails on random data,
the corrected one holds.
"""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
import pytest

from draws import random_problem
from generic_torus import GenericTorus
from lr_draws import random_lr
from paper import invariant_measure as measure
from paper import rank_one
from paper.chaplygin_multiplier import ChaplyginMultiplier
from paper.confocal_quadrics import lax_matrix, lax_partner
from paper.lr_reduction import ChaplyginReduction
from stiefel_chart import Chart, dimension, slopes
from stiefel_draws import random_columns, random_inertia
from veselova import EllipsoidGeodesic, EulerPoisson, LRSystem, VeselovaSO3, solve
from veselova.mechanics.bodies.stiefel_inertia import body_inertia
from veselova.mechanics.core.flow import FLOATS
from veselova.mechanics.geometry import integrals_of_motion as integrals
from veselova.mechanics.geometry.integrals_of_motion import to_spheroconic
from veselova.mechanics.geometry.so_n import coefficients, skew
from veselova.mechanics.geometry.stiefel import (
    admissible_part,
    angular_velocity,
    momentum_map,
    product,
    tangent_part,
)


@pytest.mark.parametrize("N", range(2, 7))
def test_the_jacobi_identities_hold_with_the_factors_turned_round(
    N: int, rng: np.random.Generator
) -> None:
    rho = rng.normal(size=N)

    def total(m: int, sign: int) -> float:
        return float(
            sum(
                rho[s] ** m / np.prod([sign * (rho[s] - rho[k]) for k in range(N) if k != s])
                for s in range(N)
            )
        )

    assert all(abs(total(m, 1)) < 1e-8 for m in range(N - 1))
    assert np.isclose(total(N - 1, 1), 1.0)
    assert np.isclose(total(N - 1, -1), (-1) ** (N - 1))  # as printed, with ρ_l − ρ_s


@pytest.mark.parametrize("n", range(2, 7))
def test_the_lagrangian_in_spheroconic_coordinates_has_a_minus_sign(
    n: int, rng: np.random.Generator
) -> None:
    problem = random_problem(rng, n, 5.0)
    A, q, inverse = problem.A, problem.q, 1 / problem.A
    # any tangent vector will do for dq/dτ
    velocity = integrals.neumann_velocity(A, q, problem.q_dot)
    step = 1e-6
    lam = to_spheroconic(A, q)

    def moved(offset: float) -> Any:
        x = q + offset * velocity
        return to_spheroconic(A, x / np.linalg.norm(x))

    rate = (moved(step) - moved(-step)) / (2 * step)
    printed = 0.0
    for k in range(n - 1):
        others = np.prod([lam[k] - lam[s] for s in range(n - 1) if s != k])
        printed += others / (np.prod(lam[k] - inverse) * lam[k]) * rate[k] ** 2 / 8
    true = ((A * velocity) @ velocity * ((A * q) @ q) - ((A * q) @ velocity) ** 2) / (
        2 * (q @ (A * q))
    )
    assert np.isclose(-printed, true, rtol=1e-5)


def test_in_three_dimensions_the_factor_gamma_is_missing_after_4_2a(
    rng: np.random.Generator,
) -> None:
    inertia, omega, gamma = np.diag([1.0, 2.0, 3.5]), rng.normal(size=3), rng.normal(size=3)
    gamma /= np.linalg.norm(gamma)
    m = inertia @ omega - (inertia @ omega @ gamma) * gamma + (omega @ gamma) * gamma
    inverse_gamma = np.linalg.solve(inertia, gamma)
    coefficient = (m @ inverse_gamma - m @ gamma) / (gamma @ inverse_gamma)
    assert np.allclose(m - coefficient * gamma, inertia @ omega)
    assert not np.allclose(m - coefficient, inertia @ omega)


@pytest.mark.parametrize("n", [3, 4, 5])
def test_wurzel_takes_the_derivative_of_small_psi(n: int, rng: np.random.Generator) -> None:
    """n_k with ψ(r) = Π(r − c_k); the printed Ψ'(c_k), Ψ(r) = Π(r − I_i), gives another length. γ
    is n_k at c = 0, minus the printed sum where Ξ_s = λ_s'/2 has its sign.
    """
    solution = GenericTorus(random_problem(rng, n, 5.0))
    at = solution.attitude(rng.uniform(0, 1, (1, n - 1)))
    constants = np.array(solution.spectrum.constants, dtype=float)
    inverse = np.array(solution.spectrum.inverse, dtype=float)
    q, spheroconic = at.q[0], at.spheroconic[0]
    apart = inverse[:, None] - spheroconic
    Xi = (q * at.q_prime[0]) @ (1 / apart) / -(q**2 @ (1 / apart**2))
    for k, c in enumerate(constants):  # c_1 = 0 is that of γ, the last column
        U, small = np.prod(c - spheroconic), np.prod(np.delete(c - constants, k))
        found = q * np.sqrt(abs(U / small)) * ((1 / apart) @ (Xi / (c - spheroconic)))
        found *= np.sign(found @ at.normals[0][:, k - 1]) if k else 1
        assert np.allclose(found, at.normals[0][:, k - 1], rtol=1e-8, atol=1e-12)
        assert not np.isclose(small, np.polyval(np.polyder(np.poly(inverse)), c), rtol=1e-3)


@pytest.mark.parametrize("n", [3, 5])
def test_4_15_needs_its_second_weight_and_its_brackets(n: int, rng: np.random.Generator) -> None:
    """Ξ = (Aq,q̇)𝓘ω·q − (Aq,q)𝓘ω·q̇ = −2h Aq up to a multiple of q, with 2h = [(Aq,q)(Aq̇,q̇) −
    (Aq,q̇)²]/det A.
    """
    problem = random_problem(rng, n, 5.0)
    A, q, v, det = problem.A, problem.q, problem.q_dot, np.prod(problem.A)
    inertia_omega = (np.outer(A * q, A * v) - np.outer(A * v, A * q)) / det
    first = (A * q) @ v * (inertia_omega @ q)
    true = first - (A * q) @ q * (inertia_omega @ v)
    printed = first - (A * q) @ v * (inertia_omega @ v)

    def across(x: Any) -> Any:
        return x - (x @ q) * q

    expected = across(-2 * problem.energy * A * q)
    assert np.allclose(across(true), expected, rtol=1e-9, atol=1e-12 * np.max(np.abs(expected)))
    assert not np.allclose(across(printed), expected, rtol=1e-3)
    unbracketed = (A * q) @ q * ((A * v) @ v) / det - ((A * q) @ v) ** 2
    assert not np.isclose(unbracketed, 2 * problem.energy, rtol=1e-6)


def _geodesic(rng: np.random.Generator, step: float) -> Any:
    problem = EllipsoidGeodesic(
        rng.uniform(1, 3, 4), rng.normal(size=4), rng.normal(size=4), normalize=True
    )
    return problem.A, solve(problem, [1 - step, 1.0, 1 + step], "numeric", "taylor")


def test_knoerrers_time_change_is_printed_upside_down(rng: np.random.Generator) -> None:
    """The normal obeys q'' = −A⁻¹q + λq in τ₁ only with dτ₁/ds = √((V,A⁻¹V)/(X,A⁻²X)): its speed
    gives F_0 = 0.
    """
    A, found = _geodesic(rng, 1e-4)
    q, V = found.frame[1, :, 0], found.X_dot[1]
    dq = (found.frame[2, :, 0] - found.frame[0, :, 0]) / 2e-4
    ratio = np.sqrt((V @ (V / A)) / np.sum((found.X[1] / A) ** 2))

    def F0(rate: float) -> float:
        v = dq / rate
        return float((v @ (A * v)) * (q @ (A * q)) - (q @ (A * v)) ** 2 - q @ (A * q))

    assert abs(F0(ratio)) < 1e-6
    assert abs(F0(1 / ratio)) > 1e-2


def test_mosers_parameter_runs_along_the_geodesic(rng: np.random.Generator) -> None:
    A, found = _geodesic(rng, 1e-4)
    before, middle, after = lax_matrix(A, found.X, found.X_dot)
    B = lax_partner(A, found.X[1], found.X_dot[1])
    rate = (after - before) / 2e-4 * np.sum((found.X[1] / A) ** 2)
    commutator = middle @ B - B @ middle
    assert np.allclose(rate, commutator, atol=1e-6)
    assert np.max(np.abs(rate + commutator)) > 1e-2


def rate_along(problem: Any, function: Any) -> float:
    """The derivative of a function of (Ω, γ) along the field of a body in units of order one, by a
    complex step.
    """
    flow = problem.flow()
    rate = flow.vector_field(0.0, flow.initial) / flow.time_unit
    Omega = problem.Omega + 1e-100j * rate[:3] / flow.time_unit
    gamma = problem.gamma + 1e-100j * rate[3::3]
    return float(np.imag(function(Omega, gamma)) / 1e-100)


@pytest.mark.parametrize("member", range(5))
def test_the_integral_of_3_5_has_the_square_of_the_momentum_and_its_moments_exchanged(
    member: int, rng: np.random.Generator
) -> None:
    I, alpha, det = np.array([1.0, 1.7, 2.6]), np.eye(5)[member], 1.7 * 2.6
    gamma = np.array([0.48, 0.6, 0.64])
    problem = VeselovaSO3(I, gamma, np.cross(gamma, rng.normal(size=3)), {"family": alpha})

    def integral(Omega: Any, gamma: Any, kinetic: Any, first: int, second: int) -> Any:
        form, inverse, sq = gamma**2 @ I, gamma**2 @ (1 / I), gamma**2
        F = kinetic - (I * Omega @ gamma) ** 2 / 2 + det * inverse * (alpha[0] * form - alpha[1])
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            pair = (I[j], I[k])
            F = F + alpha[2 + i] * (pair[first] * sq[j] + pair[second] * sq[k]) / sq[i]
        return F

    def square(Omega: Any) -> Any:
        return (I * Omega) @ (I * Omega) / 2

    assert abs(rate_along(problem, lambda W, g: integral(W, g, square(W), 1, 0))) < 1e-13
    # as printed, (𝓘Ω,Ω)
    assert abs(rate_along(problem, lambda W, g: integral(W, g, I * W @ W / 2, 1, 0))) > 1e-3
    if member >= 2:
        # as printed, I₂γ₂² + I₃γ₃²
        assert abs(rate_along(problem, lambda W, g: integral(W, g, square(W), 0, 1))) > 1e-3


def test_the_condition_of_the_duality_lemma_has_the_vector_product_inside(
    rng: np.random.Generator,
) -> None:
    """[γ×F_γ + 𝓘(V_γ×γ)]×γ = 0 for the Clebsch potential and its F; the printed 𝓘(V_γ)×γ leaves a
    remainder.
    """
    I, gamma = np.array([1.0, 1.7, 2.6]), np.array([0.48, 0.6, 0.64])
    V_slope, F_slope = 2 * I * gamma, -2 * np.prod(I) * gamma / I
    problem = VeselovaSO3(I, gamma, np.cross(gamma, rng.normal(size=3)), {"clebsch": 1})
    F = rate_along(
        problem,
        lambda W, g: (I * W) @ (I * W) / 2 - (I * W @ g) ** 2 / 2 - np.prod(I) * g**2 @ (1 / I),
    )
    assert abs(F) < 1e-13
    assert np.allclose(
        np.cross(np.cross(gamma, F_slope) + I * np.cross(V_slope, gamma), gamma), 0, atol=1e-14
    )
    sides = np.cross(gamma, F_slope) + np.cross(I * V_slope, gamma)
    assert np.max(np.abs(np.cross(sides, gamma))) > 0.1


def test_the_geodesic_integral_has_the_square_of_the_momentum(rng: np.random.Generator) -> None:
    """With dq/dτ for q̇ it is F_2, which is kept; the printed (𝓘Ω,Ω) for (𝓘Ω,𝓘Ω) is not."""
    I, gamma = np.array([1.0, 1.7, 2.6]), np.array([0.48, 0.6, 0.64])
    problem = VeselovaSO3(I, gamma, np.cross(gamma, rng.normal(size=3)))
    along = lambda W, g: (I * W @ g) ** 2  # noqa: E731
    assert abs(rate_along(problem, lambda W, g: ((I * W) @ (I * W) - along(W, g)) / 2)) < 1e-13
    assert abs(rate_along(problem, lambda W, g: (I * W @ W - along(W, g)) / 2)) > 1e-3


def test_the_energy_of_the_euler_poisson_equations_has_their_own_potential(
    rng: np.random.Generator,
) -> None:
    """f_1 = ½(𝒥Ω,Ω) + 𝒱; the printed V is the potential of the dual system."""
    I, gamma = np.array([1.0, 1.7, 2.6]), np.array([0.48, 0.6, 0.64])
    problem = EulerPoisson(1 / I, gamma, rng.normal(size=3), {"family": [0, 1, 0, 0, 0]})

    def energy(Omega: Any, gamma: Any, potential: Any) -> Any:
        return (Omega / I) @ Omega / 2 + potential(gamma)

    potential = lambda x: -np.prod(I) * x**2 @ (1 / I)  # noqa: E731
    assert abs(rate_along(problem, lambda W, g: energy(W, g, potential))) < 1e-13
    assert abs(rate_along(problem, lambda W, g: energy(W, g, lambda x: x**2 @ I))) > 1e-3


def test_omega_is_minus_epsilon_times_the_angular_velocity(rng: np.random.Generator) -> None:
    """γ̇ = γ×Ω is (Po), γ̇ = −ωγ, with ω_ij = −ε_ijk Ω_k, and then q∧q̇ is q̇×q; printed without
    the sign.
    """
    Omega, gamma = rng.normal(size=3), rng.normal(size=3)
    a, b, c = Omega
    printed = np.array([[0, c, -b], [-c, 0, a], [b, -a, 0]])
    corrected = -1 * printed
    assert np.allclose(-corrected @ gamma, np.cross(gamma, Omega))
    assert not np.allclose(-printed @ gamma, np.cross(gamma, Omega))
    q, q_dot = gamma, Omega
    x, y, z = np.cross(q_dot, q)
    assert np.allclose(
        np.outer(q, q_dot) - np.outer(q_dot, q), -np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])
    )


@pytest.mark.parametrize("n", range(2, 6))
def test_the_dirac_bracket_subtracts_its_second_term(n: int, rng: np.random.Generator) -> None:
    """With the printed plus sign φ₁ = (q,q) and φ₂ = (q,p) are no Casimir functions."""
    q, p = rng.normal(size=n), rng.normal(size=n)
    standard = np.block([[np.zeros((n, n)), np.eye(n)], [-np.eye(n), np.zeros((n, n))]])
    corrected = rank_one.dirac_tensor(q, p)
    printed = 2 * standard - corrected
    for gradient in (np.concatenate([2 * q, 0 * q]), np.concatenate([p, q])):
        assert np.allclose(corrected @ gradient, 0, atol=1e-13)
        assert np.linalg.norm(printed @ gradient) > 1.0


@pytest.mark.parametrize("n", range(2, 6))
def test_the_force_of_the_bracket_form_is_orthogonal_to_q(n: int, rng: np.random.Generator) -> None:
    """ṗ = {p,Ĥ}_* − π̂ as printed does not keep (q,p): its derivative is −(q,π̂) = −2h. Without
    that part it is (extended).
    """
    problem = random_problem(rng, n, 5.0)
    A, q = problem.A, problem.q
    p = integrals.momentum(A, q, problem.q_dot)
    q_dot, corrected = rank_one.bracket_field(A, q, p)
    printed = corrected - (q @ rank_one.nonholonomic_force(A, q, q_dot)) * q
    assert np.isclose(q_dot @ p + q @ corrected, 0, atol=1e-12 * problem.energy)
    assert np.isclose(q_dot @ p + q @ printed, -2 * problem.energy, rtol=1e-10)
    assert np.allclose(
        corrected, rank_one.extended_field(A, q, p)[1], rtol=1e-10, atol=1e-13 * np.max(np.abs(p))
    )


@pytest.mark.parametrize(("n", "r"), [(3, 2), (4, 2), (5, 3), (4, 4)])
def test_mom_has_no_third_term_for_the_momentum_that_is_defined(
    n: int, r: int, rng: np.random.Generator
) -> None:
    """P = ∂L/∂Ẋ by differences, as (dotX->P) defines it; pr_𝓓 𝓘ω = XPᵀ − PXᵀ. For r = 1 both forms
    agree.
    """
    inertia, X = body_inertia(random_inertia(rng, n, "matrix"), n), random_columns(rng, n, r)
    X_dot = tangent_part(X, rng.normal(size=(n, r)))

    def lagrangian(velocity: Any) -> float:
        omega = angular_velocity(X, velocity)
        return float(product(inertia.apply(omega), omega)) / 2

    units = np.eye(n * r).reshape(-1, n, r)
    P = np.reshape([(lagrangian(X_dot + e) - lagrangian(X_dot - e)) / 2 for e in units], (n, r))
    true = admissible_part(X, inertia.apply(angular_velocity(X, X_dot)))
    assert np.allclose(X.T @ P + P.T @ X, 0, atol=1e-12)
    assert np.allclose(momentum_map(X, P), true, atol=1e-12)
    printed = momentum_map(X, P) + X @ (X.T @ P - P.T @ X) @ X.T / 2
    assert not np.allclose(printed, true, atol=1e-3)
    of_normal_metric = P + X @ X.T @ P
    printed = angular_velocity(X, of_normal_metric)
    assert np.allclose(printed, true, atol=1e-12)


@pytest.mark.parametrize(("n", "r"), [(n, r) for n in range(2, 6) for r in range(1, n + 1)])
def test_the_symplectic_leaf_has_twice_the_dimension_of_the_stiefel_variety(
    n: int, r: int, rng: np.random.Generator
) -> None:
    """The coadjoint orbit of so(n) ⋉ (Rⁿ)^r through (Φ*, e_1 … e_r): δ𝓜 = [𝓜,ξ] + Σ e_k∧a_k, δe =
    −ξe. It is 2N.
    """
    X = random_columns(rng, n, r)
    momentum = momentum_map(X, tangent_part(X, rng.normal(size=(n, r))))
    turned = [
        np.concatenate([coefficients(momentum @ xi - xi @ momentum), (-xi @ X).ravel()])
        for xi in _basis(n)
    ]
    moved = [
        np.concatenate([coefficients(np.outer(e, a) - np.outer(a, e)), np.zeros(n * r)])
        for e in X.T
        for a in np.eye(n)
    ]
    rank = np.linalg.matrix_rank(np.array(turned + moved), tol=1e-9)
    assert rank == 2 * dimension(n, r)
    assert rank != r * n - r * (r + 1) // 2


def _basis(n: int) -> Any:
    return skew(np.eye(n * (n - 1) // 2), n)


def test_x4_and_the_hamiltonian_of_its_proof_lack_powers_of_the_multiplier(
    rng: np.random.Generator,
) -> None:
    """ṗ = −∇H* − 𝒩⁻¹(∇𝒩,Gp)p with H* = ½𝒩⁻²(Gp̃,p̃), on the rank-one flow of Theorem main in
    canonical coordinates.
    """
    # det A = 1: the units are those of the operator
    inertia: Any = body_inertia({"special": [1.0, 2.0, 1.0, 0.5]}, 4)
    chart, multiplier = Chart(inertia, random_columns(rng, 4, 1)), ChaplyginMultiplier(inertia, 1)
    N, z = chart.N, rng.normal(size=6) * np.array([0.3] * 3 + [1.0] * 3)
    u, p = z[:N], z[N:]
    rate = multiplier.value(chart.point(u)[0])

    def gradient(power: int) -> Any:
        """∇_q of 𝒩^power·H(q,p̃) at fixed p̃ = 𝒩p."""
        return slopes(
            lambda y: multiplier.value(chart.point(y)[0]) ** power * chart.hamiltonian(y, rate * p),
            u,
        )

    u_dot, p_dot = np.split(chart.field(z), [N])
    growth = slopes(lambda y: np.log(multiplier.value(chart.point(y)[0])), u) @ u_dot
    assert np.allclose(p_dot, -gradient(-2) - growth * p, atol=1e-7)
    assert not np.allclose(p_dot, -gradient(-2) - rate * growth * p, atol=1e-3)
    assert not np.allclose(p_dot, -gradient(2) - growth * p, atol=1e-3)


@pytest.mark.parametrize(("n", "rank"), [(3, 2), (4, 2), (5, 3), (6, 2)])
def test_there_are_more_g_invariant_functions_than_independent_ones_in_the_algebra(
    n: int, rank: int, rng: np.random.Generator
) -> None:
    """T*Q = G ×_H 𝔡, so its G-invariant functions are the H-invariant ones on 𝔡; 𝒜 holds those that
    come from 𝔤.
    """
    system = random_lr(rng, n, rank)
    group, distribution = system.distribution.group, system.distribution
    w, h = distribution.space[: distribution.rank], distribution.space[distribution.rank :]
    xi = rng.normal(size=len(w)) @ w
    orbit = np.linalg.matrix_rank(group.bracket(h, np.broadcast_to(xi, h.shape))) if len(h) else 0
    in_algebra = ChaplyginReduction(system).independent_invariants
    powers = [np.linalg.matrix_power(group.element(xi), 2 * k - 1) for k in range(1, n // 2 + 1)]
    slopes = [group.coordinates(power / np.linalg.norm(power)) @ w.T for power in powers]
    assert np.linalg.matrix_rank(np.array(slopes), tol=1e-7) == in_algebra
    assert len(w) - orbit > in_algebra
    symmetric = ChaplyginReduction(random_lr(rng, n, 1))  # for the sphere both numbers are one
    assert symmetric.independent_invariants == 1


@pytest.mark.parametrize(("n", "rank"), [(4, 2), (5, 3)])
def test_the_index_ranges_of_im3_belong_to_the_other_letters(
    n: int, rank: int, rng: np.random.Generator
) -> None:
    """⟨e_i∧e_p, 𝓘(e_j∧e_q)⟩ over p ≤ r and all i, as printed, has the row e_p∧e_p = 0: the
    determinant vanishes.
    """
    system = random_lr(rng, n, rank)
    group, frame = system.distribution.group, system.g

    def determinant(pairs: list[tuple[int, int]]) -> float:
        rows = [np.outer(frame[i], frame[p]) - np.outer(frame[p], frame[i]) for i, p in pairs]
        return float(
            measure.restricted_determinant(system.inertia, group.coordinates(np.array(rows)))
        )

    true = (
        float(measure.momentum_density(system.inertia, system.distribution.in_body(frame)[0])) ** 2
    )
    assert np.isclose(determinant([(i, p) for i in range(rank) for p in range(i + 1, n)]), true)
    assert abs(determinant([(i, p) for p in range(rank) for i in range(n)])) < 1e-12 * true
    assert not np.isclose(
        determinant([(i, p) for p in range(rank) for i in range(p)]), true, rtol=1e-3
    )


@pytest.mark.parametrize(("n", "rank"), [(4, 1), (5, 2), (5, 3)])
def test_the_expansion_in_the_proof_of_im_a_runs_over_j(
    n: int, rank: int, rng: np.random.Generator
) -> None:
    A, g = np.exp(rng.normal(size=n)), np.linalg.qr(rng.normal(size=(n, n)))[0]
    rest = g[rank:].T
    true = np.linalg.det(rest.T @ (rest / A[:, None]))
    squares = measure.plucker_coordinates(rest) ** 2
    J = list(combinations(range(n), n - rank))
    # complementary, as at the end of the proof
    I = [[i for i in range(n) if i not in indices] for indices in J]
    assert np.isclose(sum(x / np.prod(A[list(j)]) for x, j in zip(squares, J, strict=True)), true)
    assert not np.isclose(
        sum(x / np.prod(A[i]) for x, i in zip(squares, I, strict=True)), true, rtol=1e-3
    )


def test_the_angular_velocity_in_three_dimensions_has_the_other_sign(
    rng: np.random.Generator,
) -> None:
    """(nh3.46) for n = 3, r = 1 is 𝓘Ω̇ = 𝓘Ω×Ω + λγ, γ̇ = γ×Ω for ω_ij = −ε_ijkΩ_k; with +ε both
    signs of Ω are turned.
    """
    A = np.exp(rng.normal(size=3))
    draw = random_lr(rng, 3, 1)
    group = draw.distribution.group
    system = LRSystem(3, 1, {"special": A}, draw.g, group.element(draw.omega))
    flow = system.flow("multipliers")
    rate = flow.field(flow.initial, flow.parameters, FLOATS) / flow.time_unit
    gamma, gamma_dot = system.g[0], rate[3:].reshape(3, 3)[0]

    def vector(coordinates: Any) -> Any:
        X = group.element(coordinates)
        return np.array([X[1, 2], X[2, 0], X[0, 1]])  # X_ij = ε_ijk x_k

    def mismatch(sign: int) -> float:
        Omega, Omega_dot = sign * vector(system.omega), sign * vector(rate[:3]) / flow.time_unit
        force = Omega_dot / A - np.cross(Omega / A, Omega)  # 𝓘 = A⁻¹
        first = np.linalg.norm(force - (force @ gamma) * gamma) / np.linalg.norm(
            np.cross(Omega / A, Omega)
        )
        return float(max(first, np.linalg.norm(gamma_dot - np.cross(gamma, Omega))))

    assert mismatch(-1) < 1e-12
    assert mismatch(1) > 1e-3
