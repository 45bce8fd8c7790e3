"""The motion of a body depends on ratios of the A's alone; sizes are from 1e-30 to 1e30."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import veselova as vs
from veselova.mechanics.core.errors import InvalidInput

#: n = 4: h and p are multiples of A^(2−n), periods of A^(g + ½ − k).
A = np.array([3.0, 2.0, 1.5, 1.0])
Q, Q_DOT = [0.5, 0.5, 0.5, 0.5], [1.1, -0.7, 0.3, -0.7]
TIMES = [-3.0, 1.0, 10.0]


@pytest.mark.parametrize("engine", ["analytic", "numeric"])
@pytest.mark.parametrize("exponent", [-96, -46, 46, 96])
def test_the_motion_does_not_depend_on_the_scale_of_A(engine: str, exponent: int) -> None:
    scaled, plain = (
        vs.solve(vs.Veselova(a, Q, Q_DOT), TIMES, engine) for a in (np.ldexp(A, exponent), A)
    )
    assert (scaled.frame == plain.frame).all()
    assert (scaled.error == plain.error).all()
    assert np.array_equal(scaled.q_dot, plain.q_dot)


@pytest.mark.parametrize("exponent", [-96, -46, 46, 96])
def test_a_torus_does_not_depend_on_the_scale_of_A(exponent: int) -> None:
    scaled, plain = (vs.torus(vs.Veselova(a, Q, Q_DOT)) for a in (np.ldexp(A, exponent), A))
    for name in ("frequencies_t", "riemann_matrix", "phases", "rotation_numbers"):
        assert np.allclose(getattr(scaled, name), getattr(plain, name), rtol=1e-14, atol=1e-15)
    assert np.allclose(np.ldexp(scaled.constants, exponent), plain.constants, rtol=1e-14)
    assert np.isclose(np.ldexp(scaled.energy, 2 * exponent), plain.energy, rtol=1e-14)


@pytest.mark.parametrize("numbers", [[1e31, 1, 1], [1, "1e-31"], [1e30] * 7, [1e-29] * 8])
def test_numbers_beyond_the_door_are_refused_by_name(numbers: list[Any]) -> None:
    q, q_dot = np.eye(len(numbers))[:2]
    with pytest.raises(InvalidInput, match=r"A.*choose (other units|another unit)"):
        vs.Veselova(numbers, q, q_dot)


def test_two_hundred_dimensions_are_a_problem_like_another() -> None:
    n, rng = 200, np.random.default_rng(3)
    q, q_dot = rng.normal(size=(2, n))
    A = np.arange(1, n + 1) / 74
    problem = vs.Veselova(A, q, q_dot / np.linalg.norm(q_dot), normalize=True)
    found = vs.solve(problem, [0.5], "numeric")
    assert found.error[0] < 1e-10
    assert max(found.drift.values()) < 1e-10


@pytest.mark.parametrize("factor", [1e200, 1e-200])
def test_a_velocity_whose_square_is_no_float_is_refused_as_one(factor: float) -> None:
    with pytest.raises(InvalidInput, match="q_dot"):
        vs.Veselova(A, Q, np.array(Q_DOT) * factor)
