"""Balls in ℝⁿ whose inertia is given as a matrix: the same motion as along the principal axes,
turned by hand, and that of the ball itself.
"""

from __future__ import annotations

import itertools
import json
import subprocess
import sys
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import veselova as vs
from conftest import PATIENCE, Server, slow
from rolling_truth import roll_in_n_dimensions
from veselova import InvalidInput, Unsolved

SYSTEMS = {"rubber-ball": vs.RubberBall, "chaplygin-ball": vs.ChaplyginBall}
FORMS = ("special", "matrix", "bare")

#: Columns of length 3 and 1, determinant +1: rotations that a text states exactly.
THIRDS = np.array([[2, -2, 1, 0], [1, 2, 2, 0], [-2, -1, 2, 0], [0, 0, 0, 3]], dtype=object)


def pairs(n: int) -> list[tuple[int, int]]:
    return list(itertools.combinations(range(n), 2))


def coefficients(matrix: Any) -> Any:
    return [matrix[i, j] for i, j in pairs(len(matrix))]


def on_planes(R: Any) -> Any:
    """Return what a rotation does to the coefficients on E_i∧E_j."""
    places = pairs(len(R))
    return np.array([[R[i, k] * R[j, m] - R[i, m] * R[j, k] for k, m in places] for i, j in places])


def largest(values: Any) -> float:
    return float(np.max(np.abs(values)))


@dataclass(frozen=True)
class Turned:
    """along: the ball with the axes of A as body axes · across: the same in other axes, x = R
    along · R: orthogonal · inertia: of ``across``.
    """

    along: Any
    across: Any
    R: NDArray[np.float64]
    inertia: Any

    def require_same(self, times: Any, allowed: float = 0.0) -> None:
        """Require every series of ``across`` to be that of ``along``, turned."""
        one, other = vs.solve(self.along, times), vs.solve(self.across, times)
        R, planes = self.R, on_planes(self.R)
        room = np.max(one.error + other.error) + allowed
        size = 1 + self.along.turning
        assert largest(other.gamma - one.gamma @ R.T) <= room
        assert largest(other.frame - R @ one.frame) <= room
        assert largest(other.position - one.position) <= room
        assert largest(other.Omega - one.Omega @ planes.T) <= 1e-10 * size
        assert largest(other.velocity - one.velocity) <= 1e-10 * size
        assert largest(other.force - one.force) <= 1e-10 * (1 + largest(one.force))
        assert largest(other.momentum - one.momentum @ planes.T) <= 1e-10 * largest(one.momentum)
        for name in ("energy", "space_momentum"):
            before, after = (x.integrals[name] for x in (one, other))
            assert largest(after - before) <= 1e-12 * largest(before)


def drawn(seed: int, system: str) -> Turned:
    """Return a ball, every fourth with equal A's, and the same turned by a random matrix, every
    third of determinant −1.
    """
    rng = np.random.default_rng([36, seed])
    n = 4 + seed % 2
    A = rng.uniform(0.5, 1.5, n)
    if seed % 4 == 3:
        A[1] = A[2]
    R = np.linalg.qr(rng.normal(size=(n, n)))[0]
    if (np.linalg.det(R) < 0) != (seed % 3 == 0):
        R[:, 0] = -R[:, 0]
    E = np.linalg.qr(rng.normal(size=(n, n)))[0]
    v = rng.normal(size=n)
    W = np.outer(E[:, 0], v) - np.outer(v, E[:, 0])
    J = np.array([A[i] * A[j] for i, j in pairs(n)]) / np.prod(A)
    added = rng.uniform(0.1, 0.9) * np.min(J)
    rest = {"mass": added / 0.64, "radius": 0.8, "normalize": True}
    kind = SYSTEMS[system]
    along = kind({"special": A.tolist()}, gamma=E[:, 0], Omega=coefficients(W), frame=E, **rest)
    planes = on_planes(R)
    operator = planes @ np.diag(along.ball.operator) @ planes.T
    inertia = {
        "special": {"special": (R @ np.diag(A) @ R.T).tolist()},
        "matrix": {"matrix": operator.tolist()},
        "bare": operator,
    }[FORMS[seed % 3]]
    turning = {"gamma": R @ E[:, 0], "Omega": R @ W @ R.T, "frame": R @ E}
    return Turned(along, kind(inertia, **turning, **rest), R, operator)


# Twelve have every combination of dimension, form, equal A's, reflection and formulation.
@pytest.mark.parametrize("seed", [*range(12), *map(slow, range(12, 20))])
@pytest.mark.parametrize("system", SYSTEMS)
def test_a_turned_ball_moves_as_along_its_axes_and_as_integrated(seed: int, system: str) -> None:
    ball = drawn(seed, system)
    times = np.array([0.0, 0.3, 4.0, 20.0])
    ball.require_same(times)
    formulation = ball.across.formulations[seed % len(ball.across.formulations)]
    comparison = vs.compare(ball.across, times, formulation=formulation)
    assert comparison.agrees
    assert np.max(comparison.analytic.error) < 1e-10
    assert max(comparison.analytic.drift.values()) < 1e-12


@pytest.mark.parametrize("seed", [0, 1, 3])
@pytest.mark.parametrize("system", SYSTEMS)
def test_it_is_the_motion_of_the_ball_with_that_operator(seed: int, system: str) -> None:
    ball = drawn(seed, system)
    times = [0.0, 1.0, 5.0, 20.0]
    found = vs.solve(ball.across, times)
    true = roll_in_n_dimensions(ball.across, times, ball.inertia)
    for name in ("frame", "position"):
        assert largest(getattr(found, name) - getattr(true, name)) <= np.max(found.error) + 1e-11
    size = 1 + ball.across.turning
    assert largest(found.Omega - true.Omega) < 1e-10 * size
    assert largest(found.force - true.force) < 1e-10 * float(ball.across.ball.mass) * size**2


@pytest.mark.parametrize("system", SYSTEMS)
def test_drift_document_and_orbit_are_those_along_the_axes(system: str) -> None:
    ball = drawn(4, system)
    times = np.array([-3.0, 0.0, 1.0, 20.0, 400.0])
    found = vs.solve(ball.across, times)
    written = vs.ClosedForm.from_json(vs.closed_form(ball.across).to_json()).at(times)
    for name in ("gamma", "frame", "position"):
        apart = np.abs(getattr(written, name) - getattr(found, name)).reshape(len(times), -1)
        assert np.all(np.max(apart, axis=1) <= found.error + written.error)
    assert largest(written.Omega - found.Omega) < 1e-10
    speed = ball.along.drift.speed
    assert largest(ball.across.drift.velocity - ball.along.drift.velocity) < 1e-13 * speed
    one, other = vs.torus(ball.along), vs.torus(ball.across)
    assert np.allclose(one.frequencies_t, other.frequencies_t, rtol=1e-12)


def exact_ball(system: str, A: Any, gamma: Any, rate: Any, form: str, **changes: Any) -> Turned:
    """Return a ball along its axes, and turned by thirds, all in texts."""
    A, gamma, rate = (
        np.array([Fraction(x) for x in row], dtype=object) for row in (A, gamma, rate)
    )
    R = THIRDS / Fraction(3)
    W = np.outer(gamma, rate) - np.outer(rate, gamma)
    planes = on_planes(R)
    kind = SYSTEMS[system]
    rest = {"mass": "3/10", "radius": "4/5", "normalize": True, **changes}
    along = kind({"special": list(A)}, gamma=list(gamma), Omega=coefficients(W), **rest)
    operator = planes @ np.diag(along.ball.moments) @ planes.T
    inertia = {
        "special": {"special": R @ np.diag(A) @ R.T},
        "matrix": {"matrix": operator},
    }[form]
    texts: Any = {name: x.astype(str).tolist() for name, x in inertia.items()}
    turned = (R @ W @ R.T).astype(str).tolist()
    start = {"gamma": (R @ gamma).astype(str).tolist(), "Omega": turned}
    return Turned(along, kind(texts, **start, **rest), R.astype(float), operator)


GAMMA = ["1/2", "1/10", "1/2", "7/10"]
RATE = ["1.1", "-0.7", "0.3", "-0.9"]


@pytest.mark.parametrize("form", ["special", "matrix"])
@pytest.mark.parametrize("system", SYSTEMS)
@pytest.mark.parametrize(
    ("A", "gamma", "rate"),
    [
        (["1.6", "1.2", "0.9", "0.5"], GAMMA, RATE),
        (["1.6", "1.2", "1.2", "0.5"], GAMMA, RATE),
        (["1.6", "1.6", "0.5", "0.5"], GAMMA, RATE),
        (["1", "1", "1", "1"], GAMMA, RATE),
        (["1.6", "1.2000000001", "1.2", "0.5"], GAMMA, RATE),
        (["1.6", "1.2", "0.9", "0.5"], ["1/2", 0, "1/2", "7/10"], [1, 0, "0.3", -1]),
        (["1.6", "1.2", "0.9", "0.5"], ["3/5", 0, "4/5", 0], [4, 0, -3, 0]),
    ],
    ids=["generic", "two", "two-pairs", "isotropic", "nearly-equal", "frozen", "twice-frozen"],
)
def test_texts_are_turned_without_rounding(
    A: Any, gamma: Any, rate: Any, system: str, form: str
) -> None:
    """The same A's and exact zeros: the motions differ by evaluation alone, at far times too."""
    ball = exact_ball(system, A, gamma, rate, form)
    scales = [sorted(x / max(b.ball.A) for x in b.ball.A) for b in (ball.along, ball.across)]
    assert all(abs(x - y) < Fraction(1, 2**250) for x, y in zip(*scales, strict=True))
    assert vs.torus(ball.along).regime == vs.torus(ball.across).regime
    planes = on_planes(ball.R)
    for times in ([0.0, 1.0, 20.0], [1e6]):
        one, other = vs.solve(ball.along, times), vs.solve(ball.across, times)
        room = one.error[-1] + other.error[-1]
        assert largest(other.gamma - one.gamma @ ball.R.T) <= room
        assert largest(other.Omega - one.Omega @ planes.T) <= 1e2 * room
    assert np.allclose(np.linalg.det(other.frame), 1, rtol=1e-12)


@pytest.mark.parametrize("time", [0.1, 6.0, 20.0, 400.0])
def test_a_separatrix_is_one_in_any_axes(time: float) -> None:
    """That of an umbilic in the plane of three axes: its texts tell, and 2^−256 does not."""
    A = ["1", "1/10", "1/20", "1/26"]
    at = exact_ball("rubber-ball", A, ["3/5", 0, 0, "4/5"], ["4/5", 1, 0, "-3/5"], "special")
    for ball in (at.along, at.across):
        with pytest.raises(Unsolved, match="separatrix"):
            _ = ball.drift
        with pytest.raises(Unsolved, match="separatrix"):
            vs.closed_form(ball)
        if time == 400:
            with pytest.raises(Unsolved, match="no-digit-left") as refusal:
                vs.solve(ball, [time])
            assert "more digits" not in str(refusal.value)  # a path in ℝⁿ has none
    if time < 400:
        one, other = (vs.solve(ball, [time]) for ball in (at.along, at.across))
        assert other.provenance.details["regime"] == "separatrix"
        assert largest(other.gamma - one.gamma @ at.R.T) <= one.error[0]
        assert other.error[0] < 1e-4


def test_a_body_off_its_axes_starts_on_a_separatrix_too() -> None:
    R = THIRDS[:3, :3] / Fraction(3)
    q, rate = (
        np.array([Fraction(x) for x in row]) for row in (["3/5", 0, "4/5"], ["4/5", 1, "-3/5"])
    )
    A = R @ np.diag([Fraction(1), Fraction(1, 10), Fraction(1, 26)]) @ R.T
    body = vs.Veselova(A.tolist(), (R @ q).tolist(), (R @ rate).tolist())
    assert vs.solve(body, [20.0]).error[0] < 1e-10
    with pytest.raises(Unsolved, match="no-digit-left"):
        vs.solve(body, [2000.0])


def test_a_turned_ball_may_rest() -> None:
    for system in SYSTEMS:
        at = exact_ball(system, ["1.6", "1.2", "0.9", "0.5"], GAMMA, [0, 0, 0, 0], "special")
        assert not at.across.moves
        assert np.array_equal(vs.solve(at.across, [5.0]).gamma[0], at.across.gamma)


GENERIC: dict[str, Any] = {
    "mass": 0.3,
    "radius": 0.8,
    "gamma": [1, 0, 0, 0],
    "Omega": [0.1, 0.2, 0.3, 0, 0, 0],
}
NOT_SPECIAL = np.diag([1.0, 1.1, 1.2, 1.3, 1.4, 1.5])
NOT_SPECIAL[0, 1] = NOT_SPECIAL[1, 0] = 0.01
UNEVEN = 2 * np.eye(4)
UNEVEN[0, 1] = 1.0

FAULTS: list[tuple[Any, str, str]] = [
    ({"matrix": NOT_SPECIAL.tolist()}, "inertia.matrix", "special operator"),
    (NOT_SPECIAL.tolist(), "inertia:", "special operator"),
    ({"matrix": (NOT_SPECIAL - 2 * np.eye(6)).tolist()}, "inertia.matrix", "positive definite"),
    ({"matrix": [[1, 2], [3]]}, "inertia.matrix", "6 × 6"),
    ({"matrix": 3}, "inertia.matrix", "6 × 6"),
    ([[1, 2], [2, 1]], "inertia:", "6 × 6"),
    ({"special": np.eye(3).tolist()}, "inertia.special", "4 × 4"),
    ({"special": (-np.eye(4)).tolist()}, "inertia.special", "positive"),
    ({"special": UNEVEN.tolist()}, "inertia.special[0][1]", "symmetric"),
    ({"special": [[1, 0, 0, "x"], *np.eye(4)[1:].tolist()]}, "inertia.special[0][3]", "number"),
    ({"special": (9 * np.eye(4) + 1).tolist()}, "inertia.special", "above ma²"),
]


@pytest.mark.parametrize("system", SYSTEMS)
@pytest.mark.parametrize(("inertia", "field", "part"), FAULTS)
def test_bad_matrices_are_refused_by_name(inertia: Any, field: str, part: str, system: str) -> None:
    with pytest.raises(InvalidInput) as refusal:
        SYSTEMS[system](inertia, **GENERIC)
    assert str(refusal.value).startswith(field)
    assert part in str(refusal.value)


def test_the_defect_of_a_turned_operator_is_named() -> None:
    ball = drawn(1, "rubber-ball")
    for size in (1e-6, 1e-12):
        operator = ball.inertia.copy()
        operator[0, 7] += size
        operator[7, 0] += size
        given = {**ball.across.given, "inertia": operator.tolist()}
        if size < 1e-9:
            assert largest(vs.RubberBall(**given).Omega - ball.across.Omega) < 1e-10
            continue
        with pytest.raises(InvalidInput, match="off by"):
            vs.RubberBall(**given)


def test_operators_off_the_axes_have_a_largest_dimension() -> None:
    n = 17
    matrix = np.eye(n * (n - 1) // 2) + 0.1
    with pytest.raises(InvalidInput, match="n ≤ 16"):
        vs.RubberBall(matrix, 1, 1, np.eye(n)[0], np.zeros(n * (n - 1) // 2))


@pytest.mark.parametrize("system", SYSTEMS)
def test_matrices_pass_every_door(system: str, server: Server, tmp_path: Path) -> None:
    times = [0.0, 1.0, 5.0]
    for seed in (0, 1, 2):
        ball = drawn(2 * seed, system).across
        document = ball.as_request()
        expected = vs.solve(ball, times)
        ask = {"problem": document, "times": times}
        answer = server.ask("POST", "/v1/trajectories", json=ask).json()
        for name in ball.outputs:
            assert np.allclose(answer["series"][name], expected.series(name), rtol=0, atol=1e-11)
        with vs.Client(server.url) as client:
            found = client.trajectory(ball, times)
            assert np.array_equal(found.position, expected.position)
    file = tmp_path / "ball.json"
    file.write_text(json.dumps(ask))
    command = [sys.executable, "-m", "veselova", "solve", str(file), "--json"]
    printed = subprocess.run(command, capture_output=True, check=True, timeout=PATIENCE)
    assert json.loads(printed.stdout)["series"]["Omega"][2] == expected.Omega[2].tolist()
    table = vs.sweep(
        drawn(0, system).across.as_request(),
        {"/mass": [0.01, 0.02]},
        times=times,
        workers=1,
        folder=tmp_path,
    )
    assert set(table["outcome"].values.tolist()) == {"solved"}
