"""Fourier sums beyond 15 digits, and their clock where that of panels
does not reach.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any, Literal

import numpy as np
import pytest

import veselova as vs
from veselova.analytic.arithmetic.balls import Balls, balls
from veselova.analytic.numerics import fourier_sums
from veselova.analytic.numerics.fourier_sums import SumsOverPoints, sums_over_modes
from veselova.analytic.time_map import panels_balls

KINDS: tuple[Literal["cosines"], Literal["sines"]] = ("cosines", "sines")
SIZES = [Fraction(1, 10**120), 1, 10**120]


def drawn(genus: int, size: Any, xp: Balls, rng: np.random.Generator) -> tuple[Any, Any, Any]:
    """Return modes of which no two are opposite, their coefficients, of which one may be open, and
    points, exact numbers.
    """
    modes = np.unique(rng.integers(-9, 10, (60, genus)), axis=0)
    first = modes[np.arange(len(modes)), np.argmax(modes != 0, axis=1)]
    modes = rng.permutation(modes[first > 0]) * -1
    coefficients = xp.array(rng.normal(size=len(modes))) * xp.number(size) / xp.number(3)
    if size != 1:
        coefficients[-1] = xp.add_error(coefficients[-1], coefficients[-1] * xp.epsilon)
    return (
        modes,
        coefficients,
        xp.midpoints(xp.array(rng.uniform(-2, 2, (11, genus))) / xp.number(7)),
    )


@pytest.mark.parametrize("digits", [18, 240])
@pytest.mark.parametrize("genus", [1, 3])
def test_sums_over_modes_hold_those_in_balls(
    genus: int, digits: int, rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With coefficients of all sizes, some points at a time too; and the radii are not empty
    promises.
    """
    with balls(digits, False) as xp:
        for size, places in zip(SIZES, (10**6, 100, 1), strict=True):
            monkeypatch.setattr(fourier_sums, "_EXPONENTIALS", places)
            modes, coefficients, points = drawn(genus, size, xp, rng)
            with xp.at(digits + 30) as finer:
                waves = finer.exponentials(modes, finer.turns(points))
                exact = [
                    finer.product(wave.T, xp.midpoints(coefficients)[:, None])[:, 0]
                    for wave in waves
                ]
            for kind, expected in zip(KINDS, exact, strict=True):
                found = sums_over_modes(kind, modes, coefficients, xp.turns(points), xp)
                assert all(a.contains(b) for a, b in zip(found, expected, strict=True))
                assert float(max(a.rad() for a in found) / xp.number(size)) < 1e3 * 10.0**-digits


@pytest.mark.parametrize("digits", [18, 240])
@pytest.mark.parametrize("genus", [2, 3])
def test_sums_over_points_hold_those_in_balls(
    genus: int, digits: int, rng: np.random.Generator
) -> None:
    with balls(digits, False) as xp:
        modes, _, points = drawn(genus, 1, xp, rng)
        weights = np.stack(
            [
                xp.array(rng.normal(size=len(points))) * xp.number(size) / xp.number(3)
                for size in SIZES
            ]
        )
        sums = SumsOverPoints(xp.turns(points), weights, 9, xp)
        with xp.at(digits + 30) as finer:
            expected = finer.product(
                finer.exponentials(modes, finer.turns(points))[0], xp.midpoints(weights).T
            )
        # rows of modes are kept from the first to the second
        for rows in (slice(0, 1), slice(None)):
            for found, plain in zip(sums.cosines(modes[rows]), expected[rows], strict=True):
                for a, b, size in zip(found, plain, SIZES, strict=True):
                    assert a.contains(b)
                    assert float(a.rad() / xp.number(size)) < 1e3 * 10.0**-digits


@pytest.mark.parametrize("A", [["3", "2", "1.2"], slow(["4", "3", "2", "1"])])
def test_modes_take_over_where_panels_do_not_reach(
    A: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    body, times = (
        vs.Veselova(A, [1, 1, 1, 1][-len(A) :], [1, -2, 3, 1][-len(A) :], normalize=True),
        ["-1e-30", "0.5", 2],
    )
    by_panels = vs.solve(body, times, digits=20)
    monkeypatch.setattr(panels_balls, "_MOST_NODES", 10)
    by_modes = vs.solve(body, times, digits=20)
    assert [found.provenance.details["time_map"] for found in (by_panels, by_modes)] == [
        "panels",
        "fourier",
    ]
    assert by_panels.decimals is not None
    assert by_modes.decimals is not None
    difference = np.abs(
        by_panels.decimals.midpoints["frame"] - by_modes.decimals.midpoints["frame"]
    )
    assert np.max(difference) < 1e-20
    assert float(max(by_modes.decimals.error)) < 1e-20
    with pytest.raises(vs.Unsolved) as caught:
        vs.solve(body, times, digits=20, certified=True)
    assert caught.value.outcome == "too-far"
