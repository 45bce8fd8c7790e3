"""The closed frame on the torus, and the two clocks."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from draws import random_problem
from generic_torus import FourierClock, GenericTorus
from problems import near_separatrix, tagged

DIMENSIONS = (2, 3, 5, 8)


@pytest.mark.parametrize("n", DIMENSIONS)
def test_the_closed_frame_is_orthonormal_everywhere_on_the_torus(
    n: int, rng: np.random.Generator
) -> None:
    solution = GenericTorus(random_problem(rng, n))
    at = solution.attitude(rng.uniform(-2, 2, (100, n - 1)))
    frame = np.concatenate([at.q[:, :, None], at.normals], axis=2)
    assert np.max(np.abs(np.swapaxes(frame, 1, 2) @ frame - np.eye(n))) < 1e-13


@pytest.mark.parametrize("n", DIMENSIONS)
def test_the_normals_are_eigenvectors_of_mosers_matrix(n: int, rng: np.random.Generator) -> None:
    solution = GenericTorus(random_problem(rng, n, 10.0))
    at = solution.attitude(rng.uniform(0, 1, (10, n - 1)))
    inverse = np.array([float(x) for x in solution.spectrum.inverse])
    constants = [
        float(c) for c in [*solution.spectrum.constants[1:], solution.spectrum.constants[0]]
    ]
    for q, v, normals in zip(at.q, at.q_prime, at.normals, strict=True):
        projector = np.eye(n) - np.outer(q, q)
        matrix = projector @ (np.diag(inverse) - np.outer(v, v)) @ projector
        assert np.allclose(matrix @ normals, normals * constants, atol=1e-12 * inverse[-1])
        assert abs(q @ v) < 1e-13 * np.linalg.norm(v)


@pytest.mark.parametrize("n", DIMENSIONS)
def test_the_frame_turns_with_the_body_along_the_flow(n: int, rng: np.random.Generator) -> None:
    """dE/dτ₁ = −(q∧q')E for the natural frame, by a difference along z⁰ + fτ₁."""
    solution = GenericTorus(random_problem(rng, n, 5.0))
    step, f = 1e-5, solution.in_tau1.rates
    z = rng.uniform(0, 1, (5, n - 1))

    def frames(z: Any) -> Any:
        at = solution.attitude(z)
        return np.concatenate([at.q[:, :, None], at.normals], axis=2)

    rate = (frames(z + step * f) - frames(z - step * f)) / (2 * step)
    at = solution.attitude(z)
    omega = at.q[:, :, None] * at.q_prime[:, None, :]
    omega = omega - np.swapaxes(omega, 1, 2)
    assert np.max(np.abs(rate + omega @ frames(z))) < 1e-7 * np.max(np.abs(omega))


@pytest.mark.parametrize("n", range(2, 6))
def test_both_clocks_tell_the_same_time(n: int, rng: np.random.Generator) -> None:
    for _ in range(3):
        problem = random_problem(rng, n)
        solution, fourier = GenericTorus(problem), FourierClock(problem)
        times = np.sort(rng.uniform(-80, 80, 30))
        panels = solution.panels(times)
        (tau_fourier, z_fourier), (tau_panels, z_panels) = fourier.tau1(times), panels.tau1(times)
        scale = np.max(np.abs(tau_panels))
        assert np.allclose(tau_fourier, tau_panels, atol=4e-14 * scale)
        assert np.allclose(np.mod(z_fourier - z_panels + 1, 2), 1, atol=1e-12)
        sums = fourier.sums(solution.in_tau1.phases(tau_fourier))[0]
        passed = fourier.mean * tau_fourier + sums, panels.panels.at(tau_panels)
        assert np.allclose(passed, times, atol=1e-13 * scale)


@pytest.mark.parametrize("n", [2, 3, 4])
def test_the_fourier_series_is_the_rate_of_the_clock(n: int, rng: np.random.Generator) -> None:
    """Σ F_m e^{2πi m·z} against dt/dτ₁ = √((q,Aq)/2h det A) at random points: every determinant at
    once.
    """
    problem = random_problem(rng, n)
    solution, clock = GenericTorus(problem), FourierClock(problem)
    z = rng.uniform(-1, 1, (40, n - 1))
    series = clock.mean + clock.sums(z)[1]
    q = solution.attitude(z).q
    A = np.array([float(a) for a in solution.moving.A])
    start = np.array([float(x) for x in solution.spectrum.q]) ** 2 @ A
    expected = np.sqrt(np.sum(A * q * q, axis=1) / start) / float(solution.spectrum.time_rate)
    assert np.allclose(series, expected, rtol=1e-13, atol=0)
    assert np.allclose(solution.rate_at(z), expected, rtol=1e-13, atol=0)


def test_the_mean_rate_is_an_average_over_the_orbit() -> None:
    solution = GenericTorus(tagged("generic")[1].problem())
    tau1 = np.linspace(-2e4, 2e4, 40_001)
    rates = solution.rate_at(solution.in_tau1.phases(tau1))
    assert np.isclose(np.mean(rates), solution.mean_rate, rtol=1e-4)


@pytest.mark.parametrize("gap", [1e-3, 1e-5])
def test_clocks_work_where_a_gap_nearly_closes(gap: float) -> None:
    problem, times = near_separatrix(gap).problem(), np.linspace(-30, 30, 41)
    by_modes, on_panels = FourierClock(problem), GenericTorus(problem).panels(times)
    assert np.allclose(by_modes.tau1(times)[0], on_panels.tau1(times)[0], atol=1e-12)
