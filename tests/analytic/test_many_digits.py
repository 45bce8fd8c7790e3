"""Many times with many digits, and what their sums are made of."""

from __future__ import annotations

import math
from fractions import Fraction

import flint
import numpy as np
import pytest
from test_theta import all_characteristics, as_flint_orders

import veselova as vs
from draws import random_riemann_matrix
from veselova.analytic.arithmetic.balls import balls
from veselova.analytic.theta.many_digits import ThetaInBalls
from veselova.mechanics.systems.veselova import Veselova

BODIES = {
    "three": Veselova([3, 2, "1.2"], ["0.6", 0, "0.8"], ["0.4", "0.7", "-0.3"]),
    "four": Veselova([4, 3, 2, 1], [1, 1, 1, 1], [1, -2, 3, 1], normalize=True),
    "equal": Veselova([3, 3, 2, 1], [1, 2, 1, 1], [2, -1, 3, 1], normalize=True),
    "frozen": Veselova([4, 3, 2, 1], [1, 1, 0, 1], [1, -2, 0, 1], normalize=True),
    "plane": Veselova([3, 2], ["0.6", "0.8"], ["0.8", "-0.6"]),
}


@pytest.mark.parametrize("name", BODIES)
def test_many_times_in_balls_are_the_motion_of_each(name: str) -> None:
    """A dense stretch before t = 0, one after it, and times between."""
    times = np.unique(
        np.concatenate(
            [np.linspace(-1, -0.5, 900), np.linspace(-0.4, 1, 30), np.linspace(1, 1.5, 900)]
        )
    )
    chosen = np.arange(0, times.size, 97)
    many, single = (
        vs.solve(BODIES[name], times, digits=30),
        vs.solve(BODIES[name], times[chosen], digits=30),
    )
    for series in ("frame", "q", "q_dot", "omega", "spheroconic", "tau1"):
        found, expected = many.decimals, single.decimals
        difference = np.abs(found.midpoints[series][chosen] - expected.midpoints[series])
        assert np.all(difference <= found.radii[series][chosen] + expected.radii[series]), series
    assert max(many.decimals.error) < 1e-30


@pytest.mark.parametrize("genus", [1, 2, 3])
def test_theta_functions_in_balls_hold_flints(genus: int, rng: np.random.Generator) -> None:
    characteristics = all_characteristics(genus)
    for smallest in (0.3, 0.02):
        T, z = random_riemann_matrix(rng, genus, smallest), rng.uniform(-2, 2, genus)
        with balls(40, False) as xp:
            found = ThetaInBalls(xp.array(T), xp).values(xp.array(z)[None, :], characteristics)[0]
            tau = flint.acb_mat([[flint.acb(0, float(x)) for x in row] for row in T])
            theirs = tau.theta(flint.acb_mat([[flint.acb(float(x))] for x in z]))
            for characteristic, value in zip(characteristics, found, strict=True):
                ratio = theirs[0, as_flint_orders(characteristic)] / theirs[0, 0]
                assert (value / found[0]).overlaps(ratio.real), characteristic
                assert float((value / found[0]).rad()) < 1e-37 * (1 + abs(float(value / found[0])))


def _value(poles: list[Fraction], weights: list[Fraction], x: Fraction) -> Fraction:
    """Return Σ_i w_i Π_{k≠i}(x−p_k)."""
    return sum(
        (w * math.prod(x - p for p in poles if p != own) for own, w in zip(poles, weights)),
        Fraction(),
    )


def test_many_digits_near_a_separatrix_fit_into_memory() -> None:
    """A relative gap of 1e-251: series of thousands of terms, whose sums node by node took
    gigabytes.
    """
    problem = Veselova([3, 2, 1], ["0.6", "1e-125", "0.8"], ["0.8", "1e-125", "-0.6"])
    found, finer = (vs.solve(problem, [1], digits=digits).decimals for digits in (20, 30))
    assert np.max(np.abs(found.midpoints["frame"] - finer.midpoints["frame"])) < 1e-20
