"""Motions near a resonance, where some combination m·f of the frequencies nearly vanishes and the
clock swings far and slowly.
"""

from __future__ import annotations

import numpy as np
import pytest

from draws import random_problem
from veselova import Veselova, solve
from veselova.analytic.closed.motion import kernel_motion
from veselova.analytic.kernel import modes
from veselova.analytic.kernel.coefficients import RATE
from veselova.analytic.solve import solve as solve_analytic

#: With A_2 = 1.6 times this 2f_1 = f_2, nearly to rounding.
RESONANT = 2.584309800104662


def beside(distance: float) -> Veselova:
    return Veselova(
        [1.0, 1.6 * (RESONANT + distance), 30.0],
        [0.5, 0.6, 0.62],
        [0.9, -0.5, -0.24],
        normalize=True,
    )


def true_error(
    problem: Veselova, times: np.ndarray, clock: str | None = None
) -> tuple[np.ndarray, np.ndarray]:
    found, truth = solve_analytic(problem, times, time_map=clock), solve(problem, times, digits=25)
    return np.max(np.abs(found.frame - truth.frame), axis=(1, 2)), found.error


def test_times_far_apart_beside_a_resonance() -> None:
    """Phases of nearly commensurable frequencies make the clock swing by thousands of cycles, and
    its values rough.
    """
    body = beside(1e-5)
    together, times = solve(body, [-1e7, 2e7]), (-1e7, 2e7)
    for k, time in enumerate(times):
        alone = solve(body, [time])
        off = np.max(np.abs(alone.frame[0] - together.frame[k]))
        assert off <= alone.error[0] + together.error[k]
    assert np.max(together.error) < 1e-2


@pytest.mark.daily(3)
@pytest.mark.parametrize(("distance", "far"), [(1e-4, 1e3), (1e-4, 1e6), (2e-7, 1e3)])
def test_motions_beside_a_resonance_are_known_as_well_as_their_slow_modes(
    distance: float, far: float
) -> None:
    error, reported = true_error(beside(distance), far * np.array([-0.9, -0.3, 0.11, 0.97]))
    assert np.all(error <= reported)
    assert np.max(reported) < (1e-8 if far < 1e4 else 1e-2)


def test_resonant_modes_next_to_those_kept_are_in_the_error() -> None:
    """Here (11, −3) is left out, with F_m of 1e-16 of the mean, but m·f is 5e-4 of the fastest: it
    moves τ₁ by 4e-13.
    """
    rng = np.random.default_rng(80)
    problem = [(random_problem(rng, 3), rng.uniform(size=6))[0] for _ in range(16)][-1]
    error, reported = true_error(problem, np.linspace(300, 1000, 8))
    assert np.all(error <= reported)


def test_exact_resonances_are_left_to_panels() -> None:
    """Frequencies that are commensurable to the last bit: then m·z stands still."""
    torus = kernel_motion(beside(0.0)).torus
    rates = torus.frequencies.copy()
    rates[0] = rates[1] * np.rint(64 * rates[0] / rates[1]) / 64
    resonant = torus._replace(frequencies=rates)
    flow = rates / torus.mean, np.zeros(2)
    found = modes.make_modes(resonant, RATE, *flow, modes.SIDES[2], modes.MOST_MODES[2])
    assert found.reach[0] == modes.RESONANT
