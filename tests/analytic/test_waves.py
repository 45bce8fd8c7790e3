"""Trigonometric sums from powers, against sines and cosines of every angle."""

from __future__ import annotations

import numpy as np
import pytest

from veselova.analytic.arithmetic.arithmetic import DOUBLE, Arithmetic
from veselova.analytic.arithmetic.trigonometric_sums import exponentials, powers, turns, waves_at


def test_powers_are_as_exact_as_multiples_of_the_angle(rng: np.random.Generator) -> None:
    angles, orders = rng.uniform(-np.pi, np.pi, (5, 40)), np.arange(101)[:, None, None]
    difference = np.abs(powers(angles, 100) - np.exp(1j * angles * orders))
    assert np.all(difference <= 4 * np.finfo(float).eps * np.maximum(orders, 1))


@pytest.mark.parametrize("dimension", [1, 2, 4])
def test_waves_are_products_of_powers(dimension: int, rng: np.random.Generator) -> None:
    angles, orders = rng.uniform(-3, 3, (30, dimension)), rng.integers(-9, 10, (50, dimension))
    found = exponentials(turns(angles, 9), orders)
    assert found.shape == (50, 30)
    assert np.max(np.abs(found - np.exp(1j * (orders @ angles.T)))) < 3e-14


@pytest.mark.parametrize("count", [1, 300])
def test_few_waves_are_those_of_many(count: int, rng: np.random.Generator) -> None:
    angles, orders = rng.uniform(-6, 6, (count, 3)), rng.integers(-9, 10, (50, 3))
    found = waves_at(angles, orders, 9)
    assert found.shape == (2, 50, count)
    assert np.max(np.abs(found[0] + 1j * found[1] - np.exp(1j * (orders @ angles.T)))) < 6e-14


def test_no_order_but_zero_is_a_constant(rng: np.random.Generator) -> None:
    assert np.array_equal(
        exponentials(turns(rng.uniform(-3, 3, (6, 2)), 0), np.zeros((3, 2), dtype=np.int64)),
        np.ones((3, 6)),
    )


@pytest.mark.parametrize("count", [1, 2, 7, 30])
def test_sums_of_doubles_are_those_of_every_arithmetic(
    count: int, rng: np.random.Generator
) -> None:
    coefficients, psi = rng.normal(size=(3, count, 4)), rng.uniform(-6, 6, (20, 3))
    for name in ("sine_sums", "cosine_sums"):
        found, expected = (
            getattr(DOUBLE, name)(coefficients)(psi),
            getattr(Arithmetic, name)(DOUBLE, coefficients)(psi),
        )
        assert found.shape == expected.shape
        assert np.allclose(found, expected, rtol=0, atol=2e-14 * np.sum(np.abs(coefficients))), name
