"""The torus of a motion and the way back from it; regimes; actions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from draws import random_problem
from problems import named
from veselova import EllipsoidGeodesic, NeumannSystem, Veselova, from_torus, solve, torus


@pytest.mark.parametrize("n", range(2, 9))
def test_constants_and_phases_give_the_start_back(n: int, rng: np.random.Generator) -> None:
    for _ in range(5):
        problem = random_problem(rng, n)
        found = torus(problem)
        again = from_torus(
            problem.A, found.energy, found.constants, found.phases, found.signs, problem.frame
        )
        assert np.max(np.abs(again.q - problem.q)) < 1e-13
        assert np.max(np.abs(again.q_dot - problem.q_dot)) < 1e-13 * np.max(np.abs(problem.q_dot))
        back = torus(again)
        assert np.max(np.abs(np.mod(back.phases - found.phases + 0.5, 1) - 0.5)) < 1e-13
        assert np.isclose(back.energy, found.energy, rtol=1e-13)
        assert np.allclose(back.constants, found.constants, rtol=1e-13)


def test_phases_advance_by_the_frequencies() -> None:
    """Moved along the flow, a start has moved phases: z⁰ + fτ₁."""
    problem = Veselova([3, 2, 1.5, 1], [0.5] * 4, [1.1, -0.7, 0.3, -0.7])
    found, later = torus(problem), solve(problem, [2.5])
    moved = torus(Veselova(problem.A, later.q[0], later.q_dot[0], normalize=True))
    expected = found.phases + found.frequencies_tau1 * later.tau1[0]
    assert np.max(np.abs(np.mod(moved.phases - expected + 0.5, 1) - 0.5)) < 1e-13
    started = from_torus(
        problem.A, found.energy, found.constants, expected, np.sign(later.q[0]).astype(int)
    )
    assert np.allclose(started.q, later.q[0], atol=1e-13)


def test_tori_of_neumanns_system_and_of_geodesics_move_their_phases(
    rng: np.random.Generator,
) -> None:
    for n in (2, 3, 4, 5):
        A, q, v = rng.uniform(1, 3, n), rng.normal(size=n), rng.normal(size=n)
        point = NeumannSystem(A, q, v, normalize=True)
        geodesic = EllipsoidGeodesic(A, q, v, normalize=True)
        later, farther = solve(point, [2.5]), solve(geodesic, [2.5])
        moved = torus(NeumannSystem(A, later.q[0], later.q_prime[0], normalize=True))
        shift = moved.phases - torus(point).phases - 2.5 * torus(point).frequencies_t
        assert np.max(np.abs(np.mod(shift + 0.5, 1) - 0.5)) < 1e-12
        assert np.allclose(
            torus(point).constants,
            point.integrals(point.start)["constants"][0],
            rtol=1e-12,
            atol=1e-13,
        )
        passed = torus(EllipsoidGeodesic(A, farther.X[0], farther.X_dot[0], normalize=True))
        shift = (
            passed.phases
            - torus(geodesic).phases
            - farther.tau1[0] * torus(geodesic).frequencies_tau1
        )
        assert np.max(np.abs(np.mod(shift + 0.5, 1) - 0.5)) < 1e-12
        assert np.allclose(torus(geodesic).constants, 1 / geodesic.quadrics, rtol=1e-12)


@pytest.mark.parametrize("n", [2, 3, 4])
def test_actions_are_loop_integrals(n: int, rng: np.random.Generator) -> None:
    problem = random_problem(rng, n, ratio=5.0)
    found = torus(problem)
    inverse, constants = 1 / problem.A, np.concatenate([[0.0], found.constants])
    for s in range(n - 1):
        low, high = found.branch_points[2 * s + 1 : 2 * s + 3]

        def momentum(angle: float, low: float = low, high: float = high) -> float:
            point = (low + high) / 2 - (high - low) / 2 * np.cos(angle)
            ratio = np.prod(np.abs(point - constants)) / np.prod(np.abs(point - inverse))
            return float(0.5 * np.sqrt(ratio) * (high - low) / 2 * np.sin(angle))

        assert np.isclose(
            found.actions[s], quad(momentum, 0, np.pi, epsabs=1e-13)[0] / np.pi, rtol=1e-10
        )
    assert found.rotation_numbers[0] == 1
    assert np.allclose(found.rotation_numbers, found.frequencies_t / found.frequencies_t[0])


@pytest.mark.parametrize("n", [3, 4])
def test_frequencies_are_derivatives_of_the_energy_in_the_actions(
    n: int, rng: np.random.Generator
) -> None:
    """Within c_1 = 0: dH = 2π f·dJ with H = ½(Σ I_i − Σ c_k), Neumann's energy, for every change of
    the other constants.
    """
    problem = random_problem(rng, n, ratio=5.0)
    found, step = torus(problem), 1e-5
    for k in range(n - 2):
        actions = []
        for sign in (1, -1):
            constants = found.constants.copy()
            constants[k] += sign * step
            actions.append(
                torus(from_torus(problem.A, 1, constants, found.phases, found.signs)).actions
            )
        change = (actions[0] - actions[1]) / (2 * step)
        terms = 2 * np.pi * found.frequencies_tau1 * change
        assert np.isclose(np.sum(terms), -0.5, atol=1e-6 * np.sum(np.abs(terms)))


@pytest.mark.parametrize(
    ("name", "regime"),
    [
        ("body4", "generic"),
        ("two-pairs", "closed-cut"),
        ("planar", "closed-cut"),
        ("umbilic", "separatrix"),
    ],
)
def test_the_regime_is_named(name: str, regime: str) -> None:
    case = named(name)
    found = torus(case.problem())
    assert found.regime == regime
    assert found.constants.size == found.n - 2
    assert np.allclose(found.constants, case.problem().constants, atol=1e-13)
