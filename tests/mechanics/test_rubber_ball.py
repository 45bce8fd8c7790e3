"""The ball that neither slips nor twists: against its own equations, far out, in resonance, at
every door.
"""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
import test_chaplygin_ball
from scipy.optimize import brentq

import veselova as vs
from conftest import command_line, slow
from deviations import largest
from lr_draws import random_operator
from rolling_truth import roll
from veselova import RubberBall, Unsolved
from veselova.service.api.json_documents import torus_of

TIMES = np.linspace(0, 20, 9)
DATA = test_chaplygin_ball.DATA | {"Omega": [0.8, 1, -0.6]}


def ball(rng: np.random.Generator, **changes: Any) -> RubberBall:
    """Return a random ball that does not twist."""
    gamma, velocity = rng.normal(size=(2, 3))
    data = {
        "inertia": rng.uniform(1, 2, size=3).tolist(),
        "mass": rng.uniform(0.2, 2),
        "radius": rng.uniform(0.2, 2),
        "gamma": gamma,
        "Omega": np.cross(gamma, velocity),
        "position": rng.normal(size=2).tolist(),
        "normalize": True,
    }
    return RubberBall(**{**data, **changes})


@pytest.mark.parametrize("seed", [0, 1, slow(2), slow(3)])
@pytest.mark.daily(3)
@pytest.mark.parametrize("inertia", [None, [1, 1, 1.5], [1, 1.5, 1.5], [1, 1, 1], "tensor"])
def test_all_ways_roll_as_the_ball_itself_does(seed: int, inertia: Any) -> None:
    rng = np.random.default_rng(seed)
    if inertia == "tensor":
        inertia = random_operator(rng, 3, 2.0)
    problem = ball(rng, **({} if inertia is None else {"inertia": inertia}))
    true = roll(problem, TIMES)
    ways = [("analytic", None), *(("numeric", f) for f in RubberBall.formulations)]
    for engine, formulation in ways:
        found = vs.solve(problem, TIMES, engine, formulation=formulation)
        for name, least in (("frame", 1e-11), ("position", 1e-11), ("velocity", 5e-11)):
            assert largest(getattr(found, name) - getattr(true, name)) < least, (name, formulation)
        assert largest(found.force - true.force) < 1e-10
        assert np.all(found.error < 1e-8)


def test_on_a_separatrix_the_path_is_known_as_far_as_the_attitude() -> None:
    problem = RubberBall(
        ["1/2", "19/2", "51/2"], "1/2", 1, ["3/5", 0, "4/5"], ["4/5", -1, "-3/5"], strict=False
    )
    times = np.linspace(0, 6, 7)
    found, true = vs.solve(problem, times), roll(problem, times)
    assert found.provenance.details["regime"] == "separatrix"
    off = np.max(np.abs(found.position - true.position), axis=1)
    assert np.all(off <= found.error + 1e-12)
    with pytest.raises(Unsolved, match="separatrix"):
        _ = problem.drift


def test_along_the_momentum_the_ball_moves_uniformly_and_across_it_hardly() -> None:
    problem = RubberBall(**DATA)
    times = np.linspace(0, 4000, 1500)
    found = vs.solve(problem, times)
    momentum = found.integrals["space_momentum"][0]
    along = np.cross(momentum, [1, 0, 0])[1:] / np.linalg.norm(momentum[1:])
    energy = found.integrals["energy"][0]
    speed = 0.6 * 2 * energy / np.linalg.norm(momentum[1:])
    assert largest(found.position @ along - speed * times) < 1e-13 * 4000 * speed
    across = found.position @ [-along[1], along[0]]
    assert largest(across) < 0.6
    assert np.allclose(problem.drift.velocity, speed * along, rtol=1e-14, atol=1e-15)
    assert problem.drift.resonance is None


def resonant(seed: int, ratio: float, low: float) -> RubberBall:
    """Return the ball with f_1/f_2 of this ratio among the starts of a seed, of which one has an
    angle a little above ``low``.
    """
    rng = np.random.default_rng(seed)
    gamma = rng.normal(size=3)
    gamma /= np.linalg.norm(gamma)
    first, second = np.linalg.qr(np.column_stack([gamma, rng.normal(size=(3, 2))]))[0][:, 1:].T

    def at(angle: float) -> RubberBall:
        Omega = math.cos(angle) * first + math.sin(angle) * second
        return RubberBall([0.8, 1.2, 2.1], 0.3, 0.5, gamma, Omega, strict=False, normalize=True)

    def excess(angle: float) -> float:
        f = vs.torus(at(angle)).frequencies_tau1
        return float(f[0] / f[1]) - ratio

    return at(float(brentq(excess, low, low + 0.1358, xtol=1e-16, rtol=1e-15)))


def period(problem: RubberBall, turns: int) -> float:
    """Return the time that the slower phase of a resonant torus takes for so many turns."""
    torus = vs.torus(problem)
    tau1 = turns / torus.frequencies_tau1[1]
    point = problem.rank_one()
    time = tau1 * torus.mean_rate
    for _ in range(4):
        late, later = vs.solve(point, [time, time * (1 + 1e-6)]).tau1
        time += (tau1 - late) * time * 1e-6 / (later - late)
    return float(time)


#: p, q, whether c_2 lies on cut 2, the seed and the angle of a torus with f_1/f_2 = p/q.
TORI = [
    *((3, 4, True, *at) for at in ((1, 1.0958), (1, 2.5887), (2, 1.2315))),
    *((5, 6, True, *at) for at in ((1, 0.8243), (2, 2.5887), (3, 2.9959))),
    *((7, 8, True, *at) for at in ((0, 0.1457), (0, 2.8601), (6, 0.5529))),
    (9, 10, True, 4, 1.5029),
    *((4, 5, False, *at) for at in ((0, 0.96), (0, 2.0458), (1, 0.01), (1, 0.5529))),
    *((6, 7, False, *at) for at in ((0, 0.5529), (0, 2.453), (2, 0.5529))),
    *((8, 9, False, *at) for at in ((0, 0.4172), (2, 0.5529), (4, 0.96))),
    *((4, 5, True, 1, 0.8243), (6, 7, True, 3, 2.9959)),
    *((5, 6, False, 0, 0.6886), (7, 8, False, 0, 0.4172)),
]


@pytest.mark.parametrize(("p", "q", "upper", "seed", "low"), TORI)
def test_in_resonance_the_ball_drifts_across_as_predicted(
    p: int, q: int, upper: bool, seed: int, low: float
) -> None:
    """On a resonant torus the motion is periodic up to the drift, which one period measures: across
    for even q where c_2 lies on cut 2, for even p where it lies on cut 1.
    """
    problem = resonant(seed, p / q, low)
    assert (vs.torus(problem).origins.index("c2") > 2) == upper
    time = period(problem, 2 * q)
    motion = vs.solve(problem, [0.0, time])
    assert largest(motion.frame[1] - motion.frame[0]) < 1e-9
    measured = (motion.position[1] - motion.position[0]) / time
    assert largest(measured - problem.drift.velocity) < 1e-9
    assert (problem.drift.resonance is not None) == ((q if upper else p) % 2 == 0)


def test_the_torus_has_the_drift() -> None:
    drifts = resonant(1, 3 / 4, 1.0958)
    torus = vs.torus(drifts)
    assert torus.drift is not None
    assert torus.drift.resonance == drifts.drift.resonance != None  # noqa: E711
    assert torus_of(json.loads(json.dumps(torus.as_dict()))).as_dict() == torus.as_dict()
    asked = {"problem": RubberBall(**DATA).as_request(), "times": [0, 3]}
    shown = [command_line(command, "-", stdin=asked).stdout for command in ("torus", "solve")]
    assert "drift" in shown[0]
    assert f"{RubberBall(**DATA).drift.velocity[1]: .12g}" in shown[0]
    assert "position_1" in shown[1]
    assert f"{vs.solve(RubberBall(**DATA), [3]).position[0, 1]: .9f}" in shown[1]
    # a body does not roll, a separatrix has no mean over all times
    assert vs.torus(vs.VeselovaSO3([1, 1.5, 2], DATA["gamma"], DATA["Omega"])).drift is None
