"""Series by name, files that are read again, data frames, and the attitude as rotations."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import veselova as vs
from refusals import GOOD
from veselova import InvalidInput, Trajectory, solve
from veselova.mechanics.systems.catalogue import class_of

START: Any = [0.6, 0.0, 0.8], [0.8, 1.0, -0.6]
PROBLEMS: dict[str, Any] = {name: class_of(name)(**fields) for name, fields in GOOD.items()}


@pytest.fixture(scope="module")
def motion() -> Trajectory:
    return solve(vs.Veselova([3, 2, 1], *START), np.linspace(-30, 30, 400))


def test_series_are_found_by_name_as_in_a_dictionary(motion: Trajectory) -> None:
    assert motion["q"] is motion.q
    assert dict(motion).keys() == motion.problem.outputs.keys() == set(motion)
    assert "frame" in motion
    assert not [name for name in ("gamma", ["q"], np.zeros(3)) if name in motion]
    with pytest.raises(InvalidInput, match="required one of q, q_dot"):
        motion["qq"]


@pytest.mark.parametrize("system", sorted(PROBLEMS))
def test_files_say_all_that_makes_the_motion_again(system: str, tmp_path: Path) -> None:
    found = solve(PROBLEMS[system], [0.5, "1/3", -1])
    found.to_npz(tmp_path / "motion")
    again = Trajectory.from_npz(tmp_path / "motion")
    assert again.problem.as_dict() == found.problem.as_dict()
    assert again.provenance == found.provenance
    for name, values in found.columns().items():
        assert np.array_equal(again.columns()[name], values), name


def test_files_that_do_not_hold_a_motion_are_refused_in_a_sentence(
    motion: Trajectory, tmp_path: Path
) -> None:
    read = Trajectory.from_npz
    (tmp_path / "text").write_text("no such file")
    with pytest.raises(InvalidInput, match=r"^source: required a.*given /"):
        read(tmp_path / "text")
    motion.to_npz(tmp_path / "part", ["q"])
    with pytest.raises(InvalidInput, match=r"given one without q_dot, frame, "):
        read(tmp_path / "part")


def test_rotations_carry_the_body_into_space(motion: Trajectory, rng: np.random.Generator) -> None:
    space = motion.rotations.apply(motion.q.copy())
    assert np.allclose(space, [1, 0, 0], atol=1e-13)
    vector = rng.normal(size=3)
    assert np.allclose(motion.rotations.apply(vector), vector @ motion.frame, atol=1e-13)
    # ω is in the body: ġ = gω, so that a fixed vector of the body moves in space by g(ωx).
    ahead = motion.at(motion.times + 1e-5).rotations.apply(vector)
    behind = motion.at(motion.times - 1e-5).rotations.apply(vector)
    velocity = motion.rotations.apply(motion.omega @ vector)
    assert np.allclose((ahead - behind) / 2e-5, velocity, atol=1e-8)


def test_quaternions_and_euler_angles_are_those_of_the_frame(motion: Trajectory) -> None:
    p = motion.quaternions(scalar_first=True)
    assert np.allclose(np.linalg.norm(p, axis=1), 1, atol=1e-14)
    assert np.max(np.abs(np.diff(p, axis=0))) < 0.2  # no jump of sign in 60 units of time
    assert np.array_equal(motion.quaternions(), np.roll(p, -1, axis=1))
    w, x, y, z = p.T
    assert np.allclose(motion.frame[:, 0, 0], 1 - 2 * (y * y + z * z), atol=1e-14)
    assert np.allclose(motion.frame[:, 2, 1], 2 * (y * z - w * x), atol=1e-14)
    angles = motion.euler_angles("XZX", degrees=True)
    assert np.allclose(np.cos(np.radians(angles[:, 1])), motion.q[:, 0], atol=1e-13)


def test_attitudes_of_other_bodies_are_refused() -> None:
    reflected = vs.Veselova([3, 2, 1], *START, frame=solve(PROBLEMS["veselova"], 0).frame[0])
    flipped = vs.Veselova([3, 2, 1], *START, frame=reflected.frame * [1, 1, -1])
    body4 = vs.Veselova([4, 3, 2, 1], [1, 0, 0, 0], [0, 1, 0.5, 0])
    for problem, message in (
        (flipped, "frame: required a frame of determinant 1"),
        (body4, "3 × 3 numbers; given 4 × 4"),
        (PROBLEMS["stiefel"], "a system with a frame; given stiefel"),
    ):
        with pytest.raises(InvalidInput, match=message):
            solve(problem, [0, 1]).quaternions()
    for sequence in ("ZZX", "XY", "XyZ", "ABC", 3, "xzxz"):
        with pytest.raises(InvalidInput, match="sequence: required three of the letters"):
            solve(PROBLEMS["veselova"], 0).euler_angles(sequence)  # type: ignore[arg-type]
