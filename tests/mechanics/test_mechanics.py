"""The physics against the formulas of the paper, term by term, on random states."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from draws import random_problem
from paper.separation import from_spheroconic, neumann_polynomial
from veselova import Veselova
from veselova.mechanics.geometry import integrals_of_motion as integrals
from veselova.mechanics.geometry.integrals_of_motion import to_spheroconic

DIMENSIONS = range(2, 9)


def inertia(A: Any, omega: Any) -> Any:
    """𝓘ω for the special inertia (4.5): (A_iA_j/det A) ω_ij."""
    return np.outer(A, A) * omega / np.prod(A)


def wedge(x: Any, y: Any) -> Any:
    return np.outer(x, y) - np.outer(y, x)


def product(X: Any, Y: Any) -> float:
    return float(-0.5 * np.trace(X @ Y))


@pytest.mark.parametrize("n", DIMENSIONS)
def test_energy_is_the_kinetic_energy_of_the_body(n: int, rng: np.random.Generator) -> None:
    problem = random_problem(rng, n)
    omega = wedge(problem.q, problem.q_dot)
    assert np.isclose(problem.energy, 0.5 * product(inertia(problem.A, omega), omega), rtol=1e-12)


@pytest.mark.parametrize("n", DIMENSIONS)
def test_momentum_derives_from_the_reduced_lagrangian(n: int, rng: np.random.Generator) -> None:
    problem = random_problem(rng, n, 5.0)
    p = integrals.momentum(problem.A, problem.q, problem.q_dot)
    step = 1e-6

    def slope(i: int) -> float:
        e = step * np.eye(n)[i]
        upper = integrals.energy(problem.A, problem.q, problem.q_dot + e)
        return float(upper - integrals.energy(problem.A, problem.q, problem.q_dot - e)) / (2 * step)

    assert np.allclose(p, [slope(i) for i in range(n)], rtol=1e-6, atol=1e-8 * np.max(np.abs(p)))
    assert abs(p @ problem.q) < 1e-14 * np.max(np.abs(p))


@pytest.mark.parametrize("n", DIMENSIONS)
def test_linear_integrals_are_the_components_of_the_momentum(
    n: int, rng: np.random.Generator
) -> None:
    problem = random_problem(rng, n)
    A, E = problem.A, problem.frame
    p = integrals.momentum(A, problem.q, problem.q_dot)
    omega = wedge(problem.q, problem.q_dot)
    expected = [product(inertia(A, omega), wedge(E[:, 0], E[:, k])) for k in range(1, n)]
    assert np.allclose(
        integrals.linear_integrals(p, E), expected, rtol=1e-11, atol=1e-12 * np.max(np.abs(p))
    )


@pytest.mark.parametrize("n", DIMENSIONS)
def test_the_field_satisfies_the_euler_poincare_equations_up_to_a_constraint_force(
    n: int, rng: np.random.Generator
) -> None:
    """𝓘ω̇ + [ω, 𝓘ω] is a combination of e_p∧e_q, p,q ≥ 2 (nh3.46): its components along e_1∧e_k
    vanish.
    """
    problem = random_problem(rng, n, 5.0)
    flow, step = problem.flow(), 1e-5

    def omega_at(offset: float) -> Any:
        state = flow.initial + offset * flow.vector_field(0.0, flow.initial)
        middle = flow.initial + offset / 2 * flow.vector_field(0.0, flow.initial)
        state = flow.initial + offset * flow.vector_field(0.0, middle)
        series = flow.unpack(state[None, :])
        frame, q_dot = series["frame"], series["q_dot"]
        return wedge(frame[0, :, 0], q_dot[0])

    rate = (omega_at(step) - omega_at(-step)) / (2 * step) / flow.time_unit
    omega = wedge(problem.q, problem.q_dot)
    force = (
        inertia(problem.A, rate)
        + omega @ inertia(problem.A, omega)
        - inertia(problem.A, omega) @ omega
    )
    E, size = problem.frame, float(np.max(np.abs(inertia(problem.A, rate)))) + 1.0
    assert all(abs(product(force, wedge(E[:, 0], E[:, k]))) < 1e-8 * size for k in range(1, n))


@pytest.mark.parametrize("n", DIMENSIONS)
def test_the_field_is_the_extended_system_of_the_paper(n: int, rng: np.random.Generator) -> None:
    problem = random_problem(rng, n, 5.0)
    A, flow = problem.A, problem.flow()
    det, q, p = np.prod(A), problem.q, integrals.momentum(problem.A, problem.q, problem.q_dot)
    q_dot = det / (q @ (A * q)) * (p / A - (p @ (q / A)) / (q @ q) * q)
    p_dot = (
        -det
        * ((p @ (p / A)) * (q @ q) - (p @ q) * (q @ (p / A)))
        / ((q @ (A * q)) * (q @ q) ** 2)
        * q
    )
    derivative = flow.vector_field(0.0, flow.initial) / flow.time_unit
    E_dot = derivative[n:-1].reshape(n, n)
    assert np.allclose(q_dot, problem.q_dot, rtol=1e-11, atol=1e-13)
    assert np.allclose(E_dot, -wedge(q, q_dot) @ problem.frame, rtol=1e-11, atol=1e-12)
    assert np.allclose(
        derivative[:n] * p[0] / flow.initial[0],
        p_dot,
        rtol=1e-10,
        atol=1e-12 * np.max(np.abs(p_dot)),
    )
    rate = np.sqrt(2 * problem.energy * det / (q @ (A * q)))
    assert np.isclose(derivative[-1] * np.sqrt(A[0] / flow.parameters[0]), rate, rtol=1e-12)
    assert np.isclose(integrals.time_rate(A, q, problem.q_dot), rate, rtol=1e-12)


@pytest.mark.parametrize("n", DIMENSIONS)
def test_projection_keeps_points_of_the_manifold_and_mends_points_beside_it(
    n: int, rng: np.random.Generator
) -> None:
    flow = random_problem(rng, n).flow()
    assert np.allclose(
        flow.project(flow.initial), flow.initial, atol=1e-13 * np.max(np.abs(flow.initial))
    )
    state = flow.project(flow.initial + 1e-8 * rng.normal(size=flow.initial.size))
    E, p = state[n:-1].reshape(n, n), state[:n]
    assert np.max(np.abs(E.T @ E - np.eye(n))) < 1e-14
    assert abs(p @ E[:, 0]) < 1e-14 * np.max(np.abs(p))
    A, twice_energy = flow.parameters[:n], flow.parameters[-1]
    assert np.isclose(p @ (p / A) / (E[:, 0] @ (A * E[:, 0])), twice_energy, rtol=1e-14)


@pytest.mark.parametrize("n", DIMENSIONS)
def test_constants_of_motion_are_zeros_of_the_division_free_polynomial(
    n: int, rng: np.random.Generator
) -> None:
    problem = random_problem(rng, n)
    inverse, q_squared, wedge_squared = polynomial_data(problem)
    scale = max(inverse)
    for c in [0.0, *problem.constants.tolist()]:
        value, slope = neumann_polynomial(c, inverse, q_squared, wedge_squared)
        assert abs(value) <= 1e-12 * scale * abs(slope) + 1e-13 * scale ** (n - 1)


@pytest.mark.parametrize("n", DIMENSIONS)
def test_the_division_free_polynomial_is_the_sum_that_defines_it(
    n: int, rng: np.random.Generator
) -> None:
    inverse, q_squared, wedge_squared = polynomial_data(random_problem(rng, n, 5.0))
    x, step = 0.37, 1e-6

    def defined(x: float) -> float:
        pairs = [(i, j) for j in range(n) for i in range(j)]
        value = sum(
            wedge_squared[i][j] * np.prod([x - y for k, y in enumerate(inverse) if k not in (i, j)])
            for i, j in pairs
        )
        return float(
            value
            + sum(
                q_squared[i] * np.prod([x - y for k, y in enumerate(inverse) if k != i])
                for i in range(n)
            )
        )

    value, slope = neumann_polynomial(x, inverse, q_squared, wedge_squared)
    assert np.isclose(value, defined(x), rtol=1e-12, atol=1e-14)
    assert np.isclose(
        slope, (defined(x + step) - defined(x - step)) / (2 * step), rtol=1e-6, atol=1e-8
    )
    exact = neumann_polynomial(
        Fraction(x), *([Fraction(y) for y in ys] for ys in (inverse, q_squared)), wedge_squared
    )
    assert np.isclose(float(exact[0]), value, rtol=1e-12, atol=1e-14)


def polynomial_data(problem: Veselova) -> tuple[list[float], list[float], list[list[float]]]:
    """I_i, q_i² and P_ij² of a problem, P = q∧q'."""
    v = integrals.neumann_velocity(problem.A, problem.q, problem.q_dot)
    return (1 / problem.A).tolist(), (problem.q**2).tolist(), (wedge(problem.q, v) ** 2).tolist()


@pytest.mark.parametrize("n", DIMENSIONS)
def test_neumann_integrals_sum_to_one_and_to_the_residues_of_the_polynomial(
    n: int, rng: np.random.Generator
) -> None:
    problem = random_problem(rng, n, 5.0)
    velocity = integrals.neumann_velocity(problem.A, problem.q, problem.q_dot)
    F = integrals.uhlenbeck_integrals(problem.A, problem.q, velocity)
    assert np.isclose(F.sum(), 1.0, atol=1e-12)
    inverse, roots = 1 / problem.A, np.concatenate([[0.0], problem.constants])
    for i in range(n):
        residue = np.prod(inverse[i] - roots) / np.prod(
            [inverse[i] - x for k, x in enumerate(inverse) if k != i]
        )
        assert np.isclose(F[i], residue, rtol=1e-8, atol=1e-10)


@pytest.mark.parametrize("n", DIMENSIONS)
def test_spheroconic_coordinates_interlace_and_invert(n: int, rng: np.random.Generator) -> None:
    problem = random_problem(rng, n)
    coordinates, ordered = to_spheroconic(problem.A, problem.q), np.sort(1 / problem.A)
    assert np.all(ordered[:-1] <= coordinates)
    assert np.all(coordinates <= ordered[1:])
    again = from_spheroconic(problem.A, coordinates, problem.q)
    assert np.allclose(again, problem.q, atol=1e-9)
    assert np.isclose(
        np.sum(problem.A * problem.q**2), np.prod(coordinates) * np.prod(problem.A), rtol=1e-11
    )


@pytest.mark.parametrize("n", DIMENSIONS)
def test_the_natural_frame_is_the_one_of_the_formula(n: int, rng: np.random.Generator) -> None:
    problem = random_problem(rng, n, 10.0, framed=False)
    A, q = problem.A, problem.q
    v = integrals.neumann_velocity(A, q, problem.q_dot)
    E = problem.frame
    assert np.max(np.abs(E.T @ E - np.eye(n))) < 1e-14
    assert np.isclose(np.linalg.det(E), 1.0)
    for column, c in zip(range(1, n), [*problem.constants, 0.0], strict=True):
        d = 1 / A - c
        S = -np.sum(q * v / d) / np.sum(q * q / d)
        normal = (v + S * q) / d
        normal /= np.linalg.norm(normal)
        assert min(np.max(np.abs(E[:, column] + s * normal)) for s in (-1, 1)) < 1e-9
    gamma = A * (v - (A * q) @ v / (q @ (A * q)) * q)
    assert np.allclose(
        E[:, -1] * (1 if n > 2 else np.sign(E[:, -1] @ gamma)),
        gamma / np.linalg.norm(gamma),
        atol=1e-12,
    )


@pytest.mark.parametrize("n", DIMENSIONS)
def test_the_momentum_points_along_gamma(n: int, rng: np.random.Generator) -> None:
    problem = random_problem(rng, n, framed=False)
    p = integrals.momentum(problem.A, problem.q, problem.q_dot)
    assert np.isclose(abs(p @ problem.frame[:, -1]), np.linalg.norm(p), rtol=1e-12)
