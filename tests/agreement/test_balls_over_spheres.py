"""Balls over spheres against the balls themselves, integrated in space with their contact forces,
and the shell around a sphere of half its radius against integration in 80 bits.
"""

from __future__ import annotations

import json
from types import SimpleNamespace
from typing import Any

import jsonschema_rs
import numpy as np
import pytest

import veselova as vs
from conftest import slow
from deviations import agree, apart
from rolling_truth import roll_over_sphere, roll_over_sphere_in_80_bits
from veselova.mechanics.core.errors import InvalidInput, Unsolved
from veselova.mechanics.results.closed_form_schema import SCHEMA

SERIES = ("gamma", "frame", "position")


def _ball(n: int, seed: int, side: str = "around", radius: float = 0.6, sphere: float = 0.3) -> Any:
    """Return a random ball; in space every other one along other axes than its principal ones."""
    rng = np.random.default_rng([n, seed])
    gamma, v = rng.normal(size=(2, n))
    gamma /= np.linalg.norm(gamma)
    v -= gamma * (v @ gamma)
    v /= np.linalg.norm(v)
    inertia: Any
    if n == 3:
        a, b, c = rng.uniform(0.1, 1.0, 3)
        inertia, Omega = np.diag([b + c, a + c, a + b]), np.cross(v, gamma)
        if seed % 2:
            axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
            inertia = axes @ inertia @ axes.T
    else:
        inertia = {"special": np.sort(rng.uniform(0.5, 1.2, n))[::-1].tolist()}
        Omega = np.outer(gamma, v) - np.outer(v, gamma)
    mass = rng.uniform(0.05, 1.0) if n == 3 else 0.1
    where: dict[str, Any] = {"sphere": sphere, "side": side, "normalize": True}
    return vs.RubberBall(inertia, mass, radius, gamma, Omega, **where)


def _around(inertia: Any, gamma: Any, Omega: Any) -> Any:
    """Return the shell around a sphere of half its radius."""
    return vs.RubberBall(inertia, 0.5, 0.6, gamma, Omega, sphere=0.3, side="around")


def _off(motion: Any, truth: Any) -> Any:
    """Return the largest difference of γ, frame and contact point at each time."""
    return apart(motion, SimpleNamespace(**dict(zip(SERIES, truth, strict=True))), SERIES)


@pytest.mark.daily(4)
@pytest.mark.parametrize(
    ("n", "side", "sphere"),
    [
        (3, "outside", 0.8),
        (3, "inside", 1.3),
        (3, "around", 0.4),
        (4, "outside", 1.2),
        (5, "inside", 1.5),
        *((n, "around", 0.3) for n in (3, 4, 5)),
    ],
)
def test_the_motion_is_that_of_the_ball_itself(n: int, side: str, sphere: float) -> None:
    ball, times = _ball(n, 1, side, sphere=sphere), [0.0, 1.0, 5.0, 12.0]
    truth = roll_over_sphere(ball, times)
    for engine in ("numeric", "analytic") if sphere == 0.3 else ("numeric",):
        motion = vs.solve(ball, times, engine)
        assert motion.provenance.engine == engine
        assert np.all(_off(motion, truth) <= motion.error + 1e-10)
        assert motion.drift["energy"] < 1e-13


@pytest.mark.daily(3)
@pytest.mark.parametrize(
    ("n", "seeds"),
    [(3, range(3)), slow(3, range(3, 300)), slow(4, range(100)), slow(5, range(100))],
)
def test_no_true_error_is_above_the_reported_one(n: int, seeds: range) -> None:
    times, useful = [1.0, 10.0, 100.0] + [1000.0] * (n == 3), []
    for seed in seeds:
        ball = _ball(n, seed)
        try:
            motion = vs.solve(ball, times)
        except Unsolved as refusal:
            if (refusal.outcome, n) != ("too-far", 5):
                raise
            continue
        truth = roll_over_sphere_in_80_bits(ball, times)
        off = _off(motion, truth)
        assert np.all(off <= motion.error), seed
        assert np.all(motion.error < 1e-10)
        useful.append(off / motion.error)
        if n == 3 and seed < 110:  # each takes seconds
            document = vs.closed_form(ball).at(times)
            assert np.all(_off(document, truth) <= document.error), seed
    assert len(useful) >= len(seeds) / 2
    assert np.median(useful) > 0.01


@pytest.mark.daily(4)
@pytest.mark.parametrize("time", [20_000.0, slow(1_000_000.0)])
def test_far_times_are_within_their_error(time: float) -> None:
    """The truth at 1.2e5 is within 7e-13 of an integration in 113 bits."""
    ball = _ball(3, 4)
    motion = vs.solve(ball, [time])
    assert _off(motion, roll_over_sphere_in_80_bits(ball, [time])) <= motion.error
    assert motion.error[0] < 1e-15 * time + 1e-8


def test_jumps_and_steps_along_the_orbit_agree() -> None:
    ball = _ball(3, 5)
    times = [-40.0, 0.0, 31.0, 250.0]
    near, far = vs.solve(ball, times), vs.solve(ball, [*times, 1e5])
    assert np.all(np.abs(near.frame - far.frame[:4]) <= near.error[:, None, None])


#: Of one phase, and one whose frame does not turn as a whole.
SPECIAL = {
    "with an axis": _around([0.4, 0.4, 0.7], [0.6, 0, 0.8], [0.8, 1, -0.6]),
    "symmetric": _around([0.7, 0.7, 0.7], [0.6, 0, 0.8], [0.8, 1, -0.6]),
    "in a plane": _around([0.4, 0.6, 0.9], [0, 0.6, 0.8], [1, 0, 0]),
}


@pytest.mark.parametrize("ball", SPECIAL.values(), ids=SPECIAL)
def test_symmetric_bodies_and_motions_in_a_plane(ball: Any) -> None:
    times = [-3.0, 1.0, 20.0]
    agree(vs.solve(ball, times), vs.solve(ball, times, engine="numeric"), *SERIES)


def test_a_ball_at_rest_stays() -> None:
    ball = _around([0.4, 0.6, 0.9], [0.6, 0, 0.8], [0, 0, 0])
    assert np.max(np.abs(vs.solve(ball, [5.0]).gamma - [[0.6, 0, 0.8]])) < 1e-15
    with pytest.raises(Unsolved, match="at-rest"):
        vs.torus(ball)


def test_times_without_a_digit_are_refused_by_name() -> None:
    with pytest.raises(Unsolved, match="no-digit-left"):
        vs.solve(_ball(3, 2), [1e300])


def test_contact_paths_have_the_same_length_and_nothing_twists() -> None:
    ball = _ball(3, 2)
    step = 1e-4
    motion = vs.solve(ball, [3 - step, 3, 3 + step])
    on_ball = np.linalg.norm(motion.gamma[2] - motion.gamma[0]) * 0.6
    on_sphere = np.linalg.norm(motion.position[2] - motion.position[0])
    assert on_ball == pytest.approx(on_sphere, rel=1e-7)
    assert np.max(np.abs(np.sum(motion.Omega * motion.gamma, axis=1))) < 1e-14


def test_other_ratios_are_integrated_and_have_no_closed_form() -> None:
    ball = _ball(3, 1, "outside")
    assert vs.solve(ball, [1.0]).provenance.engine == "numeric"
    for ask in (lambda x: vs.solve(x, [1.0], engine="analytic"), vs.closed_form, vs.torus):
        with pytest.raises(Unsolved, match="half its radius"):
            ask(ball)


DOCUMENTED = {"principal axes": _ball(3, 0), "other axes": _ball(3, 1), **SPECIAL}


@pytest.mark.daily(3)
@pytest.mark.parametrize("name", DOCUMENTED)
def test_documents_are_the_motion(name: str) -> None:
    ball, times = DOCUMENTED[name], [-250.0, 0.0, 0.7, 100.0, 1000.0, 1e6]
    document = json.loads(vs.closed_form(ball).to_json())
    jsonschema_rs.validator_for(SCHEMA).validate(document)
    with pytest.raises(InvalidInput, match=r"document\.axes"):
        vs.ClosedForm(document | {"axes": None})
    assert document["format"] == "veselova.closed-form/3"
    found, motion = vs.ClosedForm(document).at(times), vs.solve(ball, times)
    off = apart(found, motion, SERIES)
    assert np.all(off <= found.error + motion.error)
    assert np.all(off <= 2e-12 * np.maximum(1, np.abs(times) / 1000))
    assert np.max(np.abs(found.Omega[:-1] - motion.Omega[:-1])) < 1e-11
    assert np.all(found.error < 3e-12 + 3e-14 * np.abs(times))


def test_documents_keep_their_accuracy_at_any_speed() -> None:
    ball = vs.RubberBall(
        [0.4, 0.5, 0.6], 0.5, 0.6, [0.6, 0, 0.8], [8e5, 1e6, -6e5], sphere=0.3, side="around"
    )
    times = np.linspace(0, 1e-5, 7)
    found, motion = vs.closed_form(ball).at(times), vs.solve(ball, times)
    off = _off(motion, [found.series[name] for name in SERIES])
    assert np.all(off <= found.error + motion.error)


def test_digits_and_some_documents_are_refused_by_name() -> None:
    with pytest.raises(InvalidInput, match="over a sphere"):
        vs.solve(_ball(3, 1), ["1"], digits=30)
    with pytest.raises(Unsolved, match=r"too-many-modes: .*solve at times"):
        vs.closed_form(_ball(4, 1))


def test_balls_without_closed_form_say_so() -> None:
    """A radius that is twice that of the sphere but for its rounding is none of ε = −1."""
    ball = _ball(3, 1, "around", radius=0.6000000001)
    provenance = vs.solve(ball, [1.0]).provenance
    assert provenance.engine == "numeric"
    why = provenance.details["without_closed_form"]
    assert "half its radius exactly, here ε + 1 = 3.33e-10" in why
    with pytest.raises(Unsolved, match="no other formulation to compare with"):
        vs.compare(ball, [1.0])
    assert vs.compare(_ball(3, 1), [1.0, 20.0]).agrees


def test_the_torus_has_the_frequencies_of_the_ball() -> None:
    ball = SPECIAL["in a plane"]
    torus = vs.torus(ball)
    assert torus.energy == pytest.approx(ball.integrals(ball.start)["energy"][0])
    [frequency] = torus.frequencies_t
    # γ stays in a plane, and has period 2 in its one phase
    first, turned = vs.solve(ball, [1.0, 1.0 + 2 / frequency]).gamma
    assert np.max(np.abs(first - turned)) < 1e-13
