"""Many tori at once: the numbers of ``torus``, problem by problem, whatever else is computed with
them.
"""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np
import pytest

from veselova import Veselova, torus
from veselova.analytic.closed.many import KnownTori, tori

Array = np.ndarray[Any, Any]

NUMBERS = [field.name for field in fields(KnownTori) if field.name not in ("known", "origins")]


def starts(
    rng: np.random.Generator, count: int, n: int, ratio: float
) -> tuple[Array, Array, Array]:
    return (
        np.exp(rng.uniform(0, np.log(ratio), (count, n))),
        rng.normal(size=(count, n)),
        rng.normal(size=(count, n)),
    )


def difficult(rng: np.random.Generator, count: int, n: int) -> tuple[Array, Array, Array]:
    """Return starts with nearly equal A's, near planes q_i = 0, with q̇ nearly along q, and with
    directions that hardly move.
    """
    A, q, q_dot = starts(rng, count, n, 10.0)
    kind, part = np.arange(count) % 4, 10.0 ** -rng.uniform(0, 11, count)
    on_plane = 10.0 ** -rng.uniform(0, 40, count)
    A[:, 1] = np.where(kind == 0, A[:, 0] * (1 + part), A[:, 1])
    q[:, 0] *= np.where(kind == 1, on_plane, np.where(kind == 3, part, 1))
    q_dot[:, 0] *= np.where(kind == 3, part, 1)
    q_dot = np.where((kind == 2)[:, None], q + part[:, None] * q_dot, q_dot)
    return A, q, q_dot


def deviation(found: KnownTori, i: int, A: Array, q: Array, q_dot: Array) -> float:
    """Return the largest difference of any number of torus i to that of ``torus``, relative to it
    (for phases: of a cycle).
    """
    expected = torus(Veselova(A[i], q[i], q_dot[i], normalize=True))
    assert expected.origins == tuple(found.origins[i])
    assert expected.regime == "generic"
    worst = 0.0
    for name in NUMBERS:
        there, here = np.atleast_1d(getattr(expected, name)), np.atleast_1d(getattr(found, name)[i])
        assert there.shape == here.shape
        apart = (
            np.abs(np.mod(here - there + 0.5, 1) - 0.5)
            if name == "phases"
            else np.abs(here - there)
        )
        size = np.where((there == 0) | (name == "phases"), 1, np.abs(there))
        worst = max(worst, float(np.max(apart / size, initial=0)))
    return worst


@pytest.mark.parametrize("n", range(2, 8))
def test_many_tori_are_those_of_each(n: int, rng: np.random.Generator) -> None:
    for ratio in (2.0, 100.0):
        data = starts(rng, 15, n, ratio)
        found = tori(*data)
        assert np.all(found.known)
        assert max(deviation(found, i, *data) for i in range(15)) < 1e-14


@pytest.mark.parametrize("n", range(3, 7))
def test_narrow_gaps_cost_no_digit(n: int, rng: np.random.Generator) -> None:
    data = difficult(rng, 40, n)
    found = tori(*data)
    known = np.flatnonzero(found.known)
    assert known.size >= 25
    assert max(deviation(found, i, *data) for i in known.tolist()) < 1e-14


def test_no_bit_depends_on_the_other_problems(rng: np.random.Generator) -> None:
    for n in (2, 3, 5):
        A, q, q_dot = difficult(rng, 120, n)
        whole, order = tori(A, q, q_dot), rng.permutation(120)
        parts = [order[:1], order[1:2], order[2:9], order[9:], order]
        for part in parts:
            alone = tori(A[part], q[part], q_dot[part])
            for field in fields(KnownTori):
                one, of_many = (getattr(x, field.name) for x in (alone, whole))
                assert one.tobytes() == of_many[part].tobytes(), field.name
