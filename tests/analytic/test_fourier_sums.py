"""Fourier sums beyond 15 digits, and their clock where that of panels
does not reach.
"""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction
from typing import Any, Literal

import numpy as np
import pytest

import veselova as vs
from veselova.analytic.arithmetic.balls import Balls, balls
from veselova.analytic.curve.interval import Interval
from veselova.analytic.curve.periods import Periods
from veselova.analytic.digits import fourier as enclosed_fourier
from veselova.analytic.digits import panels as enclosed_panels
from veselova.analytic.digits import solution as enclosed_solution
from veselova.analytic.numerics import fourier_sums
from veselova.analytic.numerics.fourier_sums import SumsOverPoints, sums_over_modes

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


@pytest.mark.parametrize("digits", [18, 61, 240])
@pytest.mark.parametrize("genus", [1, 2, 3])
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


@pytest.mark.parametrize("digits", [18, 61, 240])
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


def test_sums_of_many_digits_at_open_points_are_those_of_their_terms(
    rng: np.random.Generator,
) -> None:
    """Of no size, of no modes, and at points that are open to a digit or two."""
    for digits, size, slack, genus in (
        (300, 1, 0, 3),
        (30, 0, 0, 2),
        (30, 10**200, 0, 1),
        (30, 1, Fraction(1, 1000), 2),
    ):
        with balls(digits, False) as xp:
            modes, coefficients, _ = drawn(genus, size, xp, rng)
            turns = xp.turns(
                xp.add_error(xp.array(rng.uniform(-1, 1, (4, genus))), xp.number(slack))
            )
            weights = coefficients[None, :4]
            points = SumsOverPoints(turns, weights, 9, xp)
            of_points = xp.product(xp.exponentials(modes, turns)[0], weights.T)
            assert all(
                (a - b).contains(0)
                for a, b in zip(points.cosines(modes)[:, 0], of_points[:, 0], strict=True)
            )
            for kind, waves in zip(KINDS, xp.exponentials(modes, turns), strict=True):
                expected = xp.product(waves.T, coefficients[:, None])[:, 0]
                for a, b in zip(
                    sums_over_modes(kind, modes, coefficients, turns, xp), expected, strict=True
                ):
                    assert (a - b).contains(0)
                assert (
                    sums_over_modes(kind, modes[:0], coefficients[:0], turns, xp).tolist()
                    == [0] * 4
                )


@pytest.mark.parametrize("A", [["3", "2", "1.2"], ["4", "3", "2", "1"]])
def test_modes_take_over_where_panels_do_not_reach(
    A: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    body, times = (
        vs.Veselova(A, [1, 1, 1, 1][-len(A) :], [1, -2, 3, 1][-len(A) :], normalize=True),
        ["-1e-30", "0.5", 2],
    )
    by_panels = vs.solve(body, times, digits=20)
    monkeypatch.setattr(enclosed_panels, "_MOST_NODES", 10)
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


def test_panels_take_over_where_there_are_too_many_modes(monkeypatch: pytest.MonkeyPatch) -> None:
    body = vs.Veselova([3, 2, 1], [1, 1, 1], [1, -2, 1], normalize=True)
    by_modes = vs.solve(body, [300], digits=20)
    monkeypatch.setattr(enclosed_fourier, "MOST_MODES", 30)
    by_panels = vs.solve(body, [300], digits=20)
    assert [found.provenance.details["time_map"] for found in (by_panels, by_modes)] == [
        "panels",
        "fourier",
    ]
    assert np.max(np.abs(by_panels.frame - by_modes.frame)) < 1e-15


def test_the_choice_of_a_clock_takes_no_integral_over_gaps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside a closed cut they take digits² nodes in balls, which the route by angles
    does without.
    """
    asked: list[int] = []
    formed = Periods._forms_at_nodes

    def recorded(periods: Periods, interval: Interval) -> Any:
        if periods.arithmetic.has_radii and interval in periods.gaps:
            asked.append(periods.arithmetic.digits)
        return formed(periods, interval)

    monkeypatch.setattr(Periods, "_forms_at_nodes", recorded)
    body = vs.Veselova([2, 2, 1], ["2/3", "1/3", "2/3"], ["0.5", "0.5", "-0.75"])
    assert (
        vs.solve(body, [1, 3], digits=40, method="angles").provenance.details["regime"]
        == "closed-cut"
    )
    assert asked == []
    vs.solve(body, [1, 3], digits=40, method="theta")
    assert asked


def test_many_times_far_out_are_those_of_each() -> None:
    """Ten thousand times over [0, 1000] with 50 digits are more than panels reach; some of them
    here.
    """
    body, times = (
        vs.Veselova([3, 2, 1], [1, 1, 1], [1, -2, 1], normalize=True),
        np.linspace(900, 1000, 600),
    )
    many, single = vs.solve(body, times, digits=50), vs.solve(body, times[::100], digits=50)
    assert many.provenance.details["time_map"] == single.provenance.details["time_map"] == "fourier"
    assert many.decimals is not None
    assert single.decimals is not None
    assert (
        np.max(np.abs(many.decimals.midpoints["frame"][::100] - single.decimals.midpoints["frame"]))
        < 1e-50
    )


def test_modes_below_the_smallest_double_count(monkeypatch: pytest.MonkeyPatch) -> None:
    body = vs.Veselova(["2.1", "2"], ["0.6", "0.8"], ["0.8", "-0.6"], normalize=True)
    by_modes = vs.solve(body, ["20"], digits=350)
    monkeypatch.setattr(enclosed_solution, "MOST_MODES", 0)
    by_panels = vs.solve(body, ["20"], digits=350)
    assert [found.provenance.details["time_map"] for found in (by_panels, by_modes)] == [
        "panels",
        "fourier",
    ]
    assert by_panels.decimals is not None
    assert by_modes.decimals is not None
    assert max(by_modes.decimals.error) < Decimal("1e-350")
    assert np.max(
        np.abs(by_modes.decimals.midpoints["frame"] - by_panels.decimals.midpoints["frame"])
    ) < Decimal("1e-350")


@pytest.mark.parametrize("apart", [["1", "2.5"], ["1", "2", "3.5"]])
def test_modes_of_nearly_coinciding_phases_are_found(apart: list[str]) -> None:
    """A proven radius holds them: that of panels, which know nothing of modes."""
    A = [1, *(1 + Fraction(x) / 10**16 for x in apart)]
    body = vs.Veselova(
        A,
        ["0.797", "0.1", "0.604", "0.3"][: len(A)],
        ["-0.5", "0.82", "0.69", "0.4"][: len(A)],
        normalize=True,
    )
    by_modes, proven = (
        vs.solve(body, [29, 1e5], digits=18),
        vs.solve(body, [29], digits=18, certified=True),
    )
    assert [found.provenance.details["time_map"] for found in (by_modes, proven)] == [
        "fourier",
        "panels",
    ]
    assert by_modes.decimals is not None
    assert proven.decimals is not None
    difference = np.max(
        np.abs(by_modes.decimals.midpoints["frame"][0] - proven.decimals.midpoints["frame"][0])
    )
    assert difference <= by_modes.decimals.error[0] + proven.decimals.error[0]
