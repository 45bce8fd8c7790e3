"""On and beside a separatrix: what is lost stays lost, whatever other times are asked for; and what
the data determine.
"""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
import pytest

import veselova as vs
from draws import _umbilic

PENDULUM = vs.NeumannSystem(["1", "1/2"], [1, 0], [0, 1])


def umbilic(n: int, seed: int) -> vs.Veselova:
    """Return a body whose motion runs into an unstable one: some c_k = I_1 exactly."""
    random = np.random.default_rng([21, n, seed])
    A, q = _umbilic(random, n, [vs_fraction(x) for x in random.integers(1, 9, n)])
    q[0] = q[0] * 0
    velocity = [vs_fraction(x) for x in random.integers(-8, 9, n)]
    velocity[0] = vs_fraction(3)
    return vs.Veselova(A, q, velocity, normalize=True)


def vs_fraction(number: Any) -> Any:
    from fractions import Fraction

    return Fraction(int(number), 7)


def umbilic_geodesic(digits: int) -> vs.EllipsoidGeodesic:
    """Return a geodesic through an umbilic of Σ x_i²/A_i = 1, A = (3, 2, 1), typed with so many
    digits.
    """
    with mpmath.workdps(digits + 10):
        x, z = mpmath.sqrt(mpmath.mpf(3) / 2), mpmath.sqrt(mpmath.mpf(1) / 2)
        tangent = [z, mpmath.mpf("0.7"), -x / 3]
        length = mpmath.sqrt(sum(v * v for v in tangent))
        text = [mpmath.nstr(v, digits) for v in (x, z, *(v / length for v in tangent))]
    return vs.EllipsoidGeodesic([3, 2, 1], [text[0], 0, text[1]], text[2:], normalize=True)


def answered(problem: Any, time: float) -> tuple[Any, float] | None:
    """Return the frame and its error at a time asked for alone, None where no digit is left."""
    try:
        found = vs.solve(problem, [time])
    except vs.Unsolved as refusal:
        if refusal.outcome != "no-digit-left":
            raise
        return None
    return found.frame[0], float(found.error[0])


@pytest.mark.parametrize("time", [120, -120, 50, 1000, 1e6, 1e12])
def test_a_far_time_on_a_separatrix_is_refused_alone_as_among_others(time: float) -> None:
    with pytest.raises(vs.Unsolved, match="no-digit-left"):
        vs.solve(PENDULUM, [time])
    with pytest.raises(vs.Unsolved, match="no-digit-left"):
        vs.solve(PENDULUM, sorted([time, 0.5]))


def test_the_pendulum_is_tanh_within_its_error() -> None:
    times = [-30.0, -20.0, -1.0, 0.0, 1e-3, 5.0, 10.0, 20.0, 30.0]
    found = vs.solve(PENDULUM, times)
    assert (np.abs(found.q[:, 1] - np.tanh(times)) <= found.error).all()
    assert (np.abs(found.q[:, 0] - 1 / np.cosh(times)) <= found.error).all()


@pytest.mark.parametrize(
    "problem", [PENDULUM, umbilic(3, 1), umbilic(3, 2), umbilic(4, 1), umbilic(4, 2)]
)
def test_the_error_never_falls_with_time_and_knows_no_other_time(problem: Any) -> None:
    assert vs.solve(problem, [0.25]).provenance.details["regime"] == "separatrix"
    for side in (1, -1):
        scale = side / problem.turning
        largest, lost = 0.0, False
        for radians in (0.5, 2.0, 7.0, 9.0, 13.0, 20.0, 60.0, 400.0, 1500.0, 6000.0):
            alone = answered(problem, scale * radians)
            assert not (lost and alone), radians
            lost = alone is None
            if alone is not None:
                # the engine's own error, in its place, is of the order of rounding
                assert alone[1] >= largest / 2
                largest = max(largest, alone[1])
                pair = sorted([scale * radians, scale * 0.3])
                among = vs.solve(problem, pair)
                at = pair.index(scale * radians)
                assert np.max(np.abs(among.frame[at] - alone[0])) <= min(among.error[at], alone[1])
        assert lost


def test_the_refusal_says_what_answers() -> None:
    with pytest.raises(vs.Unsolved, match="doubles do not"):
        vs.solve(PENDULUM, [60])


def test_conditioning_of_a_regular_motion_grows_with_time() -> None:
    body = vs.Veselova([3, 2, 1.5], [0.6, 0, 0.8], [0.3, 1, -0.225])
    found = vs.solve(body, [0, 100, 10_000]).conditioning
    assert found.shape == (3,)
    assert 1e-18 < found[0] < 1e-15
    assert 1e-15 < found[1] < 1e-13
    assert 30 < found[2] / found[1] < 300


def test_conditioning_is_that_of_finite_differences() -> None:
    """Data in doubles, moved by a millionth instead, at a time where that is still in
    proportion.
    """
    body = vs.Veselova([3.25, 2.125, 1.5], [0.6, 0, 0.8], [0.3, 1, -0.225])
    here = vs.solve(body, [50])
    largest = 0.0
    for sign in (1, -1):
        moved = vs.Veselova(
            [3.25 * (1 + sign * 1e-7), 2.125, 1.5], [0.6, 0, 0.8], [0.3, 1, -0.225], normalize=True
        )
        largest = max(largest, float(np.max(np.abs(vs.solve(moved, [50]).frame - here.frame))))
    one_number = largest / 1e-7 * 2**-53
    assert one_number / 10 < here.conditioning[0] < 20 * one_number


def test_an_umbilic_geodesic_typed_with_34_digits_says_where_it_is_another_one() -> None:
    """Rightly answered for exactly these digits, and O(1) off the umbilic one at s = 10⁴."""
    found = vs.solve(umbilic_geodesic(34), [1, 30, 10_000])
    assert found.conditioning[0] < 1e-31
    assert found.conditioning[1] < 1e-28
    assert found.conditioning[2] > 0.1
    assert found.error[2] < 1e-8
    typed_in_doubles = vs.solve(umbilic_geodesic(16), [1, 30])
    assert 1e-17 < typed_in_doubles.conditioning[0] < 1e-14


def test_on_a_separatrix_conditioning_grows_until_nothing_is_left() -> None:
    found = vs.solve(PENDULUM, [1, 10, 20, 30]).conditioning
    assert (np.diff(found) > 0).all()
    assert 1e-5 < found[3] < 1e-1


def test_systems_with_one_engine_have_the_floor() -> None:
    body = vs.EulerPoisson([1, 2, 3], [0, 0, 1], [1, 0.5, 0])
    found = vs.solve(body, [0, 10])
    assert (found.conditioning == body.conditioning_floor(found.times)).all()
