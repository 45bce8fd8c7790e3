"""Sweeps over three hundred random LR systems, n ≤ 6, every rank, over t = 100. Minutes: run with
./check --sweep.
"""

from __future__ import annotations

import numpy as np
import pytest
from test_lr import DRIFT

from lr_draws import GROUPS, RANKS, group_named, random_lr, random_lr_on
from veselova import LRSystem, Trajectory, solve

pytestmark = pytest.mark.sweep

TIMES = np.linspace(0, 100, 51)


def worst_drift(trajectory: Trajectory) -> float:
    """The largest drift; the energy's against the kinetic energy where terms of both signs make it
    small.
    """
    system, drift = trajectory.problem, dict(trajectory.drift)
    kinetic = float(system.inertia(system.omega) @ system.omega) / 2
    name = system.energy_name
    drift[name] *= min(1.0, abs(float(trajectory.integrals[name][0])) / kinetic)
    return max(drift.values())


def hold(system: LRSystem) -> None:
    """Both formulations, by different methods, keep their integrals and agree, and errors are what
    they say.
    """
    default = solve(system, TIMES)
    other = solve(system, TIMES, method="taylor", formulation="multipliers")
    assert worst_drift(default) < DRIFT
    assert worst_drift(other) < 5e-14
    difference = np.max(np.abs(default.frame - other.frame), axis=(1, 2))
    assert np.all(difference <= default.error + other.error)
    # 1e-9, but for motions so sensitive that the estimate itself is larger.
    assert np.all(difference[default.error <= 1e-9] <= 1e-9)


@pytest.mark.parametrize("homogeneous", [True, False])
@pytest.mark.parametrize(("n", "rank"), RANKS)
def test_twenty_systems_of_each_rank(n: int, rank: int, homogeneous: bool) -> None:
    rng = np.random.default_rng([n, rank, homogeneous])
    for k in range(10):
        hold(random_lr(rng, n, rank, homogeneous=homogeneous, special=k % 2 == 0))


@pytest.mark.parametrize("name", GROUPS)
def test_systems_on_other_groups(name: str) -> None:
    rng, group = np.random.default_rng(3), group_named(name)
    for k in range(5):
        system = random_lr_on(rng, group, k * group.dimension // 5)
        default, other = solve(system, TIMES), solve(system, TIMES, formulation="multipliers")
        assert worst_drift(default) < DRIFT
        assert np.max(default.integrals["group"]) < 1e-14
        assert np.all(
            np.max(np.abs(default.frame - other.frame), axis=(1, 2)) <= default.error + other.error
        )
