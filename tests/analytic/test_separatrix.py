"""On and beside a separatrix: what is lost stays lost, whatever other times are asked for; and what
the data determine.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest

import veselova as vs
from conftest import slow
from draws import _umbilic
from veselova.conditioning import perturb_by_roundings

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


def answered(problem: Any, time: float, engine: str | None = None) -> tuple[Any, float] | None:
    """Return the frame and its error at a time asked for alone, None where no digit is left."""
    try:
        found = vs.solve(problem, [time], engine)
    except vs.Unsolved as refusal:
        if refusal.outcome != "no-digit-left":
            raise
        return None
    return found.series(problem.bounded[-1])[0], float(found.error[0])


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
    "problem", [PENDULUM, umbilic(3, 1), slow(umbilic(3, 2)), umbilic(4, 1), slow(umbilic(4, 2))]
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


OMEGA = [[0, 1, 0.5, 0.2], [-1, 0, 0.1, 0.3], [-0.5, -0.1, 0, 0.4], [-0.2, -0.3, -0.4, 0]]


@pytest.mark.parametrize("omega", [OMEGA, [1, 0.5, 0.2, 0.1, 0.3, 0.4]])
@pytest.mark.parametrize(
    "inertia",
    [
        {"special": [1, 1.2, 1.5, 2]},
        {"special": [[1, 0.1, 0, 0], [0.1, 1.2, 0, 0], [0, 0, 1.5, 0], [0, 0, 0, 2]]},
    ],
)
@pytest.mark.parametrize("ball", [vs.RubberBall, vs.ChaplyginBall])
def test_conditioning_knows_data_of_every_form(ball: Any, inertia: Any, omega: Any) -> None:
    """Mappings, symmetric matrices, and skew ones."""
    problem = ball(inertia, 0.1, 0.5, [0.5] * 4, omega, normalize=True)
    one = vs.solve(problem, [0, 1, 100])
    assert 5 * one.conditioning[1] < one.conditioning[2] < 100 * one.error[2]
    given = dict(problem.given)
    numbers = [0.1, 0.5, *given["gamma"]]
    for multiple, pattern in ((1, 0), (10**6, 1)):
        moved = perturb_by_roundings(problem, multiple, pattern)
        there = [float(Fraction(x)) for x in (moved.given["mass"], moved.given["radius"])]
        there += [float(Fraction(x)) for x in moved.given["gamma"]]
        assert 0 < np.max(np.abs(np.subtract(there, numbers))) < multiple * 2e-16
        assert np.max(np.abs(moved.Omega - problem.Omega)) < multiple * 1e-14


def test_conditioning_counts_the_potential() -> None:
    """A rounding of it turns the phases of a fast motion by as much as all other data."""
    data = (["3", "2", "1"], [0, "0.6", "0.8"], [0, "0.8", "-0.6"])
    problem, moved = (
        vs.SeparableVeselova(*data, {"quadratic": alpha}) for alpha in (1e4, 1e4 * (1 + 2**-30))
    )
    found = vs.solve(problem, [1.0])
    apart = np.max(np.abs(vs.solve(moved, [1.0]).q - found.q)) * 2**-23
    assert 0.5 * apart < found.conditioning[0] < 20 * apart
    # zero stays, and a plane without a wall has none
    assert perturb_by_roundings(problem, 1, 0).given["potential"].keys() == {"quadratic"}
    body = vs.VeselovaSO3([1, 2, 3], [0.6, 0, 0.8], [0, 1, 0], {"family": [0.5, 0.1, 0, 0, 0]})
    assert perturb_by_roundings(body, 1, 0).given["potential"]["family"][2:] == ["0", "0", "0"]


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


SEPARABLE_PENDULUM = vs.SeparableVeselova(["1", "1/2"], [1, 0], [0, 1], {"quadratic": "1/2"})


@pytest.mark.parametrize("problem", [PENDULUM, SEPARABLE_PENDULUM, umbilic(3, 2)])
def test_integration_refuses_far_times_on_a_separatrix_as_the_closed_form_does(
    problem: Any,
) -> None:
    """Two runs that dwell at one equilibrium agree, and know nothing of the motion."""
    scale = 1 / problem.turning
    lost = False
    for radians in (2.0, 10.0, 20.0, 45.0, 90.0, 150.0):
        alone = answered(problem, scale * radians, "numeric")
        assert not (lost and alone), radians
        lost = alone is None
        assert lost or alone[1] <= 0.1
    assert lost
    with pytest.raises(vs.Unsolved, match="no-digit-left"):
        vs.solve(problem, [scale, scale * 150], "numeric")


def test_integration_of_the_pendulum_is_tanh_within_its_error() -> None:
    times = [-20.0, -3.0, 0.0, 1.0, 10.0, 20.0]
    found = vs.solve(PENDULUM, times, "numeric")
    assert (np.abs(found.q[:, 1] - np.tanh(times)) <= found.error).all()


@pytest.mark.parametrize(
    ("problem", "span"),
    [(PENDULUM, 30.0), (SEPARABLE_PENDULUM, 20.0), (umbilic_geodesic(34), 3e4)],
    ids=["neumann", "separable", "umbilic"],
)
def test_conditioning_never_falls_and_knows_no_other_time(problem: Any, span: float) -> None:
    """Neighbours of a start on a separatrix dwell at one equilibrium again and again."""
    digits = {} if problem is SEPARABLE_PENDULUM else {"digits": 30}
    engine = "numeric" if problem is SEPARABLE_PENDULUM else None
    times = np.linspace(0, span, 13) if engine or problem is PENDULUM else np.geomspace(1, span, 9)
    options: Any = {"engine": engine, **(digits if problem is PENDULUM else {})}
    together = vs.solve(problem, times, **options).conditioning
    assert (np.diff(together) >= 0).all()
    for i in (0, 4, len(times) - 1):
        assert vs.solve(problem, [times[i]], **options).conditioning[0] == together[i]


def test_conditioning_stays_lost_where_digits_serve() -> None:
    """With 30 digits the exact pendulum is answered at any time; doubles say nothing of it."""
    found = vs.solve(PENDULUM, [-60, 30, 50, 100, 120], digits=30)
    assert found.error.max() < 1e-15
    assert (found.conditioning[[0, 2, 3, 4]] >= 0.1).all()
    assert 1e-5 < found.conditioning[1] < 1e-2


def test_conditioning_is_that_of_the_problem_and_no_engine() -> None:
    times = [0.5, 20]
    by_engine = [vs.solve(PENDULUM, times, e).conditioning for e in ("analytic", "numeric")]
    assert np.array_equal(*by_engine)


def test_conditioning_is_known_before_a_collision() -> None:
    body = vs.VeselovaSO3(["1", "2", "3"], [0.6, 0, 0.8], [0, 1, 0], {"family": [0, 0, -0.3, 0, 0]})
    with pytest.raises(vs.Unsolved, match="collision") as refusal:
        vs.solve(body, [1e3])
    end = float(str(refusal.value).split("t = ")[1].split(",")[0])
    found = vs.solve(body, [0.1 * end, 0.9 * end, 0.999 * end]).conditioning
    assert 0 < found[0] <= found[1] <= found[2] < 1e-8


def test_lost_digits_are_counted_against_the_size_of_an_ellipsoid() -> None:
    """X of 10¹⁵ with an error of 10³ has twelve digits; an error of 0.1 is not the end of them."""
    large, small = (
        vs.EllipsoidGeodesic(
            [3 * scale, 2 * scale, scale],
            [0.6 * (3 * scale) ** 0.5, 0, 0.8 * scale**0.5],
            [0, 1, 0],
        )
        for scale in (1e30, 1.0)
    )
    for engine in ("analytic", "numeric"):
        there, here = vs.solve(large, [0, 1e15], engine), vs.solve(small, [0, 1], engine)
        assert (
            np.max(np.abs(there.X / 1e15 - here.X)) <= 1e-15 * np.max(there.error) + here.error[1]
        )
        assert np.max(there.error) < 1e-10 * 1e15
