"""Geodesics on ellipsoids: closed form, two integrations and binary128; Chasles' and Moser's
theorems.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from conftest import slow
from paper.confocal_quadrics import contacts, lax_matrix, lax_partner
from veselova import EllipsoidGeodesic, NeumannSystem, Veselova, solve
from veselova.mechanics.geometry.integrals_of_motion import time_rate
from veselova.mechanics.systems.ellipsoid import normal_velocity

Generator = np.random.Generator

#: Semiaxes squared, a point and a direction, to be normalised.
SPECIAL: dict[str, tuple[Any, Any, Any]] = {
    "near-sphere": ([1.0001, 1, 0.9999], [1, 1, 0.3], [1, -1, 2]),
    "sphere": ([2, 2, 2], [1, 1, 0.3], [1, -1, 2]),
    "spheroid": ([1, 1, 0.5], [1, 1, 0.3], [1, -1, 2]),
    "plane-section": ([3, 2, 1], [1, 1, 0], [1, -1, 0]),
    "strongly-triaxial": ([100, 1, 0.01], [3, 0.5, 0.05], [1, -1, 0.1]),
    "through-umbilic": ([3, 2, 1], [np.sqrt(1.5), 0, np.sqrt(0.5)], [0.3, 1, 0.1]),
    "along-umbilics": ([3, 2, 1], [np.sqrt(1.5), 0, np.sqrt(0.5)], [0, 1, 0]),
    "near-umbilic": ([3, 2, 1], [np.sqrt(1.5) + 1e-9, 0, np.sqrt(0.5)], [0.3, 1, 0.1]),
    "ellipse": ([3, 1], [1, 1], [1, 0]),
    "four": ([4, 3, 3, 1], [1, 0.3, 0.2, -1], [0.2, 1, -0.5, 0.3]),
}


def drawn(rng: Generator, n: int, ratio: float = 4.0) -> EllipsoidGeodesic:
    A = np.exp(rng.uniform(0, np.log(ratio), n))
    return EllipsoidGeodesic(A, rng.normal(size=n), rng.normal(size=n), normalize=True)


def true_error(problem: EllipsoidGeodesic, arcs: Any, **options: Any) -> tuple[Any, Any]:
    found, other = solve(problem, arcs, **options), solve(problem, arcs, "numeric", "taylor")
    off = np.maximum(np.abs(found.X - other.X), np.abs(found.X_dot - other.X_dot))
    return np.max(off, axis=1), found.error + other.error


@pytest.mark.parametrize("n", [2, 3, 5])
@pytest.mark.parametrize("method", ["theta", "angles"])
def test_theta_functions_follow_geodesics_to_twelve_digits(
    n: int, method: str, rng: Generator
) -> None:
    arcs = np.array([-20.0, -3.0, 0.0, 0.1, 7.0, 20.0])
    for _ in range(2):
        error, reported = true_error(drawn(rng, n), arcs, method=method)
        assert np.max(error) <= 1e-12
        assert np.all(error <= 2 * reported)


@pytest.mark.parametrize("n", [2, 3, *map(slow, range(4, 7))])
@pytest.mark.parametrize("method", ["dop853", "taylor"])
def test_the_integration_agrees_with_the_closed_form(method: str, n: int, rng: Generator) -> None:
    problem, arcs = drawn(rng, n), np.array([-4.0, 2.0, 15.0])
    closed = solve(problem, arcs)
    found = solve(problem, arcs, "numeric", method)
    assert np.all(np.abs(found.frame - closed.frame) <= (found.error + closed.error)[:, None, None])
    assert np.all(np.abs(found.X - closed.X) <= (found.error + closed.error)[:, None])
    assert np.allclose(found.tau1, closed.tau1, atol=1e-10)


@pytest.mark.parametrize("n", [2, 4])
def test_integrals_are_conserved(n: int, rng: Generator) -> None:
    arcs = np.linspace(0, 100, 21)
    assert max(solve(drawn(rng, n), arcs, "numeric").drift.values()) <= 1e-11
    assert max(solve(drawn(rng, n), arcs).drift.values()) <= 1e-13


def test_the_normal_is_neumanns_point_and_the_veselova_body(rng: Generator) -> None:
    """Theorem Kno, both ways: in τ₁ the normal solves Neumann's system with F_0 = 0, and moves like
    a Veselova body.
    """
    problem = drawn(rng, 4)
    found = solve(problem, [0.5, 3.0])
    velocity = normal_velocity(problem.A, problem.frame[:, 0], problem.X_dot)
    q_prime = velocity / time_rate(problem.A, problem.frame[:, 0], velocity)
    neumann = solve(NeumannSystem(problem.A, problem.frame[:, 0], q_prime), found.tau1)
    assert np.allclose(neumann.q, found.frame[:, :, 0], atol=1e-13)
    assert np.allclose(neumann.integrals["F0"], 0, atol=1e-13)
    body = Veselova(problem.A, problem.frame[:, 0], velocity, problem.frame)
    times = solve(body, np.linspace(0, 20, 2001))
    at = np.array([np.interp(x, times.tau1, times.times) for x in found.tau1])
    # what linear interpolation of t(τ₁) leaves
    assert np.allclose(solve(body, at).q, found.frame[:, :, 0], atol=1e-4)


def test_the_rate_of_neumann_time_is_knoerrers(rng: Generator) -> None:
    """(knorrer), corrected: dτ₁/ds = √((V,A⁻¹V)/(X,A⁻²X)) against a difference
    quotient of τ₁(s).
    """
    problem, step = drawn(rng, 3), 1e-4
    found = solve(problem, [2 - step, 2.0, 2 + step])
    X, V = found.X[1], found.X_dot[1]
    rate = np.sqrt((V @ (V / problem.A)) / np.sum((X / problem.A) ** 2))
    assert np.isclose((found.tau1[2] - found.tau1[0]) / (2 * step), rate, rtol=1e-7)


def test_moser_pair_is_isospectral_and_moves_the_line(rng: Generator) -> None:
    problem, step = drawn(rng, 5), 1e-4
    A, found = problem.A, solve(problem, [1 - step, 1.0, 1 + step])
    before, middle, after = lax_matrix(A, found.X, found.X_dot)
    nu = np.sum((found.X[1] / A) ** 2)
    B = lax_partner(A, found.X[1], found.X_dot[1])
    assert np.allclose((after - before) / (2 * step), (middle @ B - B @ middle) / nu, atol=1e-6)
    far = solve(problem, [0.0, 50.0])
    eigenvalues = np.linalg.eigvalsh(lax_matrix(A, far.X, far.X_dot))
    assert np.allclose(eigenvalues[0], eigenvalues[1], atol=1e-12)
    assert np.sum(np.abs(eigenvalues[0]) < 1e-13) == 2
    shifted = lax_matrix(A, found.X + 3 * found.X_dot, found.X_dot)
    assert np.allclose(shifted, lax_matrix(A, found.X, found.X_dot), atol=1e-13)


def test_tangents_touch_fixed_confocal_quadrics_at_the_frames_normals(rng: Generator) -> None:
    """Chasles: Σ x_i²/(A_i−α) = 1 at the contact, with the tangent in its plane; normals are the
    frame's n_k.
    """
    problem = drawn(rng, 5)
    found = solve(problem, [-3.0, 0.0, 7.0])
    touched = contacts(problem.A, found.X, found.X_dot)
    assert np.allclose(touched.quadrics, problem.quadrics, rtol=1e-12)
    distances = problem.A - touched.quadrics[..., None]
    assert np.allclose(np.sum(touched.points**2 / distances, axis=-1), 1, atol=1e-9)
    along = touched.points - found.X[:, None, :]
    heights = np.sum(along * found.X_dot[:, None, :], axis=-1)
    assert np.allclose(along, heights[..., None] * found.X_dot[:, None, :], atol=1e-9)
    frame = np.swapaxes(found.frame[:, :, 1:-1], 1, 2)
    assert np.allclose(np.abs(np.sum(touched.normals * frame, axis=-1)), 1, atol=1e-12)
