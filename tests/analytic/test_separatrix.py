"""On and beside a separatrix: what is lost stays lost, whatever other times are asked for."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest

import veselova as vs
from conftest import slow
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


def answered(problem: Any, time: float, engine: str | None = None) -> tuple[Any, float] | None:
    """Return the frame and its error at a time asked for alone, None where no digit is left."""
    try:
        found = vs.solve(problem, [time], engine)
    except vs.Unsolved as refusal:
        if refusal.outcome != "no-digit-left":
            raise
        return None
    return found.series(problem.bounded[-1])[0], float(found.error[0])


@pytest.mark.parametrize("time", [-600, 1000, 1e4])
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
    "problem", [PENDULUM, *map(slow, (umbilic(3, 1), umbilic(3, 2), umbilic(4, 1), umbilic(4, 2)))]
)
def test_a_separatrix_is_known_until_nothing_is(problem: Any) -> None:
    """What a start that is 1e-60 away makes of it is lost once, and stays lost."""
    assert vs.solve(problem, [0.25]).provenance.details["regime"] == "separatrix"
    for side in (1, -1):
        scale, lost = side / problem.turning, False
        for radians in (0.5, 7.0, 13.0, 20.0, 1500.0, 6000.0):
            alone = answered(problem, scale * radians)
            assert not (lost and alone), radians
            lost = alone is None
            if alone is not None and radians <= 13.0:
                assert alone[1] < 1e-9
                finer = vs.solve(problem, [scale * radians], digits=20)
                assert np.max(np.abs(finer.frame[0] - alone[0])) <= alone[1]
        assert lost


def test_the_refusal_says_what_answers() -> None:
    with pytest.raises(vs.Unsolved, match="doubles do not"):
        vs.solve(PENDULUM, [600])


@pytest.mark.parametrize("options", [{}, {"engine": "numeric"}, {"digits": 20}])
def test_umbilic_geodesics_say_that_their_data_are_badly_conditioned(options: Any) -> None:
    """Whatever the start on one, and for no other geodesic."""
    problem = umbilic_geodesic(34)
    later = vs.solve(problem, [0.7])
    middle = vs.EllipsoidGeodesic([3, 2, 1], later.X[0], later.X_dot[0], normalize=True)
    section = vs.EllipsoidGeodesic([3, 2, 1], [0, 0, 1], [1, 0, 0], normalize=True)
    other = vs.EllipsoidGeodesic([3, 2, 1], [0, 0, 1], [1, "1e-3", 0], normalize=True)
    spheroid = vs.EllipsoidGeodesic([3, 3, 1], [0, 0, 1], [1, "0.2", 0], normalize=True)
    cases = [(problem, True), (middle, True), (section, True), (other, False), (spheroid, False)]
    for geodesic, expected in cases:
        details = vs.solve(geodesic, [0.3], **options).provenance.details
        assert ("part exponentially" in details.get("badly_conditioned", "")) == expected


@pytest.mark.daily(4)
def test_a_few_times_at_an_umbilic_are_within_their_error() -> None:
    """Where sensitivities are looked at at these times alone."""
    problem = vs.Veselova(["1", "1/10", "1/26"], ["3/5", "0", "4/5"], ["4/5", "1", "-3/5"])
    for times in ([0, 3.5, 7, 10.5, 14], [10.5], [2, 6, 11, 12, 13]):
        motion = vs.solve(problem, times)
        digits = vs.solve(problem, times, digits=20, budget_s=600).frame
        assert np.all(np.max(np.abs(motion.frame - digits), axis=(1, 2)) <= motion.error)
