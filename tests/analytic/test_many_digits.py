"""Many times with many digits, and what their sums are made of."""

from __future__ import annotations

import math
import random
from fractions import Fraction
from typing import Any

import flint
import mpmath
import numpy as np
import pytest
from test_theta import all_characteristics, as_flint_orders

import veselova as vs
from draws import random_riemann_matrix
from veselova.analytic.arithmetic.arithmetic import Arithmetic
from veselova.analytic.arithmetic.balls import balls
from veselova.analytic.numerics.chebyshev_balls import ChebyshevSeriesInBalls
from veselova.analytic.spectrum.polynomials import spheroconic
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


@pytest.mark.parametrize(("digits", "terms"), [(15, 1), (20, 2), (30, 41), (60, 130), (100, 90)])
def test_series_hold_the_sums_of_their_terms(
    digits: int, terms: int, rng: np.random.Generator
) -> None:
    """Against cosines, for coefficients of all sizes, zero and open ones among them; and the radii
    are no wider than the points and coefficients make them.
    """
    sizes = [1, Fraction(1, 10**140), 10**140, 0, 3]
    with balls(digits, True) as xp:
        decay = 10.0 ** (-digits / terms)
        rows = [
            [
                xp.number(size) * xp.number(x) * xp.number(decay) ** k
                for k, x in enumerate(rng.normal(size=terms))
            ]
            for size in sizes
        ]
        coefficients = np.array(rows, dtype=object)
        coefficients[4] = xp.add_error(coefficients[4], xp.number(10) ** -5)
        angles = xp.array(rng.uniform(0, 3, 30))
        found = ChebyshevSeriesInBalls(coefficients[None], xp)(0, xp.cos(angles))
        cosines = xp.cos(angles[:, None] * np.arange(terms))
        for row, of_cosines in zip(found, cosines @ coefficients.T, strict=True):
            assert all(a.overlaps(b) for a, b in zip(row, of_cosines, strict=True))
            widths = [
                float(a.rad() / xp.number(size)) for a, size in zip(row, sizes, strict=True) if size
            ]
            assert max(widths[:3]) < 10.0 ** (2 - digits) * terms
            assert 1e-6 < widths[3] < 1e-5 * (2 * terms) ** 2
            assert row[3] == 0 or abs(row[3]) < xp.number(10) ** -digits


def test_series_of_any_size_are_summed_at_any_point() -> None:
    """Those beyond the range of doubles, and points that are not in [−1, 1]."""
    with balls(80, False) as xp:
        for size in (10**400, Fraction(1, 10**249)):
            row = [xp.number(size), xp.number(size) / 3]
            found = ChebyshevSeriesInBalls(np.array([[row]], dtype=object), xp)(
                0, xp.array([Fraction(1, 7)])
            )[0, 0]
            assert (found - row[0] - row[1] / 7).contains(0)
            assert found.rad() < xp.number(size) * xp.number(10) ** -78
        polynomial = np.zeros((1, 1, 40), dtype=object)
        polynomial[0, 0, 39] = xp.number(1)
        series = ChebyshevSeriesInBalls(polynomial, xp)
        wide = xp.add_error(xp.array([Fraction(101, 100)]), xp.number(1) / 100)
        assert series(0, wide)[0, 0].contains(1)  # at 1, which is a point of that ball
        assert abs(series(0, xp.array([2]))[0, 0] / np.cosh(39 * np.arccosh(2.0)) - 1) < 1e-12


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


@pytest.mark.parametrize("digits", [20, 60])
@pytest.mark.parametrize("size", [2, 3, 4])
def test_lambdas_of_many_positions_hold_those_of_each(
    size: int, digits: int, rng: np.random.Generator
) -> None:
    """At random, on a coordinate plane, beside one, and where two of them all but meet."""
    inverse = [Fraction(1, 5), Fraction(1, 4), Fraction(1, 4) + Fraction(1, 10**9), Fraction(1)][
        -size:
    ]
    chosen = [
        [0.6, 0, 0.8, 0],
        [0.6, 1e-25, 0.5, 0.3],
        [0.6, 1e-9, 1e-9, 0.8],
        [0, 0, 0, 1],
        [0.3, 1, 1e-12, 0],
    ]
    rows = [row[-size:] for row in rng.normal(size=(5, 4)).tolist() + chosen]
    with balls(digits, False) as xp:
        q = xp.array(rows)
        q = q / xp.sqrt(np.sum(q * q, axis=1))[:, None]
        found = spheroconic(q, xp.array(inverse), xp)
        for row, balls_of_row in zip(q, found, strict=True):
            squares = [xp.rational(x) ** 2 for x in row]
            for ball in balls_of_row:
                middle, radius = xp.rational(ball), xp.rational(ball.rad())
                low, high = (
                    _value(inverse, squares, x) for x in (middle - radius, middle + radius)
                )
                assert low * high <= 0
                assert float(ball.rad()) < 10.0 ** (3 - digits)


def test_decimals_cover_their_balls() -> None:
    generator = random.Random(2)
    with balls(60) as xp:

        def exactly(x: Any) -> Fraction:
            return xp.rational(x)

        for _ in range(3000):
            middle = xp.number(generator.uniform(-1, 1)) * xp.number(10) ** generator.choice(
                [0, 0, -3, 5, -150, 150, -40]
            )
            radius = xp.number(generator.random()) * xp.number(2) ** generator.choice(
                [-200, -600, -3, 5]
            )
            ball = xp.add_error(
                middle * generator.choice([0, 1]), radius * generator.choice([0, 1])
            )
            midpoints, radii = xp.decimals(np.array([ball]), 53)
            off = abs(Fraction(midpoints[0]) - exactly(ball))
            assert exactly(ball.rad()) + off <= Fraction(radii[0])
            loose = exactly(ball.rad()) + Fraction(1, 10**52) * max(
                abs(exactly(ball)), exactly(ball.rad())
            )
            assert Fraction(radii[0]) <= loose * Fraction(100_002, 100_000)
            assert len(midpoints[0].as_tuple().digits) <= 54


def test_balls_take_numbers_of_other_arithmetics_with_their_signs() -> None:
    with balls(30) as xp:
        for value in (
            -2.5,
            2.5,
            Fraction(-1, 3),
            mpmath.mpf(-2.5),
            mpmath.mpf(0),
            mpmath.mpf(7),
        ):
            assert xp.number(value).contains(
                flint.arb(flint.fmpq(*Fraction(str(value)).as_integer_ratio()))
            ), value


@pytest.mark.parametrize("count", [301, 640])
def test_series_of_many_nodes_are_the_sums_that_define_them(
    count: int, rng: np.random.Generator
) -> None:
    with balls(30) as xp:
        values = xp.array(rng.normal(size=(2, count))) / 3
        direct = Arithmetic.cosine_series(xp, values)
        for one, other in zip(xp.cosine_series(values).ravel(), direct.ravel(), strict=True):
            assert one.overlaps(other)
            assert float(one.rad()) < 1e-34


def test_many_digits_near_a_separatrix_fit_into_memory() -> None:
    """A relative gap of 1e-251: series of thousands of terms, whose sums node by node took
    gigabytes.
    """
    problem = Veselova([3, 2, 1], ["0.6", "1e-125", "0.8"], ["0.8", "1e-125", "-0.6"])
    found, finer = (vs.solve(problem, [1], digits=digits).decimals for digits in (20, 30))
    assert np.max(np.abs(found.midpoints["frame"] - finer.midpoints["frame"])) < 1e-20


def test_time_zero_takes_no_digits_from_the_others() -> None:
    """By panels, which certified answers take, τ₁ is an end of the first one there: no root is
    looked for.
    """
    problem = vs.Veselova(
        [3, 2, 1], ["0.6", "0.48", "0.64"], ["0.3", "-0.7", "0.4"], normalize=True
    )
    found = [vs.solve(problem, times, digits=50, certified=True) for times in ([0, 1, 10], [1, 10])]
    working = [trajectory.provenance.details["working_digits"] for trajectory in found]
    assert working[0] == working[1]
    assert found[0].decimals.midpoints["tau1"][0] == 0
