"""The misprints of the paper that docs/errata.md lists: the printed formula fails on random data, the corrected one holds."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
import pytest

from draws import random_problem
from lr_draws import random_lr
from veselova import EllipsoidGeodesic, LRSystem, solve
from veselova.analytic.solution import Solution
from veselova.mechanics import integrals, measure
from veselova.mechanics.flow import FLOATS
from veselova.mechanics.moser import lax_matrix, lax_partner
from veselova.mechanics.reduction import ChaplyginReduction
from veselova.mechanics.spheroconic import to_spheroconic


@pytest.mark.parametrize("N", range(2, 7))
def test_the_jacobi_identities_hold_with_the_factors_turned_round(N: int, rng: np.random.Generator) -> None:
    rho = rng.normal(size=N)

    def total(m: int, sign: int) -> float:
        return float(sum(rho[s] ** m / np.prod([sign * (rho[s] - rho[k]) for k in range(N) if k != s]) for s in range(N)))

    assert all(abs(total(m, 1)) < 1e-8 for m in range(N - 1))
    assert np.isclose(total(N - 1, 1), 1.0)
    assert np.isclose(total(N - 1, -1), (-1) ** (N - 1))  # as printed, with ρ_l − ρ_s


@pytest.mark.parametrize("n", range(2, 7))
def test_the_lagrangian_in_spheroconic_coordinates_has_a_minus_sign(n: int, rng: np.random.Generator) -> None:
    problem = random_problem(rng, n, 5.0)
    A, q, inverse = problem.A, problem.q, 1 / problem.A
    velocity = integrals.neumann_velocity(A, q, problem.q_dot)  # any tangent vector will do for dq/dτ
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
    true = ((A * velocity) @ velocity * ((A * q) @ q) - ((A * q) @ velocity) ** 2) / (2 * (q @ (A * q)))
    assert np.isclose(-printed, true, rtol=1e-5)


def test_in_three_dimensions_the_factor_gamma_is_missing_after_4_2a(rng: np.random.Generator) -> None:
    inertia, omega, gamma = np.diag([1.0, 2.0, 3.5]), rng.normal(size=3), rng.normal(size=3)
    gamma /= np.linalg.norm(gamma)
    m = inertia @ omega - (inertia @ omega @ gamma) * gamma + (omega @ gamma) * gamma
    inverse_gamma = np.linalg.solve(inertia, gamma)
    coefficient = (m @ inverse_gamma - m @ gamma) / (gamma @ inverse_gamma)
    assert np.allclose(m - coefficient * gamma, inertia @ omega)
    assert not np.allclose(m - coefficient, inertia @ omega)


@pytest.mark.parametrize("n", [3, 4, 5])
def test_wurzel_takes_the_derivative_of_small_psi(n: int, rng: np.random.Generator) -> None:
    """(q', n_k)² = |U(c_k)/ψ'(c_k)| with ψ(r) = Π(r − c_k); the printed derivative of Ψ(r) = Π(r − I_i) gives another length."""
    solution = Solution(random_problem(rng, n, 5.0))
    at = solution.attitude(rng.uniform(0, 1, (1, n - 1)), "angles")
    constants = np.array([float(c) for c in solution.spectrum.constants])
    inverse = np.array([float(x) for x in solution.spectrum.inverse])
    components = (at.q_prime[0] @ at.normals[0])[: n - 2]
    for k, component in enumerate(components, start=1):
        U = np.prod(constants[k] - at.spheroconic[0])
        small = np.prod([constants[k] - c for j, c in enumerate(constants) if j != k])
        large = sum(np.prod([constants[k] - x for j, x in enumerate(inverse) if j != i]) for i in range(n))
        assert np.isclose(component**2, abs(U / small), rtol=1e-8, atol=1e-14)
        assert not np.isclose(component**2, abs(U / large), rtol=1e-3)


@pytest.mark.parametrize("n", [3, 5])
def test_4_15_needs_its_second_weight_and_its_brackets(n: int, rng: np.random.Generator) -> None:
    """Ξ = (Aq,q̇)𝓘ω·q − (Aq,q)𝓘ω·q̇ = −2h Aq up to a multiple of q, with 2h = [(Aq,q)(Aq̇,q̇) − (Aq,q̇)²]/det A."""
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
    problem = EllipsoidGeodesic(rng.uniform(1, 3, 4), rng.normal(size=4), rng.normal(size=4), normalize=True)
    return problem.A, solve(problem, [1 - step, 1.0, 1 + step], "numeric", "taylor")


def test_knoerrers_time_change_is_printed_upside_down(rng: np.random.Generator) -> None:
    """The normal obeys q'' = −A⁻¹q + λq in τ₁ only with dτ₁/ds = √((V,A⁻¹V)/(X,A⁻²X)): its speed gives F_0 = 0."""
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


@pytest.mark.parametrize(("n", "rank"), [(3, 2), (4, 2), (5, 3), (6, 2)])
def test_there_are_more_g_invariant_functions_than_independent_ones_in_the_algebra(
    n: int, rank: int, rng: np.random.Generator
) -> None:
    """T*Q = G ×_H 𝔡, so its G-invariant functions are the H-invariant ones on 𝔡; 𝒜 holds those that come from 𝔤."""
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
def test_the_index_ranges_of_im3_belong_to_the_other_letters(n: int, rank: int, rng: np.random.Generator) -> None:
    """⟨e_i∧e_p, 𝓘(e_j∧e_q)⟩ over p ≤ r and all i, as printed, has the row e_p∧e_p = 0: the determinant vanishes."""
    system = random_lr(rng, n, rank)
    group, frame = system.distribution.group, system.g

    def determinant(pairs: list[tuple[int, int]]) -> float:
        rows = [np.outer(frame[i], frame[p]) - np.outer(frame[p], frame[i]) for i, p in pairs]
        return float(measure.restricted_determinant(system.inertia, group.coordinates(np.array(rows))))

    true = float(measure.momentum_density(system.inertia, system.distribution.seen(frame)[0])) ** 2
    assert np.isclose(determinant([(i, p) for i in range(rank) for p in range(i + 1, n)]), true)
    assert abs(determinant([(i, p) for p in range(rank) for i in range(n)])) < 1e-12 * true
    assert not np.isclose(determinant([(i, p) for p in range(rank) for i in range(p)]), true, rtol=1e-3)


@pytest.mark.parametrize(("n", "rank"), [(4, 1), (5, 2), (5, 3)])
def test_the_expansion_in_the_proof_of_im_a_runs_over_j(n: int, rank: int, rng: np.random.Generator) -> None:
    A, g = np.exp(rng.normal(size=n)), np.linalg.qr(rng.normal(size=(n, n)))[0]
    rest = g[rank:].T
    true = np.linalg.det(rest.T @ (rest / A[:, None]))
    squares = measure.plucker_coordinates(rest) ** 2
    J = list(combinations(range(n), n - rank))
    I = [[i for i in range(n) if i not in indices] for indices in J]  # complementary, as at the end of the proof
    assert np.isclose(sum(x / np.prod(A[list(j)]) for x, j in zip(squares, J, strict=True)), true)
    assert not np.isclose(sum(x / np.prod(A[i]) for x, i in zip(squares, I, strict=True)), true, rtol=1e-3)


def test_the_angular_velocity_in_three_dimensions_has_the_other_sign(rng: np.random.Generator) -> None:
    """(nh3.46) for n = 3, r = 1 is 𝓘Ω̇ = 𝓘Ω×Ω + λγ, γ̇ = γ×Ω for ω_ij = −ε_ijkΩ_k; with +ε both signs of Ω are turned."""
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
        first = np.linalg.norm(force - (force @ gamma) * gamma) / np.linalg.norm(np.cross(Omega / A, Omega))
        return float(max(first, np.linalg.norm(gamma_dot - np.cross(gamma, Omega))))

    assert mismatch(-1) < 1e-12
    assert mismatch(1) > 1e-3
