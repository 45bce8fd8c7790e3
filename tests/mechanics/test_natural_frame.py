"""The natural frame to the last bit, against eigenvectors with 150 digits."""

from __future__ import annotations

from fractions import Fraction

import mpmath
import numpy as np
import pytest

from veselova import NeumannSystem, Unsolved, solve
from veselova.mechanics.systems.torus_problem import TorusProblem


def true_frame(problem: TorusProblem, rate_squared: Fraction) -> np.ndarray:
    """Return columns n_2 … n_{n−1}, γ: eigenvectors of A⁻¹ − q'q'ᵀ restricted to q⊥, but for
    signs.
    """

    def column(vector: tuple[Fraction, ...]) -> mpmath.matrix:
        return mpmath.matrix([mpmath.mpf(x.numerator) / x.denominator for x in vector])

    with mpmath.workdps(150):
        exact = problem.exact
        q, velocity = column(exact.q), column(exact.tangent)
        q /= mpmath.norm(q)
        velocity /= mpmath.sqrt(mpmath.mpf(rate_squared.numerator) / rate_squared.denominator)
        inverse = mpmath.diag(column(tuple(1 / a for a in exact.A)))
        across = mpmath.eye(problem.n) - q * q.T
        restricted = across * (inverse - velocity * velocity.T) * across
        # q in the last place, beyond every constant
        most = 2 * (mpmath.mnorm(inverse) + mpmath.norm(velocity) ** 2)
        vectors = mpmath.eigsy(restricted + most * q * q.T)[1]
        found = np.array(vectors.tolist(), dtype=float)
    return np.roll(found[:, :-1], -1, axis=1)


def off(frame: np.ndarray, truth: np.ndarray) -> float:
    """Return how far the columns e_2 … e_n are from the true ones or their negatives."""
    signs = np.sign(np.sum(frame[:, 1:] * truth, axis=0))
    return float(np.max(np.abs(frame[:, 1:] - signs * truth)))


@pytest.mark.parametrize("speed", [1e3, 1e7, 1e12, 1e20, 1e30])
def test_at_any_speed(speed: float) -> None:
    """Constants differ by some units, and γ's by the square of the speed."""
    velocity = np.array([0.3, -0.6, 0.8, -0.5]) * speed
    problem = NeumannSystem([1, 0.7, 0.5, 0.2], [0.5] * 4, velocity, normalize=True)
    assert off(problem.frame, true_frame(problem, Fraction(1))) < 2e-16
    assert np.linalg.det(problem.frame) > 0
    if speed > 1e14:
        with pytest.raises(Unsolved, match="beyond-floats"):
            solve(problem, [0])
        return
    precise = solve(problem, [0], digits=25)
    assert np.max(np.abs(precise.frame[0] - problem.frame)) < 2e-16


@pytest.mark.parametrize("apart", ["1e-10", "1e-14", "1e-18", "1e-22", "1e-26"])
def test_constants_however_near(apart: str) -> None:
    """A's so far apart have a constant between them."""
    near = Fraction(1) + Fraction(apart)
    q, v = ["0.5"] * 4, ["0.3", "-0.6", "0.8", "-0.5"]
    problem = NeumannSystem([1, near, near + Fraction(apart), "0.5"], q, v)
    assert off(problem.frame, true_frame(problem, Fraction(1))) < 2e-16


@pytest.mark.parametrize("spread", [1e-12, 1e-13, 1e-14, 1e-15])
def test_of_a_nearly_round_body(spread: float) -> None:
    """All constants but γ's are within the spread: a defect of the columns counts over that."""
    for i in range(12):
        rng = np.random.default_rng([56, i])
        n = 4 + i % 5
        A = 1 + spread * rng.uniform(0, 10, n)
        q, v = rng.normal(size=n), rng.normal(size=n)
        problem = NeumannSystem(A, q, v, normalize=True)
        if len(set(A)) == n:
            assert off(problem.frame, true_frame(problem, Fraction(1))) < 3e-16
