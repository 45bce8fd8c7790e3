"""Starts at which branch points coincide, with many digits and with certified errors: they are
moved, by how much is bounded.
"""

from __future__ import annotations

from decimal import Decimal

import numpy as np
import pytest

import veselova as vs
from deviations import agree
from veselova.analytic.curve.branch_points import resolve_spectrum
from veselova.analytic.curve.moving_part import moving_part

SYMMETRIC = vs.Veselova([3, 3, 1], ["0.6", 0, "0.8"], ["0.4", "0.7", "-0.3"], normalize=True)
FRAMED = vs.Veselova(
    [3, 3, 1],
    ["0.6", 0, "0.8"],
    ["0.4", "0.7", "-0.3"],
    [["0.6", 0, "-0.8"], [0, 1, 0], ["0.8", 0, "0.6"]],
    normalize=True,
)
SPHERE = vs.Veselova([2, 2, 2], ["0.6", 0, "0.8"], ["0.4", "0.7", "-0.3"], normalize=True)
FOUR = vs.Veselova([3, 3, 2, 1], [1, 2, 1, 1], [2, -1, 3, 1], normalize=True)
TINY = vs.Veselova([3, 2, 1], ["1e-140", "0.6", "0.8"], ["1e-140", "0.8", "-0.6"], normalize=True)
SCALED = vs.Veselova([3, 3, 1], ["0.6", 0, "0.8"], ["0.4e28", "0.7e28", "-0.3e28"], normalize=True)

SERIES = ("frame", "q_dot", "tau1", "spheroconic", "omega")


@pytest.mark.daily(3)
@pytest.mark.parametrize(
    ("problem", "times"),
    [
        (SYMMETRIC, [-3, "0.5", 10]),
        (FRAMED, [-3, "0.5", 10]),
        (SPHERE, [-3, "0.5", 30]),
        (FOUR, ["0.5", 2]),
        (TINY, [-1, 4]),
        (SCALED, ["1e-29", "3e-28"]),
    ],
    ids=["symmetric", "framed", "sphere", "four", "tiny", "scaled"],
)
def test_certified_motions_of_coincidences_hold_more_digits(
    problem: vs.Veselova, times: list[str]
) -> None:
    proven = vs.solve(problem, times, certified=True).decimals
    finer = vs.solve(problem, times, digits=45).decimals
    assert proven.certified
    assert max(proven.error) < Decimal("1e-18")
    for name in SERIES:
        difference = np.abs(proven.midpoints[name] - finer.midpoints[name])
        assert np.all(difference <= proven.radii[name] + finer.radii[name]), name


@pytest.mark.parametrize("problem", [SYMMETRIC, SPHERE, FOUR], ids=["symmetric", "sphere", "four"])
def test_certified_motions_of_equal_A_hold_the_integrated_ones(problem: vs.Veselova) -> None:
    times = np.array([-1.0, 0.5, 2.0])
    proven = vs.solve(problem, times, certified=True)
    other = vs.solve(problem, times, "numeric", "taylor")
    agree(proven, other, "frame")
    assert np.max(np.abs(proven.tau1 - other.tau1)) < 1e-13


def test_equal_A_are_not_certified_for_ever() -> None:
    with pytest.raises(vs.Unsolved, match="drift") as caught:
        vs.solve(SYMMETRIC, [1e5], certified=True)
    assert caught.value.outcome == "not-enclosed"


def test_a_separatrix_is_not_certified() -> None:
    """F_1 = v_1² + Σ (q_1v_j−q_jv_1)²/(I_1−I_j) vanishes at q = (0, 1, 1)/√2 with 1/A = 2, 1, 3,
    whatever the velocity.
    """
    problem = vs.Veselova(["1/2", 1, "1/3"], [0, 1, 1], [1, "0.5", "-0.5"], normalize=True)
    assert resolve_spectrum(moving_part(problem), 20).separatrices == (1,)
    with pytest.raises(vs.Unsolved, match="separatrix") as caught:
        vs.solve(problem, [1], certified=True)
    assert caught.value.outcome == "not-enclosed"
